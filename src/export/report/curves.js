"use strict";
// Curves of a run over frequency.

/** Where the linear peak is more than so many times higher, the scale is that of the curve with friction. */
const MUCH_HIGHER = 2.5;

const largestOf = (values) => values.reduce((most, v) => (v > most ? v : most), 0);

/** The scale of amplitudes that shows most: `friction`, or `all` where the linear curve leaves room for the other one. */
function bestScale({ amplitude_m, linear }) {
  const own = largestOf(amplitude_m);
  return own > 0 && largestOf(linear.amplitude_m) > MUCH_HIGHER * own ? "friction" : "all";
}

/** An error of one digit, and of two where the first is 1. */
function errorText(error) {
  const digits = error.toExponential(1).startsWith("1") ? 2 : 1;
  return `${Number((100 * error).toPrecision(digits))} %`;
}

function amplitudeChart(place, curves, state) {
  return new Chart(place, () => {
    const curve = curves[state.observation];
    const scaling = state.scale ?? bestScale(curve);
    const own = curve.frequency_hz, peak = largestOf(curve.amplitude_m);
    const highest = scaling === "friction" ? peak : Math.max(peak, largestOf(curve.linear.amplitude_m));
    const { factor, unit } = lengthUnit(highest);
    const errorAt = (x) => curve.estimated_error[own.indexOf(x)];
    const scale = (y) => y.map((v) => (v == null ? null : v * factor));
    const bound = (sign) => curve.amplitude_m.map((v, i) => {
      const error = curve.estimated_error[i];
      return v == null || error == null ? v : v * Math.max(1e-3, 1 + sign * error);
    });
    const value = (plot, _, series, index) => {
      const v = valueAt(plot, series, index);
      return v == null ? "–" : withPrefix(v / factor, "m");
    };
    const withError = (plot, v, series, index) => {
      const error = index == null ? null : errorAt(plot.data[0][index]);
      return error > 1e-4 ? `${value(plot, v, series, index)} ± ${errorText(error)}` : value(plot, v, series, index);
    };
    const line = (label, x, y, style) => ({ x, y: scale(y), series: { label, value, points: { show: false }, ...style } });
    const hidden = { stroke: "transparent", width: 0 };
    const lines = [
      line("linear", curve.linear.frequency_hz, curve.linear.amplitude_m, { stroke: colourOf("--linear"), width: 1.5, dash: [6, 4] }),
      line("", own, bound(1), hidden),
      line("", own, bound(-1), hidden),
    ];
    if (curve.compared)
      lines.push(line(curve.compared.label, curve.compared.frequency_hz, curve.compared.amplitude_m, { stroke: colourOf("--compared"), width: 1.8 }));
    lines.push(line(curve.label, own, curve.amplitude_m, { stroke: colourOf("--own"), width: 2.2, value: withError }));
    for (const { label, x, y } of state.measured)
      lines.push(line(label, x, y, { stroke: colourOf("--measured"), width: 1, points: { show: true, size: 5 } }));
    const data = joined(lines), at = curve.amplitude_m.indexOf(peak);
    const marked = at < 0 || peak === 0 ? [] : [{
      x: own[at], y: peak * factor, colour: colourOf("--own"),
      text: `${curve.peak} at ${Number(own[at].toPrecision(6))} Hz`,
    }];
    // Of what is seen: the columns that the scale is to show, from zero on.
    const shown = scaling === "friction" ? [2] : data.slice(1).map((_, i) => i + 1);
    const range = (plot) => {
      const [from, to] = plot.series[0].idxs ?? [0, data[0].length - 1];
      const seen = shown.flatMap((column) => [...data[column].slice(from, to + 1)]);
      return [0, 1.12 * largestOf(seen) || 1];
    };
    const y = scaling === "logarithmic" ? { distr: 3 } : { range };
    return {
      data,
      series: lines.map((l) => l.series),
      bands: [{ series: [2, 3], fill: colourOf("--band") }],
      scales: { y },
      axes: [{ label: `amplitude of ${curve.name}, ${unit}` }],
      rest: at < 0 ? null : data[0].indexOf(own[at]),
      marked,
    };
  });
}

/** Index of the frequency of the peak. */
function indexOfPeak(frequency_hz, peak_hz) {
  const found = frequency_hz.indexOf(peak_hz);
  return found < 0 ? null : found;
}

function countsChart(place, counts, states, peak_hz) {
  return new Chart(place, () => {
    const columns = [counts.stuck, counts.slipping, counts.opening, counts.closing, counts.open];
    const lines = states
      .map(({ many, colour }, i) => ({ many, colour, y: columns[i], always: i < 3 }))
      .filter(({ y, always }) => always || y.some((n) => n));
    return {
      data: [counts.frequency_hz, ...lines.map((l) => l.y)],
      series: lines.map(({ many, colour }) => ({
        label: many, stroke: css(colour), width: 2, points: { show: false }, value: (_, v) => v ?? "–",
      })),
      scales: {},
      axes: [{ label: "pairs" }],
      rest: indexOfPeak(counts.frequency_hz, peak_hz),
    };
  });
}

function powersChart(place, counts, peak_hz) {
  return new Chart(place, () => {
    const both = [...counts.friction_w, ...counts.damping_w].map((v) => Math.abs(v ?? 0));
    const { prefix, divisor } = prefixOf(largestOf(both));
    const line = (label, y, stroke) => ({
      y: y.map((v) => (v == null ? null : v / divisor)),
      series: { label, stroke: colourOf(stroke), width: 2, points: { show: false }, value: (_, v) => (v == null ? "–" : withPrefix(v * divisor, "W", 3)) },
    });
    const lines = [line("friction", counts.friction_w, "--friction"), line("damping", counts.damping_w, "--damping")];
    return {
      data: [counts.frequency_hz, ...lines.map((l) => l.y)],
      series: lines.map((l) => l.series),
      scales: {},
      axes: [{ label: `power, ${prefix}W` }],
      rest: indexOfPeak(counts.frequency_hz, peak_hz),
    };
  });
}

function phaseChart(place, curves, state, peak_hz) {
  return new Chart(place, () => {
    const curve = curves[state.observation];
    return {
      data: [curve.frequency_hz, curve.phase_deg],
      series: [{ label: "behind the force", stroke: colourOf("--own"), width: 2, points: { show: false }, value: (_, v) => (v == null ? "–" : `${v.toFixed(1)}°`) }],
      scales: {},
      axes: [{ label: "degrees" }],
      rest: indexOfPeak(curve.frequency_hz, peak_hz),
    };
  });
}

/** Two columns of numbers: frequency in Hz, amplitude in m. Lines that begin otherwise are left out. */
function measuredCurve(text, label) {
  const rows = text.split(/\r?\n/).map((row) => row.split(/[,;\t ]+/).map(Number));
  const points = rows.filter((r) => r.length >= 2 && Number.isFinite(r[0]) && Number.isFinite(r[1]) && r[0] > 0);
  points.sort((a, b) => a[0] - b[0]);
  return { label, x: points.map((p) => p[0]), y: points.map((p) => p[1]) };
}

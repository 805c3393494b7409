"use strict";
// Curves over frequency, by uPlot.

/** A colour of the page's style sheet. */
const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** With an SI prefix. */
function withPrefix(value, unit, digits = 4) {
  if (value == null || !Number.isFinite(value)) return "–";
  if (value === 0) return `0 ${unit}`.trim();
  if (unit === "") return Number(value.toPrecision(digits)).toString();
  const power = Math.min(4, Math.max(-4, Math.floor(Math.log10(Math.abs(value)) / 3 + 1e-12)));
  const prefix = ["p", "n", "µ", "m", "", "k", "M", "G", "T"][power + 4];
  const scaled = value / 10 ** (3 * power);
  return `${Number(scaled.toPrecision(digits))} ${prefix}${unit}`;
}

/** Lengths of one axis in one unit. */
function lengthUnit(largest) {
  const power = Math.min(0, Math.max(-4, Math.floor(Math.log10(largest || 1) / 3 + 1e-12)));
  return { factor: 10 ** (-3 * power), unit: ["pm", "nm", "µm", "mm", "m"][power + 4] };
}

/** A chart that follows the width and the colours of the page. `make` gives the options without size, and the data. */
class Chart {
  constructor(place, make) {
    this.place = place;
    this.make = make;
    this.draw();
    let width = place.clientWidth;
    new ResizeObserver(() => {
      if (place.clientWidth !== width && this.plot) {
        width = place.clientWidth;
        this.plot.setSize(this.size());
      }
    }).observe(place);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  size() {
    const width = Math.max(280, this.place.clientWidth);
    return { width, height: Math.round(Math.min(460, Math.max(260, 0.42 * width))) };
  }

  draw() {
    this.plot?.destroy();
    const { series, axes, scales, data, bands } = this.make();
    const rule = { stroke: colourOf("--rule"), width: 1 };
    const axis = (a) => ({
      stroke: colourOf("--quiet"), grid: rule, ticks: rule, font: "13px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif", ...a,
    });
    this.plot = new uPlot({
      ...this.size(),
      cursor: { drag: { x: true, y: false } },
      scales: { x: { time: false }, ...scales },
      axes: [axis({ label: "frequency, Hz" }), ...axes.map((a) => axis({ size: 64, ...a }))],
      series: [{ label: "Hz", value: (_, v) => (v == null ? "–" : v.toFixed(3)) }, ...series],
      bands,
    }, data, this.place);
  }
}

/** uPlot's data of lines that have frequencies of their own: values where a line has none are left to span. */
function joined(lines) {
  return uPlot.join(
    lines.map(({ x, y }) => [x, y]),
    lines.map(() => [2]),
  );
}

function amplitudeChart(place, curves, state) {
  return new Chart(place, () => {
    const curve = curves[state.observation];
    const all = [...curve.amplitude_m, ...curve.linear.amplitude_m].filter((v) => v != null);
    const { factor, unit } = lengthUnit(Math.max(...all));
    const value = (_, v) => (v == null ? "–" : withPrefix(v / factor, "m"));
    const scale = (y) => y.map((v) => (v == null ? null : v * factor));
    const bound = (sign) => curve.amplitude_m.map((v, i) => {
      const error = curve.estimated_error[i];
      return v == null || error == null ? v : v * Math.max(1e-3, 1 + sign * error);
    });
    const line = (label, x, y, style) => ({ x, y: scale(y), series: { label, value, spanGaps: true, points: { show: false }, ...style } });
    const own = curve.frequency_hz, hidden = { stroke: "transparent", width: 0 };
    const lines = [
      line("linear", curve.linear.frequency_hz, curve.linear.amplitude_m, { stroke: colourOf("--grey"), width: 1.5, dash: [6, 4] }),
      line("with the estimated error, at most", own, bound(1), hidden),
      line("at least", own, bound(-1), hidden),
    ];
    if (curve.compared)
      lines.push(line(curve.compared.label, curve.compared.frequency_hz, curve.compared.amplitude_m, { stroke: colourOf("--green"), width: 1.5 }));
    lines.push(line(curve.label, own, curve.amplitude_m, { stroke: colourOf("--blue"), width: 2.2 }));
    for (const { label, x, y } of state.measured)
      lines.push(line(label, x, y, { stroke: colourOf("--orange"), width: 1, points: { show: true, size: 5 } }));
    return {
      data: joined(lines),
      series: lines.map((l) => l.series),
      bands: [{ series: [2, 3], fill: colourOf("--band") }],
      scales: { y: state.logarithmic ? { distr: 3 } : {} },
      axes: [{ label: `amplitude of ${curve.name}, ${unit}` }],
    };
  });
}

function countsChart(place, counts) {
  return new Chart(place, () => {
    const line = (label, y, colour) => ({ y, series: { label, stroke: colourOf(colour), width: 2, points: { show: false }, value: (_, v) => v ?? "–" } });
    const lines = [
      line("slip", counts.slipping, "--blue"),
      line("open", counts.opening, "--orange"),
      line("stick", counts.stuck, "--green"),
    ];
    if (counts.open_at_rest.some((n) => n)) lines.push(line("open at rest", counts.open_at_rest, "--grey"));
    const power = (label, y, dash) => ({
      y, series: { label, scale: "power", stroke: colourOf("--red"), width: 1.5, dash, points: { show: false }, value: (_, v) => withPrefix(v, "W", 3) },
    });
    lines.push(power("friction", counts.friction_w), power("damping", counts.damping_w, [5, 4]));
    return {
      data: [counts.frequency_hz, ...lines.map((l) => l.y)],
      series: lines.map((l) => l.series),
      scales: {},
      axes: [
        { label: "pairs" },
        { label: "power, W", scale: "power", side: 1, grid: { show: false } },
      ],
    };
  });
}

function phaseChart(place, curves, state) {
  return new Chart(place, () => {
    const curve = curves[state.observation];
    return {
      data: [curve.frequency_hz, curve.phase_deg],
      series: [{ label: "behind the force", stroke: colourOf("--blue"), width: 2, points: { show: false }, value: (_, v) => (v == null ? "–" : `${v.toFixed(1)}°`) }],
      scales: {},
      axes: [{ label: "degrees" }],
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

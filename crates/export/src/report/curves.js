"use strict";
// Curves of a run over frequency.

const largestOf = (values) => values.reduce((most, v) => (v > most ? v : most), 0);

/** The scale that shows most: that of the curves with `friction`, or of `all` where the linear curve leaves them room. */
const bestScale = ({ curves, highest }) => (curves.some(({ points }) => largestOf(points.y) > highest) ? "friction" : "all");

/**
 * Parts of a curve along which the frequency rises, or falls and is turned round; one that turns back belongs to both
 * parts. A point without a value at the frequency of the one before ends a branch.
 */
function passes({ x, y, error }) {
  const parts = [];
  let part = null;
  for (let i = 0; i < x.length; i++) {
    const last = part?.at(-1);
    if (i > 0 && y[i] == null && x[i] === x[i - 1]) {
      part = null;
      continue;
    }
    if (part?.length > 1 && (x[i] > x[last]) !== (x[part[1]] > x[part[0]])) parts.push((part = [last]));
    if (!part) parts.push((part = []));
    part.push(i);
  }
  return parts.map((own) => {
    if (x[own[0]] > x[own.at(-1)]) own.reverse();
    const of = (values) => own.map((i) => values[i]);
    return { x: of(x), y: of(y), ...(error && { error: of(error) }) };
  });
}

/** An error of one digit, and of two where the first is 1. */
function errorText(error) {
  const digits = error.toExponential(1).startsWith("1") ? 2 : 1;
  return `${Number((100 * error).toPrecision(digits))} %`;
}

/**
 * A chart of what `chosen()` gives: the curves of one quantity. The legend reads the values at `peak_hz` where no pointer
 * is. `state` has the scale of amplitudes and the measured curves that are laid over them.
 */
function curveChart(place, chosen, peak_hz, state = null) {
  return new Chart(place, () => {
    const { quantity, unit, curves, along, ...more } = chosen(), own = curves.at(-1), { error } = own.points;
    const scaling = state && (state.scale ?? bestScale({ curves, ...more }));
    const withFriction = curves.filter(({ kind }) => scaling !== "friction" || kind !== "linear");
    const sizes = withFriction.flatMap(({ points }) => points.y.map((v) => Math.abs(v ?? 0)));
    const axis = axisUnit(unit, largestOf(sizes)), scaled = (y) => y.map((v) => (v == null ? null : v * axis.factor));
    const value = (plot, _, series, index) => {
      const v = valueAt(plot, series, index);
      return v == null ? "–" : withPrefix(v / axis.factor, unit);
    };
    const withError = ({ x, error }) => (plot, v, series, index) => {
      const share = index == null ? null : error[x.indexOf(plot.data[0][index])];
      return share > 1e-4 ? `${value(plot, v, series, index)} ± ${errorText(share)}` : value(plot, v, series, index);
    };
    // The scale shows what is seen of the lines that are scaling, from zero on.
    const line = (label, { x, y }, style, isScaling = true) =>
      ({ x, y: scaled(y), isScaling, series: { label, value, points: { show: false }, ...style } });
    const drawnLine = ({ label, kind, dashed, points }) => passes(points).map((pass) => ({ kind, ...line(label, pass, {
      stroke: colourOf(`--${kind}`), width: { tractions: 1, linear: 1.5 }[kind] ?? 2, ...(dashed && { dash: [6, 4] }),
      ...(points === own.points && error && { value: withError(pass) }),
    }, scaling !== "friction" || kind !== "linear") }));
    const bound = ({ x, y, error }, sign) => line("", {
      x, y: y.map((v, i) => (v == null || error[i] == null ? v : v * Math.max(1e-3, 1 + sign * error[i]))),
    }, { stroke: "transparent", width: 0 });
    const bounds = error ? passes(own.points).flatMap((pass) => [bound(pass, 1), bound(pass, -1)]) : [];
    const measured = (state?.measured ?? []).map(({ label, x, y }) =>
      line(label, { x, y }, { stroke: colourOf("--measured"), width: 1, points: { show: true, size: 5 } }, scaling === "all"));
    // Frequencies without a motion are marked at the lower edge.
    const failed = own.points.x.filter((x, i) => own.points.y[i] == null && !(i > 0 && x === own.points.x[i - 1]));
    const values = own.points.y.filter((v) => v != null && (v > 0 || !scaling));
    const edge = scaling && scaling !== "logarithmic" ? 0 : values.reduce((least, v) => Math.min(least, v), values[0] ?? 0);
    const marks = failed.length === 0 ? [] : [line("no motion found", { x: failed, y: failed.map(() => edge) }, {
      stroke: colourOf("--orange"), width: 0, value: () => "", points: { show: true, size: 7 },
    }, false)];
    const lines = [...bounds, ...curves.flatMap(drawnLine), ...measured, ...marks], data = joined(lines);
    // The ends of the range over starting tractions, the upper one second.
    const ofRange = lines.flatMap(({ kind }, i) => (kind === "tractions" ? [i + 1] : []));
    const columns = data.slice(1).filter((_, i) => lines[i].isScaling);
    const range = (plot) => {
      const [from, to] = plot.series[0].idxs ?? [0, data[0].length - 1];
      return [0, 1.12 * largestOf(columns.flatMap((column) => [...column.slice(from, to + 1)])) || 1];
    };
    const rest = data[0].indexOf(own.peak ? own.peak[0] : peak_hz);
    return {
      data, along,
      series: lines.map((l) => l.series),
      bands: [
        ...bounds.flatMap((_, i) => (i % 2 ? [{ series: [i, i + 1], fill: colourOf("--band") }] : [])),
        ...(ofRange.length === 2 ? [{ series: [ofRange[1], ofRange[0]], fill: colourOf("--tractions-band") }] : []),
      ],
      scales: scaling ? { y: scaling === "logarithmic" ? { distr: 3 } : { range } } : {},
      axes: [{ label: axis.unit ? `${quantity} (${axis.unit})` : quantity }],
      rest: rest < 0 ? null : rest,
      marked: own.peak ? [{ x: own.peak[0], y: own.peak[1] * axis.factor, text: own.peak[2], colour: colourOf(`--${own.kind}`) }] : [],
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

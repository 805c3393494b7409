"use strict";
// Curves of a run over frequency.

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
      line("open at times", counts.opening, "--orange"),
      line("stick", counts.stuck, "--green"),
    ];
    if (counts.closing.some((n) => n)) lines.push(line("close at times", counts.closing, "--purple"));
    if (counts.open.some((n) => n)) lines.push(line("stay open", counts.open, "--grey"));
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

"use strict";
// What the scripts of every report share: elements, colours, units, charts by uPlot.

const byId = (id) => document.getElementById(id);

/** Pictures that were drawn, for who asks whether one is missing. */
const drawn = [];

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
    const { series, axes, data, ...more } = this.make();
    const rule = { stroke: colourOf("--rule"), width: 1 };
    const axis = (a) => ({
      stroke: colourOf("--quiet"), grid: rule, ticks: rule, font: "13px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif", ...a,
    });
    this.plot = new uPlot({
      ...this.size(),
      cursor: { drag: { x: true, y: false } },
      ...more,
      scales: { x: { time: false }, ...more.scales },
      axes: [axis({ label: "frequency, Hz" }), ...axes.map((a) => axis({ size: 64, ...a }))],
      series: [{ label: "Hz", value: (_, v) => (v == null ? "–" : v.toFixed(3)) }, ...series],
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

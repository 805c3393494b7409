"use strict";
// What the scripts of every report share: elements, colours, units, charts by uPlot.

const byId = (id) => document.getElementById(id);

/** What the page was made from. */
const data = JSON.parse(byId("data").textContent);

/** Pictures that were drawn, for who asks whether one is missing. */
const drawn = [];

/** A colour of the page's style sheet. */
const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** The SI prefix that leaves one to three digits before the point, and what it divides by. */
function prefixOf(largest) {
  const size = Math.abs(largest) || 1;
  const power = Math.min(4, Math.max(-4, Math.floor(Math.log10(size) / 3 + 1e-12)));
  return { prefix: ["p", "n", "µ", "m", "", "k", "M", "G", "T"][power + 4], divisor: 10 ** (3 * power) };
}

/** Units that take no prefix. */
const PLAIN = ["", "°"];

/** With an SI prefix. */
function withPrefix(value, unit, digits = 4) {
  if (value == null || !Number.isFinite(value)) return "–";
  if (PLAIN.includes(unit)) return `${Number.isInteger(value) ? value : Number(value.toPrecision(digits))}${unit}`.replace("-", "−");
  const { prefix, divisor } = value === 0 ? { prefix: "", divisor: 1 } : prefixOf(value);
  return `${Number((value / divisor).toPrecision(digits))} ${prefix}${unit}`.replace("-", "−");
}

/** The unit of an axis that reaches to `largest`, and the factor to it. */
function axisUnit(unit, largest) {
  const { prefix, divisor } = PLAIN.includes(unit) ? { prefix: "", divisor: 1 } : prefixOf(largest);
  return { factor: 1 / divisor, unit: `${prefix}${unit}` };
}

/** About `wanted` numbers from low to high, at 1, 2 or 5 times a power of ten, each with its text. */
function roundTicks(low, high, wanted) {
  const least = (high - low) / Math.max(1, wanted);
  if (!(least > 0 && Number.isFinite(least))) return [{ at: low, text: String(low) }];
  const power = 10 ** Math.floor(Math.log10(least));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= 0.999999 * least);
  const decimals = Math.min(12, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  const [first, last] = [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
  return Array.from({ length: last - first + 1 }, (_, i) => {
    const at = (first + i) * step;
    return { at, text: (Math.abs(at) < 1e-9 * step ? 0 : at).toFixed(decimals).replace("-", "−") };
  });
}

/** The value of a series at a place where another one has a point: on the straight line between its neighbours. */
function valueAt(plot, series, index) {
  const [x, y] = [plot.data[0], plot.data[series]];
  if (index == null || y[index] !== undefined) return index == null ? null : y[index];
  const next = (step) => {
    let i = index;
    while (i >= 0 && i < y.length && y[i] === undefined) i += step;
    return i;
  };
  const [before, after] = [next(-1), next(1)];
  if (y[before] == null || y[after] == null) return null;
  return y[before] + ((y[after] - y[before]) * (x[index] - x[before])) / (x[after] - x[before]);
}

/** What a line is shown by in a legend, as a background of CSS. */
function markOf({ stroke, dash }) {
  return dash ? `repeating-linear-gradient(90deg, ${stroke} 0 5px, transparent 5px 8px)` : stroke;
}

/**
 * A chart that follows the width and the colours of the page. `make` gives the options without size, the data, the
 * index `rest` that the legend reads where no pointer is, and `marked` places with words: { x, y, text, colour }.
 * A series without a label stands in no legend.
 */
class Chart {
  constructor(place, make) {
    this.place = place;
    this.make = make;
    this.draw();
    let width = place.clientWidth;
    // In the next frame: a chart of another size is one more change of the place.
    new ResizeObserver(() => requestAnimationFrame(() => {
      if (place.clientWidth !== width && this.plot) {
        width = place.clientWidth;
        this.plot.setSize(this.size());
      }
    })).observe(place);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  size() {
    const width = Math.max(280, this.place.clientWidth);
    return { width, height: Math.round(Math.min(460, Math.max(260, 0.42 * width))) };
  }

  draw() {
    this.plot?.destroy();
    const { series, axes, data, rest, marked, along, ...more } = this.make();
    // Along an engine order the speed moves with the frequency.
    const rpm = (hz) => Number(((60 * hz) / along).toPrecision(5));
    const both = (_, values) => values.map((v) => (v == null ? "" : `${rpm(v)} rpm\n${Number(v.toPrecision(9))} Hz`));
    const across = along
      ? { label: `speed and frequency along engine order ${along}`, values: both, size: 64, space: 90 }
      : { label: "frequency (Hz)" };
    const place = (v) => `${along ? `${rpm(v)} rpm, ` : ""}${Number(v.toPrecision(6))} Hz`;
    const rule = { stroke: colourOf("--rule"), width: 1 };
    const plain = (_, values) => values.map((v) => (v == null ? "" : String(Number(v.toPrecision(9))).replace("-", "−")));
    const axis = (a) => ({
      stroke: colourOf("--quiet"), grid: rule, ticks: rule, font: "13px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif",
      values: plain, ...a,
    });
    const marks = series.map(markOf);
    const resting = (plot) => {
      if (plot.cursor.idx == null && rest != null) plot.setLegend({ idx: rest }, false);
    };
    this.plot = new uPlot({
      ...this.size(),
      cursor: { drag: { x: true, y: false } },
      legend: { markers: { width: 0, fill: (_, i) => marks[i - 1] ?? "transparent" } },
      ...more,
      hooks: { ready: [resting], setCursor: [resting], draw: [(plot) => drawMarks(plot, marked ?? [])] },
      scales: { x: { time: false }, ...more.scales },
      axes: [axis(across), ...axes.map((a) => axis({ size: 64, ...a }))],
      series: [
        { label: along ? "speed" : "frequency", class: "at", value: (_, v) => (v == null ? "–" : place(v)) },
        // Places are not rounded to whole pixels, which would make stairs of slopes.
        ...series.map((s) => ({ pxAlign: 0, ...s, class: s.label ? null : "unnamed" })),
      ],
    }, data, this.place);
  }
}

/** A ring at each place that is seen, and its words beside it. */
function drawMarks(plot, marked) {
  const { ctx, bbox } = plot, ratio = uPlot.pxRatio;
  ctx.save();
  ctx.lineWidth = 2 * ratio;
  ctx.font = `600 ${13 * ratio}px system-ui, sans-serif`;
  ctx.textBaseline = "middle";
  for (const { x, y, text, colour } of marked) {
    const [left, top] = [plot.valToPos(x, "x", true), plot.valToPos(y, "y", true)];
    const inside = left >= bbox.left && left <= bbox.left + bbox.width && top >= bbox.top && top <= bbox.top + bbox.height;
    if (!inside) continue;
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.beginPath();
    ctx.arc(left, top, 5 * ratio, 0, 2 * Math.PI);
    ctx.stroke();
    const half = 0.5 * ctx.measureText(text).width + 4 * ratio;
    ctx.textAlign = "center";
    const within = (v, low, high) => Math.min(Math.max(v, low), high);
    ctx.fillText(text, within(left, bbox.left + half, bbox.left + bbox.width - half), Math.max(top - 16 * ratio, bbox.top + 9 * ratio));
  }
  ctx.restore();
}

/**
 * uPlot's data of lines that have frequencies of their own: a line spans those where it has no point, and breaks where
 * its value is null.
 */
function joined(lines) {
  const EXPAND_NULL = 2;
  return uPlot.join(
    lines.map(({ x, y }) => [x, y]),
    lines.map(() => [0, EXPAND_NULL]),
  );
}

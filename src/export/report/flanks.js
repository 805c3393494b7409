"use strict";
// Flanks unrolled in their planes, and hysteresis loops.

/** 256 colours from dark to light, after viridis (Smith, van der Walt). */
const RAMP = (() => {
  const p = [
    [0.2777, 0.0054, 0.334], [0.105, 1.4046, 1.3845], [-0.3308, 0.2148, 0.095], [-4.6342, -5.7991, -19.3324],
    [6.2282, 14.1799, 56.6905], [4.7763, -13.7451, -65.353], [-5.4354, 4.6458, 26.3124],
  ];
  const colour = (t) => [0, 1, 2].map((c) => Math.round(255 * Math.min(1, Math.max(0, p.reduceRight((sum, q) => sum * t + q[c], 0)))));
  return Array.from({ length: 256 }, (_, i) => colour(i / 255));
})();
const css = ([r, g, b]) => `rgb(${r},${g},${b})`;

/** What a pair does in a period, by its code. */
const STATUSES = [
  { word: "sticks", many: "stick", colour: [140, 150, 160] },
  { word: "slips", many: "slip", colour: [24, 110, 190] },
  { word: "opens at times", many: "open at times", colour: [222, 110, 20] },
  { word: "closes at times", many: "close at times", colour: [170, 90, 170] },
  { word: "stays open", many: "stay open", colour: [235, 200, 120] },
];

/** All flanks in one canvas, each with its name and edges. `paint(pair)` gives a colour, `tell(pair)` a text. */
class FlankMap {
  constructor(place, flanks) {
    this.place = place;
    this.flanks = flanks;
    this.canvas = place.appendChild(document.createElement("canvas"));
    this.legend = place.appendChild(document.createElement("div"));
    this.legend.className = "bar-of-colours";
    this.hint = place.appendChild(document.createElement("div"));
    this.hint.className = "hint";
    this.canvas.addEventListener("pointermove", (e) => this.point(e));
    this.canvas.addEventListener("pointerleave", () => (this.hint.style.display = "none"));
    new ResizeObserver(() => this.draw()).observe(place);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  show(paint, tell) {
    this.paint = paint;
    this.tell = tell;
    this.draw();
  }

  draw() {
    const width = this.place.clientWidth;
    if (!this.paint || width === 0) return;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const margin = { left: 30, right: 30, top: 26, bottom: 24 };
    const longest = Math.max(...this.flanks.map((f) => f.size[0]));
    const tallest = Math.max(...this.flanks.map((f) => f.size[1]));
    const scale = Math.min((width - margin.left - margin.right) / longest, 260 / tallest);
    let top = 0;
    this.shapes = [];
    const panels = this.flanks.map((flank) => {
      const panel = { flank, left: margin.left, top: top + margin.top, width: scale * flank.size[0], height: scale * flank.size[1] };
      top = panel.top + panel.height + margin.bottom;
      return panel;
    });
    Object.assign(this.canvas, { width: Math.round(ratio * width), height: Math.round(ratio * top) });
    this.canvas.style.height = `${top}px`;
    const g = this.canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const { flank, left, top, width, height } of panels) {
      for (const { pair, outline } of flank.patches) {
        const shape = new Path2D();
        for (const [x, y] of outline) shape.lineTo(left + scale * x, top + height - scale * y);
        shape.closePath();
        g.fillStyle = g.strokeStyle = css(this.paint(pair));
        g.lineWidth = 0.6;
        g.fill(shape);
        g.stroke(shape);
        this.shapes.push({ pair, shape, flank });
      }
      this.names(g, flank, left, top, width, height);
    }
  }

  names(g, flank, left, top, width, height) {
    const [before, after, below, above] = flank.edges;
    g.font = "13px system-ui, sans-serif";
    g.fillStyle = colourOf("--ink");
    g.textAlign = "left";
    g.fillText(flank.name, left, top - 8);
    g.fillStyle = colourOf("--quiet");
    g.textAlign = "right";
    g.fillText(above, left + width, top - 8);
    g.fillText(below, left + width, top + height + 16);
    const upright = (text, x) => {
      g.save();
      g.translate(x, top + height / 2);
      g.rotate(-Math.PI / 2);
      g.textAlign = "center";
      if (g.measureText(text).width <= Math.max(height, 60)) g.fillText(text, 0, 0);
      g.restore();
    };
    upright(before, left - 10);
    upright(after, left + width + 18);
  }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    const ratio = this.canvas.width / box.width;
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const g = this.canvas.getContext("2d");
    const found = this.shapes.find(({ shape }) => g.isPointInPath(shape, ratio * x, ratio * y));
    this.hint.style.display = found ? "block" : "none";
    if (!found) return;
    this.hint.textContent = `pair ${found.pair}: ${this.tell(found.pair)}`;
    this.hint.style.left = `${Math.min(Math.max(x, 90), box.width - 90)}px`;
    this.hint.style.top = `${y}px`;
  }
}

/** Least and largest value, and where a value lies between them. */
function rangeOf(values) {
  const low = Math.min(0, ...values), high = Math.max(...values);
  const span = high > low ? high - low : 1;
  return { low, high: low + span, at: (v) => (v - low) / span };
}

/** A strip of colours with its ends. */
function colourBar(place, low, high, unit) {
  place.replaceChildren();
  const strip = place.appendChild(document.createElement("canvas"));
  [strip.width, strip.height] = [256, 1];
  const g = strip.getContext("2d");
  RAMP.forEach((c, i) => {
    g.fillStyle = css(c);
    g.fillRect(i, 0, 1, 1);
  });
  const ends = place.appendChild(document.createElement("div"));
  for (const v of [low, (low + high) / 2, high]) ends.appendChild(document.createElement("span")).textContent = withPrefix(v, unit, 3);
}

function showField(map, field) {
  const range = rangeOf(field.values);
  const colour = (pair) => RAMP[Math.round(255 * Math.min(1, Math.max(0, range.at(field.values[pair]))))];
  map.show(colour, (pair) => withPrefix(field.values[pair], field.unit, 4));
  colourBar(map.legend, range.low, range.high, field.unit);
}

function showStatuses(map, codes, pairs, at) {
  const code = (pair) => codes[at * pairs + pair];
  map.show((pair) => STATUSES[code(pair)].colour, (pair) => STATUSES[code(pair)].word);
  statusLegend(map.legend, code, pairs);
}

/** How many pairs do what. */
function statusLegend(place, code, pairs) {
  place.replaceChildren();
  const line = place.appendChild(document.createElement("div"));
  line.style.cssText = "justify-content:flex-start;gap:18px;flex-wrap:wrap";
  STATUSES.forEach(({ word, many, colour }, i) => {
    let count = 0;
    for (let pair = 0; pair < pairs; pair++) count += code(pair) === i;
    if (count === 0) return;
    const entry = line.appendChild(document.createElement("span"));
    const square = entry.appendChild(document.createElement("i"));
    square.style.cssText = `display:inline-block;width:12px;height:12px;border-radius:2px;margin-right:6px;background:${css(colour)}`;
    entry.append(`${count} ${count === 1 ? word : many}`);
  });
}

/** A closed path of force over displacement. */
function drawLoop(place, loop) {
  const NS = "http://www.w3.org/2000/svg", [width, height, left, below, above, right] = [300, 210, 60, 34, 20, 12];
  const figure = place.appendChild(document.createElement("figure"));
  const svg = figure.appendChild(document.createElementNS(NS, "svg"));
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const add = (name, attributes, text) => {
    const element = svg.appendChild(document.createElementNS(NS, name));
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text) element.textContent = text;
  };
  const ends = (values) => {
    const [low, high] = [Math.min(...values), Math.max(...values)];
    return high > low ? [low, high] : [low - 1, high + 1];
  };
  const [x0, x1] = ends(loop.displacement_m), [y0, y1] = ends(loop.force_n);
  const x = (v) => left + 6 + ((v - x0) / (x1 - x0)) * (width - left - right - 12);
  const y = (v) => height - below - 6 - ((v - y0) / (y1 - y0)) * (height - below - above - 12);
  const path = loop.displacement_m.map((v, i) => `${i ? "L" : "M"}${x(v).toFixed(1)} ${y(loop.force_n[i]).toFixed(1)}`);
  add("path", { d: `M${left} ${above}V${height - below}H${width - right}`, fill: "none", stroke: "var(--grey)" });
  add("path", { d: `${path.join("")}Z`, fill: "var(--band)", stroke: "var(--blue)", "stroke-width": 1.8, "stroke-linejoin": "round" });
  const text = { fill: "var(--quiet)", "font-size": 12 };
  const end = { ...text, "text-anchor": "end" };
  add("text", { ...text, x: left, y: height - 14 }, withPrefix(x0, "m", 3));
  add("text", { ...end, x: width - right, y: height - 14 }, withPrefix(x1, "m", 3));
  add("text", { ...end, x: left - 6, y: above + 10 }, withPrefix(y1, "N", 3));
  add("text", { ...end, x: left - 6, y: height - below }, withPrefix(y0, "N", 3));
  figure.appendChild(document.createElement("figcaption")).textContent = `${loop.title}: ${withPrefix(loop.friction_energy_j, "J", 3)} in a period`;
}

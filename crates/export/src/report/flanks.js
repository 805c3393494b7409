"use strict";
// Flanks unrolled in their planes, and hysteresis loops.

/** 256 colours through some. */
function between(stops) {
  return Array.from({ length: 256 }, (_, i) => {
    const at = (i / 255) * (stops.length - 1), below = Math.min(stops.length - 2, Math.floor(at));
    return stops[below].map((c, k) => Math.round(c + (at - below) * (stops[below + 1][k] - c)));
  });
}

/** Colours of fields on flanks and on bodies. */
const RAMP = between(data.colours.flanks), BODIES = between(data.colours.bodies);

const css = ([r, g, b]) => `rgb(${r},${g},${b})`;

/**
 * All flanks in one canvas, each with its name, its edges and its size in mm. `paint(pair)` gives a colour, `tell(pair)` a
 * text; `named` are pairs with a letter that stands on them.
 */
class FlankMap {
  constructor(place, flanks, named = []) {
    this.place = place;
    this.flanks = flanks;
    this.named = new Map(named);
    this.canvas = place.appendChild(document.createElement("canvas"));
    this.legend = place.appendChild(document.createElement("div"));
    this.legend.className = "bar-of-colours";
    this.hint = place.appendChild(document.createElement("div"));
    this.hint.className = "hint";
    this.canvas.addEventListener("pointermove", (e) => this.point(e));
    this.canvas.addEventListener("pointerleave", () => (this.hint.style.display = "none"));
    // In the next frame: a map of another height is one more change of the place.
    new ResizeObserver(() => requestAnimationFrame(() => this.draw())).observe(place);
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
    const margin = { left: 58, right: 30, top: 26, bottom: 44 };
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
      for (const { pair, outline } of flank.patches) {
        if (this.named.has(pair)) this.letter(g, this.named.get(pair), left + scale * middle(outline, 0), top + height - scale * middle(outline, 1));
      }
      this.names(g, flank, left, top, width, height);
      this.size(g, flank, left, top, scale);
    }
  }

  /** A letter in a small disc. */
  letter(g, letter, x, y) {
    g.beginPath();
    g.arc(x, y, 8, 0, 2 * Math.PI);
    g.fillStyle = "#ffffff";
    g.strokeStyle = "#222222";
    g.lineWidth = 1;
    g.fill();
    g.stroke();
    g.font = "600 11px system-ui, sans-serif";
    g.fillStyle = "#222222";
    [g.textAlign, g.textBaseline] = ["center", "middle"];
    g.fillText(letter, x, y + 0.5);
    g.textBaseline = "alphabetic";
  }

  /** Ticks along the lower and the left side, in mm. */
  size(g, flank, left, top, scale) {
    const [width, height] = flank.size, bottom = top + scale * height;
    g.font = "12px system-ui, sans-serif";
    g.fillStyle = g.strokeStyle = colourOf("--quiet");
    g.lineWidth = 1;
    const per_mm = 1e-3 * scale;
    const across = roundTicks(0, 1e3 * width, (scale * width) / 90);
    const upwards = roundTicks(0, 1e3 * height, (scale * height) / 34);
    g.beginPath();
    g.textAlign = "center";
    across.forEach(({ at, text }, i) => {
      g.moveTo(left + per_mm * at, bottom + 1);
      g.lineTo(left + per_mm * at, bottom + 5);
      g.fillText(i === across.length - 1 ? `${text} mm` : text, left + per_mm * at, bottom + 17);
    });
    g.textAlign = "right";
    for (const { at, text } of upwards) {
      g.moveTo(left - 1, bottom - per_mm * at);
      g.lineTo(left - 5, bottom - per_mm * at);
      g.fillText(text, left - 8, bottom - per_mm * at + 4);
    }
    g.stroke();
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
    g.fillText(below, left + width, top + height + 34);
    const upright = (text, x) => {
      g.save();
      g.translate(x, top + height / 2);
      g.rotate(-Math.PI / 2);
      g.textAlign = "center";
      if (g.measureText(text).width <= Math.max(height, 60)) g.fillText(text, 0, 0);
      g.restore();
    };
    upright(before, left - 40);
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

/** Middle of an outline along an axis. */
function middle(outline, axis) {
  const values = outline.map((p) => p[axis]);
  return (Math.min(...values) + Math.max(...values)) / 2;
}

/** The ends of a scale, and where a value lies between them. */
const rangeOf = ([low, high]) => ({ low, high, at: (v) => Math.min(1, Math.max(0, (v - low) / (high - low))) });

/** A strip of colours with round numbers under it. */
function colourBar(place, { low, high }, unit, colours = RAMP) {
  place.replaceChildren();
  const strip = place.appendChild(document.createElement("canvas"));
  [strip.width, strip.height] = [256, 1];
  const g = strip.getContext("2d");
  colours.forEach((c, i) => {
    g.fillStyle = css(c);
    g.fillRect(i, 0, 1, 1);
  });
  const axis = axisUnit(unit, Math.max(Math.abs(low), Math.abs(high)));
  const marks = place.appendChild(document.createElement("div"));
  marks.className = "ticks";
  for (const { at, text } of roundTicks(low * axis.factor, high * axis.factor, 5)) {
    const mark = marks.appendChild(document.createElement("span"));
    mark.textContent = text;
    mark.style.left = `${(100 * (at / axis.factor - low)) / (high - low)}%`;
  }
  const named = place.appendChild(document.createElement("div"));
  named.className = "unit";
  named.textContent = axis.unit;
}

function showField(map, field) {
  const range = rangeOf(field.ends);
  map.show((pair) => RAMP[Math.round(255 * range.at(field.values[pair]))], (pair) => withPrefix(field.values[pair], field.unit, 4));
  colourBar(map.legend, range, field.unit);
}

function showStates(map, states, codes, pairs, at) {
  const code = (pair) => codes[at * pairs + pair];
  map.show((pair) => states[code(pair)].colour, (pair) => states[code(pair)].one);
  stateLegend(map.legend, states, code, pairs);
}

/** How many pairs do what. */
function stateLegend(place, states, code, pairs) {
  place.replaceChildren();
  const line = place.appendChild(document.createElement("div"));
  line.className = "states";
  states.forEach(({ one, many, colour }, i) => {
    let count = 0;
    for (let pair = 0; pair < pairs; pair++) count += code(pair) === i;
    if (count === 0) return;
    const entry = line.appendChild(document.createElement("span"));
    entry.appendChild(document.createElement("i")).style.background = css(colour);
    entry.append(`${count} ${count === 1 ? one : many}`);
  });
}

/** A closed path of force over displacement, with round numbers on its axes. */
function drawLoop(place, loop) {
  const NS = "http://www.w3.org/2000/svg", [width, height, left, below, above, right] = [320, 236, 58, 46, 14, 14];
  const figure = place.appendChild(document.createElement("figure"));
  const caption = figure.appendChild(document.createElement("figcaption"));
  caption.appendChild(document.createElement("b")).textContent = loop.letter;
  caption.append(` ${loop.title}`);
  const svg = figure.appendChild(document.createElementNS(NS, "svg"));
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const add = (name, attributes, text) => {
    const element = svg.appendChild(document.createElementNS(NS, name));
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text) element.textContent = text;
  };
  /** Scaled to one prefix: the numbers, their ends, and their ticks. */
  const axisOf = (values, unit, wanted) => {
    const axis = axisUnit(unit, Math.max(...values.map(Math.abs)));
    const own = values.map((v) => v * axis.factor), [least, most] = [Math.min(...own), Math.max(...own)];
    const room = most > least ? 0.05 * (most - least) : 1;
    const [low, high] = [least - room, most + room];
    return { own, low, high, unit: axis.unit, ticks: roundTicks(low, high, wanted) };
  };
  const across = axisOf(loop.displacement_m, "m", 4), upwards = axisOf(loop.force_n, "N", 5);
  const x = (v) => left + ((v - across.low) / (across.high - across.low)) * (width - left - right);
  const y = (v) => height - below - ((v - upwards.low) / (upwards.high - upwards.low)) * (height - below - above);
  const text = { fill: "var(--quiet)", "font-size": 12 };
  const rule = { stroke: "var(--rule)", "stroke-width": 1 };
  for (const { at, text: label } of across.ticks) {
    add("path", { ...rule, d: `M${x(at).toFixed(1)} ${above}V${height - below}` });
    add("text", { ...text, "text-anchor": "middle", x: x(at), y: height - below + 16 }, label);
  }
  for (const { at, text: label } of upwards.ticks) {
    add("path", { ...rule, d: `M${left} ${y(at).toFixed(1)}H${width - right}` });
    add("text", { ...text, "text-anchor": "end", x: left - 6, y: y(at) + 4 }, label);
  }
  const path = across.own.map((v, i) => `${i ? "L" : "M"}${x(v).toFixed(1)} ${y(upwards.own[i]).toFixed(1)}`);
  add("path", { d: `${path.join("")}Z`, fill: "var(--band)", stroke: "var(--response)", "stroke-width": 1.8, "stroke-linejoin": "round" });
  add("text", { ...text, "text-anchor": "middle", x: (left + width - right) / 2, y: height - 8 }, `displacement (${across.unit})`);
  const beside = (above + height - below) / 2;
  add("text", { ...text, "text-anchor": "middle", x: 12, y: beside, transform: `rotate(-90 12 ${beside})` }, `friction force (${upwards.unit})`);
}

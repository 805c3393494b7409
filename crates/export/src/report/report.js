"use strict";
// Puts the pictures into the page.

const unpack = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const integers = (text) => new Uint32Array(unpack(text).buffer);
const numbers = ({ low, step, u16 }) => Float32Array.from(new Uint16Array(unpack(u16).buffer), (i) => low + step * i);

function curves(data) {
  const state = { observation: 0, scale: null, measured: [] }, chosen = () => data.amplitudes[state.observation];
  const charts = [];
  const add = (id, chosen, state) => {
    if (!byId(id) || !chosen()) return;
    charts.push(curveChart(byId(id), chosen, data.peak_hz, state));
    drawn.push(id);
  };
  const scale = byId("scale"), showScale = () => (scale.value = state.scale ?? bestScale(chosen()));
  if (chosen()) showScale();
  add("amplitude", chosen, state);
  add("phase", () => data.phases[state.observation]);
  add("counts", () => data.pairs);
  add("powers", () => data.powers);
  const changed = (change) => (event) => {
    change(event.target);
    charts.forEach((chart) => chart.draw());
  };
  byId("observation")?.addEventListener("change", changed((e) => {
    state.observation = Number(e.value);
    showScale();
  }));
  scale?.addEventListener("change", changed((e) => (state.scale = e.value)));
  byId("measured")?.addEventListener("change", async (event) => {
    const files = [...event.target.files];
    state.measured = await Promise.all(files.map(async (file) => measuredCurve(await file.text(), file.name)));
    charts.forEach((chart) => chart.draw());
  });
}

function flanks(data) {
  if (!byId("field-map")) return;
  const named = data.loops.map(({ letter, pair }) => [pair, letter]);
  const map = new FlankMap(byId("field-map"), data.flanks, named), field = byId("field");
  data.fields.forEach(({ title }, i) => field.add(new Option(title, i)));
  const show = () => showField(map, data.fields[Number(field.value)]);
  field.addEventListener("change", show);
  if (data.fields.length) {
    show();
    drawn.push("field");
  }
  if (!data.statuses) return;
  const { frequency_hz, peak } = data.statuses, codes = unpack(data.statuses.codes);
  if (frequency_hz.length) {
    const statuses = new FlankMap(byId("status-map"), data.flanks), at = byId("status-at");
    const pairs = codes.length / frequency_hz.length;
    at.max = frequency_hz.length - 1;
    at.value = peak ?? 0;
    const showAt = () => {
      byId("status-hz").textContent = `${frequency_hz[Number(at.value)].toFixed(3)} Hz`;
      showStates(statuses, data.states, codes, pairs, Number(at.value));
    };
    at.addEventListener("input", showAt);
    showAt();
    drawn.push("statuses");
  }
}

function loops(data) {
  const place = byId("loops");
  if (!place || !data.loops.length) return;
  data.loops.forEach((loop) => drawLoop(place, loop));
  drawn.push("loops");
}

/** The skin of the bodies as the viewer takes it. */
function meshOf(skin) {
  const faces = integers(skin.faces), triangles = [], edges = new Map();
  const edge = (a, b) => edges.set(a < b ? a * 4294967296 + b : b * 4294967296 + a, [a, b]);
  const fan = ([first, ...rest]) => rest.slice(1).forEach((node, i) => triangles.push(first, rest[i], node));
  let start = 0;
  for (const size of integers(skin.face_sizes)) {
    const around = [...faces.subarray(start, start + size)];
    start += size;
    around.forEach((node, i) => edge(node, around[(i + 1) % size]));
    if (size < 5) {
      fan(around);
      continue;
    }
    // Corners and middles in turn: a triangle at each corner, and what the middles enclose.
    for (let i = 0; i < size; i += 2) triangles.push(around[(i + size - 1) % size], around[i], around[i + 1]);
    fan(around.filter((_, i) => i % 2));
  }
  const harmonics = skin.harmonics.map(({ k, cosine, sine }) => ({ k, cosine: numbers(cosine), sine: numbers(sine) }));
  return {
    points: numbers(skin.points),
    body: unpack(skin.body),
    triangles: Uint32Array.from(triangles),
    edges: Uint32Array.from([...edges.values()].flat()),
    flankTriangles: integers(skin.flank_triangles),
    flankPairs: integers(skin.flank_pairs),
    flankStart: skin.flank_start,
    apart: skin.apart,
    up: skin.up,
    along: skin.along,
    harmonics,
    disc: skin.disc,
  };
}

/** Largest displacement of each node in a period, from 48 instants, and the phase of the largest of all. */
function amplitudes(viewer) {
  const count = viewer.mesh.points.length / 3, each = new Float32Array(count), moved = new Float32Array(3 * count);
  let [largest, phase] = [0, 0];
  for (let instant = 0; instant < 48; instant++) {
    viewer.phase = (2 * Math.PI * instant) / 48;
    viewer.displacement(moved);
    for (let i = 0; i < count; i++) {
      const length = Math.hypot(moved[3 * i], moved[3 * i + 1], moved[3 * i + 2]);
      if (length > each[i]) each[i] = length;
      if (length > largest) [largest, phase] = [length, viewer.phase];
    }
  }
  return { each, largest, phase };
}

/** The largest motion that is drawn, of the size of the bodies, and the step of the slider that says so. */
const DRAWN = 0.2, FITTING = 50;

/** The number with this power of ten that is next to 1, 2 or 5 times a power of ten. */
function rounded(power) {
  const whole = Math.floor(power), part = 10 ** (power - whole);
  return 10 ** whole * [1, 2, 5, 10].reduce((a, b) => (Math.abs(b - part) < Math.abs(a - part) ? b : a));
}

/** How the displacements are drawn. */
function timesWords(times) {
  if (times === 0) return "no displacements";
  const plain = times >= 1e-4 && times < 1e7 ? times.toLocaleString("en", { maximumSignificantDigits: 2 }) : times.toExponential(0);
  return times === 1 ? "displacements in their own size" : `displacements ${plain} times as large`;
}

/** The fields that the bodies can be coloured by: those of the flanks, the displacement, then the stress. */
function colourings(data, mesh, moves, range, each) {
  const count = mesh.points.length / 3, shown = [];
  if (data.statuses?.peak != null) {
    const codes = unpack(data.statuses.codes), pairs = codes.length / data.statuses.frequency_hz.length;
    const code = (pair) => codes[data.statuses.peak * pairs + pair], kinds = new Int8Array(count).fill(-1);
    mesh.flankPairs.forEach((pair, i) => (kinds[mesh.flankStart + i] = code(pair)));
    shown.push({ title: "flanks: what pairs do at the peak", kinds, code, pairs });
  }
  for (const { title, unit, values, ends } of data.fields) {
    const range = rangeOf(ends), at = new Float32Array(count).fill(-1);
    mesh.flankPairs.forEach((pair, i) => (at[mesh.flankStart + i] = range.at(values[pair])));
    shown.push({ title: `flanks: ${title}`, unit, range, values: at, colours: RAMP });
  }
  if (moves) shown.push({ title: "displacement", unit: "m", range, values: each.map(range.at), colours: BODIES });
  for (const { title, unit, largest, values } of data.skin.fields) {
    const range = rangeOf([0, largest || 1]);
    shown.push({ title, unit, range, values: numbers(values).map(range.at), colours: BODIES });
  }
  return shown;
}

function motion(data) {
  const canvas = byId("viewer");
  if (!canvas || !data.skin) return;
  let viewer;
  try {
    viewer = new Viewer(canvas, byId("viewer-marks"), meshOf(data.skin));
  } catch (error) {
    canvas.replaceWith(Object.assign(document.createElement("p"), { className: "quiet", textContent: `The bodies cannot be shown: ${error.message}.` }));
    return;
  }
  const { mesh } = viewer, moves = mesh.harmonics.length > 0;
  const { each, largest, phase } = amplitudes(viewer), range = rangeOf([0, largest || 1]);
  viewer.phase = phase;
  const showPhase = () => byId("phase-at") && (byId("phase-at").value = (viewer.phase * 180) / Math.PI);
  showPhase();
  if (moves) {
    const fit = Math.log10((DRAWN * viewer.size) / (largest || 1)), exaggeration = byId("exaggeration");
    const scale = () => {
      const v = Number(exaggeration.value);
      viewer.scale = v === 0 ? 0 : rounded(fit + (v - FITTING) / 25);
      viewer.words = timesWords(viewer.scale);
      byId("exaggeration-of").textContent = `${Number(viewer.scale.toPrecision(2))} times`;
      viewer.reach(largest);
    };
    exaggeration.addEventListener("input", scale);
    scale();
  }
  const shown = colourings(data, mesh, moves, range, each), field = byId("viewer-field");
  shown.forEach(({ title }, i) => field.add(new Option(title, i)));
  const show = () => {
    const of = shown[Number(field.value)];
    if (!of) return viewer.draw();
    if (of.kinds) {
      viewer.sort(of.kinds, data.states.map(({ colour }) => colour));
      return stateLegend(byId("viewer-bar"), data.states, of.code, of.pairs);
    }
    viewer.colour(of.values, of.colours);
    colourBar(byId("viewer-bar"), of.range, of.unit, of.colours);
  };
  field.addEventListener("change", show);
  show();
  const slide = (id, change) => byId(id)?.addEventListener("input", (e) => change(Number(e.target.value)));
  slide("phase-at", (v) => {
    viewer.phase = (v * Math.PI) / 180;
    viewer.draw();
  });
  const pull = (v) => viewer.pull(v / 100);
  slide("apart", pull);
  if (byId("apart")) pull(Number(byId("apart").value));
  byId("edges").addEventListener("change", (e) => {
    viewer.showEdges = e.target.checked;
    viewer.draw();
  });
  byId("whole-disc")?.addEventListener("change", (e) => viewer.showDisc(e.target.checked));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => viewer.draw());
  viewer.frame();
  if (viewer.shows()) drawn.push("viewer");
  const button = byId("play");
  if (!button || !moves) return;
  const playing = (plays) => {
    viewer.play(plays, showPhase);
    button.textContent = plays ? "stop" : "play";
  };
  button.addEventListener("click", () => playing(!viewer.playing));
  playing(!window.matchMedia("(prefers-reduced-motion: reduce)").matches);
}

data.fields.forEach((field) => (field.values = numbers(field.values)));
curves(data);
flanks(data);
loops(data);
motion(data);
document.body.dataset.drawn = drawn.join(" ");

"use strict";
// Puts the pictures into the page.

const unpack = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const integers = (text) => new Uint32Array(unpack(text).buffer);
const numbers = ({ low, step, u16 }) => Float32Array.from(new Uint16Array(unpack(u16).buffer), (i) => low + step * i);

function curves(data) {
  const state = { observation: 0, logarithmic: false, measured: [] };
  const charts = [];
  const add = (id, make) => {
    if (!byId(id)) return;
    charts.push(make(byId(id)));
    drawn.push(id);
  };
  if (data.curves.length) {
    add("amplitude", (place) => amplitudeChart(place, data.curves, state));
    add("phase", (place) => phaseChart(place, data.curves, state));
  }
  if (data.counts) add("counts", (place) => countsChart(place, data.counts));
  const changed = (change) => (event) => {
    change(event.target);
    charts.forEach((chart) => chart.draw());
  };
  byId("observation")?.addEventListener("change", changed((e) => (state.observation = Number(e.value))));
  byId("logarithmic")?.addEventListener("change", changed((e) => (state.logarithmic = e.checked)));
  byId("measured")?.addEventListener("change", async (event) => {
    const files = [...event.target.files];
    state.measured = await Promise.all(files.map(async (file) => measuredCurve(await file.text(), file.name)));
    charts.forEach((chart) => chart.draw());
  });
}

function flanks(data) {
  if (!byId("field-map")) return;
  const map = new FlankMap(byId("field-map"), data.flanks), field = byId("field");
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
      showStatuses(statuses, codes, pairs, Number(at.value));
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
    harmonics,
  };
}

/** Largest displacement of each node in a period, from 48 instants. */
function amplitudes(viewer) {
  const count = viewer.mesh.points.length / 3, out = new Float32Array(count), moved = new Float32Array(3 * count);
  for (let instant = 0; instant < 48; instant++) {
    viewer.phase = (2 * Math.PI * instant) / 48;
    viewer.displacement(moved);
    for (let i = 0; i < count; i++)
      out[i] = Math.max(out[i], Math.hypot(moved[3 * i], moved[3 * i + 1], moved[3 * i + 2]));
  }
  viewer.phase = 0;
  return out;
}

function motion(data) {
  const canvas = byId("viewer");
  if (!canvas || !data.skin) return;
  let viewer;
  try {
    viewer = new Viewer(canvas, meshOf(data.skin));
  } catch (error) {
    canvas.replaceWith(Object.assign(document.createElement("p"), { className: "quiet", textContent: `The bodies cannot be shown: ${error.message}.` }));
    return;
  }
  const { mesh } = viewer, count = mesh.points.length / 3, moves = mesh.harmonics.length > 0;
  const shown = [];
  if (moves) {
    const values = amplitudes(viewer), range = rangeOf([0, values.reduce((a, b) => Math.max(a, b), 0)]);
    shown.push({ title: "displacement", unit: "m", range, values: values.map(range.at) });
    const fit = Math.log10((0.12 * viewer.radius) / (range.high || 1));
    const exaggeration = byId("exaggeration");
    const scale = () => {
      const v = Number(exaggeration.value);
      viewer.scale = v === 0 ? 0 : 10 ** (fit + (v - 50) / 25);
      byId("exaggeration-of").textContent = `${Number(viewer.scale.toPrecision(2))} times`;
      viewer.draw();
    };
    exaggeration.addEventListener("input", scale);
    scale();
  }
  const ofFlanks = (title, unit, values) => {
    const range = rangeOf(values), at = new Float32Array(count).fill(-1);
    mesh.flankPairs.forEach((pair, i) => (at[mesh.flankStart + i] = range.at(values[pair])));
    shown.push({ title: `flanks: ${title}`, unit, range, values: at });
  };
  data.fields.forEach(({ title, unit, values }) => ofFlanks(title, unit, values));
  if (data.statuses?.peak != null) {
    const codes = unpack(data.statuses.codes), pairs = codes.length / data.statuses.frequency_hz.length;
    const code = (pair) => codes[data.statuses.peak * pairs + pair], kinds = new Int8Array(count).fill(-1);
    mesh.flankPairs.forEach((pair, i) => (kinds[mesh.flankStart + i] = code(pair)));
    shown.push({ title: "flanks: what pairs do at the peak", kinds, code, pairs });
  }
  const field = byId("viewer-field");
  shown.forEach(({ title }, i) => field.add(new Option(title, i)));
  const show = () => {
    const of = shown[Number(field.value)];
    if (!of) return viewer.draw();
    if (of.kinds) {
      viewer.sort(of.kinds, STATUSES.map(({ colour }) => colour));
      return statusLegend(byId("viewer-bar"), of.code, of.pairs);
    }
    viewer.colour(of.values, RAMP);
    colourBar(byId("viewer-bar"), of.range.low, of.range.high, of.unit);
  };
  field.addEventListener("change", show);
  show();
  const slide = (id, change) => byId(id)?.addEventListener("input", (e) => {
    change(Number(e.target.value));
    viewer.draw();
  });
  slide("phase-at", (v) => (viewer.phase = (v * Math.PI) / 180));
  slide("apart", (v) => (viewer.apart = v / 100));
  byId("edges").addEventListener("change", (e) => {
    viewer.showEdges = e.target.checked;
    viewer.draw();
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => viewer.draw());
  viewer.frame();
  if (viewer.shows()) drawn.push("viewer");
  byId("play")?.addEventListener("click", (event) => {
    viewer.playing = !viewer.playing;
    event.target.textContent = viewer.playing ? "stop" : "play";
    let last = performance.now();
    const step = (now) => {
      if (!viewer.playing) return;
      // A period in two seconds.
      viewer.phase = (viewer.phase + (Math.PI * (now - last)) / 1000) % (2 * Math.PI);
      last = now;
      byId("phase-at").value = (viewer.phase * 180) / Math.PI;
      viewer.draw();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
}

const data = JSON.parse(byId("data").textContent);
data.fields.forEach((field) => (field.values = numbers(field.values)));
curves(data);
flanks(data);
loops(data);
motion(data);
document.body.dataset.drawn = drawn.join(" ");

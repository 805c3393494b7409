"use strict";
// The bodies in three dimensions: turned by the mouse, moved through a period, pulled apart, coloured by a field.

const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];

/** Column-major 4 x 4 matrices. */
const Matrix = {
  perspective(fovy, aspect, near, far) {
    const f = 1 / Math.tan(fovy / 2), d = 1 / (near - far);
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) * d, -1, 0, 0, 2 * far * near * d, 0];
  },
  times(a, b) {
    const out = new Array(16).fill(0);
    for (let c = 0; c < 4; c++)
      for (let r = 0; r < 4; r++)
        for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    return out;
  },
  translation([x, y, z]) {
    return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1];
  },
  /** By a 3 x 3 matrix, row by row, about a point. */
  about(turn, point) {
    const to = turn.map((row, i) => point[i] - row.reduce((sum, v, k) => sum + v * point[k], 0));
    const column = (k) => [...turn.map((row) => row[k]), 0];
    return [...column(0), ...column(1), ...column(2), ...to, 1];
  },
  /** Of a unit quaternion [x, y, z, w]. */
  rotation([x, y, z, w]) {
    return [
      1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
      2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
      2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0,
      0, 0, 0, 1,
    ];
  },
};

const Quaternion = {
  /** That turns three orthogonal unit vectors, right-handed, to x, y and z. */
  ofAxes(x, y, z) {
    // Shepperd's method: by the largest of the four squares.
    const squares = [x[0] - y[1] - z[2], y[1] - x[0] - z[2], z[2] - x[0] - y[1], x[0] + y[1] + z[2]];
    const largest = squares.indexOf(Math.max(...squares));
    const w = 0.5 * Math.sqrt(1 + squares[largest]), q = 1 / (4 * w);
    const [sx, sy, sz] = [z[1] - y[2], x[2] - z[0], y[0] - x[1]], [xy, xz, yz] = [x[1] + y[0], x[2] + z[0], y[2] + z[1]];
    return [
      [w, q * xy, q * xz, q * sx],
      [q * xy, w, q * yz, q * sy],
      [q * xz, q * yz, w, q * sz],
      [q * sx, q * sy, q * sz, w],
    ][largest];
  },
  about([x, y, z], angle) {
    const s = Math.sin(angle / 2);
    return [s * x, s * y, s * z, Math.cos(angle / 2)];
  },
  times([ax, ay, az, aw], [bx, by, bz, bw]) {
    return [
      aw * bx + ax * bw + ay * bz - az * by,
      aw * by - ax * bz + ay * bw + az * bx,
      aw * bz + ax * by - ay * bx + az * bw,
      aw * bw - ax * bx - ay * by - az * bz,
    ];
  },
};

const VERTEX = `#version 300 es
in vec3 position; in float value; in vec4 kind; uniform mat4 view, projection; uniform float nearer;
out float v; out vec4 share; out vec3 eye;
void main() {
  vec4 p = view * vec4(position, 1.0);
  eye = p.xyz; v = value; share = kind; gl_Position = projection * p;
  gl_Position.z -= nearer * gl_Position.w;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in float v; in vec4 share; in vec3 eye; out vec4 colour;
uniform sampler2D map; uniform vec3 plain, kinds[5]; uniform bool line, sorted;
/** The kind of which a corner has most, the fifth one by its value; there is nothing between two kinds. */
vec3 kindOf() {
  float most = max(max(max(share.x, share.y), max(share.z, share.w)), v);
  if (most <= 0.0) return plain;
  return share.x == most ? kinds[0] : share.y == most ? kinds[1] : share.z == most ? kinds[2]
    : share.w == most ? kinds[3] : kinds[4];
}
void main() {
  if (line) { colour = vec4(plain, 1.0); return; }
  vec3 n = normalize(cross(dFdx(eye), dFdy(eye)));
  float light = 0.45 + 0.55 * abs(dot(n, normalize(vec3(0.25, 0.45, 1.0))));
  // Below zero: a part that has no value.
  vec3 c = sorted ? kindOf() : v < -0.5 ? plain : texture(map, vec2(clamp(v, 0.0, 1.0) * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
  colour = vec4(c * light, 1.0);
}`;

/** Half of the angle of view, from above to below. */
const HALF_VIEW = 0.3;
/** Edges between faces that meet at more than some 30 degrees are sharp. */
const SHARP = 0.87;

/**
 * Draws `mesh` in a canvas, and axes, scale and words in another one that lies over it.
 * mesh: points (Float32Array, m), triangles, edges, flankTriangles (Uint32Array), body of each point (Uint8Array),
 * harmonics [{ k, cosine, sine }] (Float32Array as points, m), apart (of each body the vector along which it is pulled),
 * up and along (unit vectors that stand upright and lie across in the picture), disc (null, or the disc that the bodies
 * are a sector of: sectors, turn by one pitch as rows, point_m of the axis, ahead_rad of a sector in the first harmonic).
 */
class Viewer {
  constructor(canvas, marks, mesh) {
    this.canvas = canvas;
    this.marks = marks;
    this.mesh = mesh;
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("WebGL 2 is missing");
    this.gl = gl;
    this.program = this.link(VERTEX, FRAGMENT);
    this.moved = new Float32Array(mesh.points.length);
    this.values = new Float32Array(mesh.points.length / 3).fill(-1);
    this.buffers = {
      position: this.buffer(gl.ARRAY_BUFFER, this.moved, "position", 3),
      value: this.buffer(gl.ARRAY_BUFFER, this.values, "value", 1),
      kind: this.buffer(gl.ARRAY_BUFFER, new Float32Array((4 * mesh.points.length) / 3), "kind", 4),
      triangles: this.indices(mesh.triangles),
      edges: this.indices(mesh.edges),
      sharp: this.indices(sharpEdges(mesh)),
      flanks: this.indices(mesh.flankTriangles),
    };
    this.phase = 0;
    this.scale = 1;
    this.words = "";
    this.apart = 0;
    this.margin = 0;
    this.showEdges = false;
    this.turns = [Matrix.translation([0, 0, 0])];
    this.measure();
    this.reset();
    this.listen();
    new ResizeObserver(() => {
      this.fit();
      this.draw();
    }).observe(canvas);
    new IntersectionObserver(([seen]) => {
      this.inView = seen.isIntersecting;
      if (this.inView) this.step();
    }).observe(canvas);
  }

  link(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    return program;
  }

  buffer(target, data, attribute, size) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, gl.DYNAMIC_DRAW);
    const at = gl.getAttribLocation(this.program, attribute);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    return buffer;
  }

  indices(data) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return { buffer, count: data.length };
  }

  /** The box of each body, and the size of all. */
  measure() {
    const { points, body } = this.mesh;
    this.boxes = this.mesh.apart.map(() => ({ low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] }));
    points.forEach((v, i) => {
      const { low, high } = this.boxes[body[(i / 3) | 0]];
      low[i % 3] = Math.min(low[i % 3], v);
      high[i % 3] = Math.max(high[i % 3], v);
    });
    const { low, high } = this.around();
    this.size = Math.hypot(...low.map((v, i) => high[i] - v)) / 2;
  }

  /** By how much a body is pulled aside, m. */
  aside(body) {
    return this.mesh.apart[body].map((v) => this.apart * this.size * v);
  }

  /** Draws all sectors of the disc, or the sector of the bodies alone. */
  showDisc(whole) {
    const { turn, point_m, sectors } = this.mesh.disc, pitch = Matrix.about(turn, point_m);
    this.turns = [Matrix.translation([0, 0, 0])];
    while (whole && this.turns.length < sectors) this.turns.push(Matrix.times(pitch, this.turns.at(-1)));
    this.fit();
    this.draw();
  }

  /** The box of all bodies where they are pulled, in all sectors that are drawn. */
  around() {
    const corners = this.boxes.flatMap(({ low, high }, body) => {
      const aside = this.size ? this.aside(body) : [0, 0, 0], ends = [low, high];
      return [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => low.map((_, i) => ends[(corner >> i) & 1][i] + aside[i]));
    });
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const turn of this.turns)
      for (const corner of corners)
        for (let i = 0; i < 3; i++) {
          const at = corner.reduce((sum, v, k) => sum + turn[4 * k + i] * v, turn[12 + i]);
          low[i] = Math.min(low[i], at);
          high[i] = Math.max(high[i], at);
        }
    return { low, high };
  }

  /** Looks at the bodies from aside and a little from above, outwards up. */
  reset() {
    const { up, along } = this.mesh;
    const level = Quaternion.ofAxes(along, cross(up, along), up);
    const aside = Quaternion.times(Quaternion.about([1, 0, 0], -Math.PI / 2 + 0.3), Quaternion.about([0, 0, 1], -0.9));
    this.turn = Quaternion.times(aside, level);
    this.zoom = 1;
    this.shift = [0, 0];
    this.fit();
    this.draw();
  }

  /** Finds from how far all that moves is seen, as the bodies are turned now. */
  fit() {
    const { low, high } = this.around(), ends = [low, high];
    this.centre = low.map((v, i) => (v + high[i]) / 2);
    this.radius = Math.hypot(...low.map((v, i) => high[i] - v)) / 2 + this.margin;
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight) || 1;
    const tangent = 0.92 * Math.tan(HALF_VIEW), turned = Matrix.rotation(this.turn);
    this.fitting = 0.1 * this.radius;
    for (let corner = 0; corner < 8; corner++) {
      const at = this.centre.map((v, i) => ends[(corner >> i) & 1][i] - v);
      const [x, y, z] = [0, 1, 2].map((row) => at.reduce((sum, v, i) => sum + turned[4 * i + row] * v, 0));
      const wide = (Math.abs(x) + this.margin) / (tangent * aspect), tall = (Math.abs(y) + this.margin) / tangent;
      this.fitting = Math.max(this.fitting, z + wide, z + tall);
    }
  }

  /** Pulls the bodies apart, and goes back so far that all is seen: by 0 to 1. */
  pull(apart) {
    this.apart = apart;
    this.fit();
    this.draw();
  }

  /** Leaves room for displacements of so much, m, as they are drawn. */
  reach(largest) {
    this.margin = this.scale * largest;
    this.fit();
    this.draw();
  }

  get distance() {
    return this.zoom * this.fitting;
  }

  /** Lets the time go on, a period in two seconds, where the canvas is in view; `tell` hears of each step. */
  play(plays, tell) {
    this.playing = plays;
    this.tell = tell;
    this.step();
  }

  step() {
    if (this.stepping || !this.playing || !this.inView) return;
    this.stepping = true;
    let last = null;
    const step = (now) => {
      if (!this.playing || !this.inView) return (this.stepping = false);
      this.phase = (this.phase + (Math.PI * (now - (last ?? now))) / 1000) % (2 * Math.PI);
      last = now;
      this.tell();
      this.frame();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  listen() {
    const c = this.canvas, pointers = new Map();
    const spread = () => {
      const [a, b] = [...pointers.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    c.addEventListener("pointerdown", (e) => {
      c.setPointerCapture(e.pointerId);
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    });
    const end = (e) => pointers.delete(e.pointerId);
    c.addEventListener("pointerup", end);
    c.addEventListener("pointercancel", end);
    c.addEventListener("pointermove", (e) => {
      const last = pointers.get(e.pointerId);
      if (!last) return;
      const [dx, dy] = [e.clientX - last.x, e.clientY - last.y];
      const before = pointers.size === 2 ? spread() : 0;
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
      if (pointers.size === 2) this.zoom *= before / Math.max(1, spread());
      else if (e.shiftKey || e.buttons === 2) this.pan(dx, dy);
      else this.rotate(dx, dy);
      this.draw();
    });
    c.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom *= Math.exp(0.001 * e.deltaY);
      this.draw();
    }, { passive: false });
    c.addEventListener("contextmenu", (e) => e.preventDefault());
    c.addEventListener("dblclick", () => this.reset());
    c.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[e.key];
      if (step) {
        e.preventDefault();
        this.rotate(...step);
        this.draw();
      }
    });
  }

  rotate(dx, dy) {
    const angle = 0.008 * Math.hypot(dx, dy);
    if (angle === 0) return;
    const l = Math.hypot(dx, dy);
    this.turn = Quaternion.times(Quaternion.about([dy / l, dx / l, 0], angle), this.turn);
    const n = Math.hypot(...this.turn);
    this.turn = this.turn.map((v) => v / n);
  }

  pan(dx, dy) {
    const per = (2 * this.distance * Math.tan(HALF_VIEW)) / this.canvas.clientHeight;
    this.shift = [this.shift[0] + per * dx, this.shift[1] - per * dy];
  }

  /** Colours by `values` in [0, 1] (below 0: none), with 256 colours [r, g, b]. */
  colour(values, colours) {
    const gl = this.gl;
    this.kinds = null;
    this.values.set(values);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.value);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.values);
    if (colours !== this.colours) {
      this.colours = colours;
      this.texture ??= gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, this.texture);
      const bytes = new Uint8Array(colours.flatMap((c) => [...c, 255]));
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      for (const at of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, at, gl.NEAREST);
      for (const at of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, at, gl.CLAMP_TO_EDGE);
    }
    this.draw();
  }

  /** Colours each point by its kind, 0 to 4 (below 0: none), with five colours [r, g, b]. */
  sort(kindOfPoint, colours) {
    const gl = this.gl, shares = new Float32Array((4 * this.mesh.points.length) / 3);
    this.values.fill(0);
    kindOfPoint.forEach((kind, i) => {
      if (kind === 4) this.values[i] = 1;
      else if (kind >= 0) shares[4 * i + kind] = 1;
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.value);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.values);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.kind);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, shares);
    this.kinds = colours.flat().map((c) => c / 255);
    this.draw();
  }

  /** Displacement from the mean at a phase, m. */
  displacement(out, phase = this.phase) {
    out.fill(0);
    for (const { k, cosine, sine } of this.mesh.harmonics) {
      const c = Math.cos(k * phase), s = Math.sin(k * phase);
      for (let i = 0; i < out.length; i++) out[i] += c * cosine[i] + s * sine[i];
    }
    return out;
  }

  /** Whether anything stands in the middle of the canvas. */
  shows() {
    const gl = this.gl, [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], pixels = new Uint8Array(4 * w);
    gl.readPixels(0, h >> 1, w, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels.some((v) => v > 0);
  }

  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.frame();
    });
  }

  frame() {
    const gl = this.gl, c = this.canvas;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const [w, h] = [Math.round(c.clientWidth * ratio), Math.round(c.clientHeight * ratio)];
    if (w === 0 || h === 0) return;
    if (c.width !== w || c.height !== h) [c.width, c.height] = [w, h];
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const d = this.distance, r = 1.05 * this.radius;
    const projection = Matrix.perspective(2 * HALF_VIEW, w / h, Math.max(0.01 * r, d - r), d + r);
    const view = Matrix.times(
      Matrix.translation([this.shift[0], this.shift[1], -d]),
      Matrix.times(Matrix.rotation(this.turn), Matrix.translation(this.centre.map((v) => -v))),
    );
    const at = (name) => gl.getUniformLocation(this.program, name);
    gl.uniformMatrix4fv(at("projection"), false, projection);
    this.turns.forEach((turn, sector) => {
      this.move(this.phase + sector * (this.mesh.disc?.ahead_rad ?? 0));
      gl.uniformMatrix4fv(at("view"), false, Matrix.times(view, turn));
      this.sector(at);
    });
    this.annotate(view, ratio, w, h);
  }

  /** Moves the points to where they are at a phase. */
  move(phase) {
    const gl = this.gl, { points, body } = this.mesh;
    this.displacement(this.moved, phase);
    const aside = this.mesh.apart.map((_, b) => this.aside(b));
    for (let i = 0; i < points.length; i++)
      this.moved[i] = points[i] + this.scale * this.moved[i] + aside[body[(i / 3) | 0]][i % 3];
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.position);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.moved);
  }

  /** Draws the points where they are, with the uniforms that `at` finds. */
  sector(at) {
    const gl = this.gl;
    const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
    const ink = dark ? [0.08, 0.09, 0.1] : [0.2, 0.22, 0.25];
    // Lines lie on faces, and flanks on those of the bodies: what lies on another is drawn nearer by a little. A polygon
    // offset would do the same, and does not in every renderer.
    const drawNearer = (nearer, kind, { buffer, count }) => {
      gl.uniform1f(at("nearer"), nearer);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.drawElements(kind, count, gl.UNSIGNED_INT, 0);
    };
    gl.uniform1i(at("line"), 0);
    gl.uniform1i(at("sorted"), this.kinds ? 1 : 0);
    if (this.kinds) gl.uniform3fv(at("kinds"), this.kinds);
    gl.uniform3fv(at("plain"), dark ? [0.62, 0.65, 0.69] : [0.9, 0.91, 0.93]);
    drawNearer(0, gl.TRIANGLES, this.buffers.triangles);
    drawNearer(1e-4, gl.TRIANGLES, this.buffers.flanks);
    gl.uniform1i(at("line"), 1);
    gl.uniform3fv(at("plain"), ink);
    drawNearer(3e-4, gl.LINES, this.buffers.sharp);
    if (this.showEdges) {
      gl.uniform3fv(at("plain"), ink.map((v) => v + 0.3));
      drawNearer(2e-4, gl.LINES, this.buffers.edges);
    }
  }

  /** Axes, scale and words over the bodies. */
  annotate(view, ratio, w, h) {
    if (this.marks.width !== w || this.marks.height !== h) Object.assign(this.marks, { width: w, height: h });
    const g = this.marks.getContext("2d"), [width, height] = [w / ratio, h / ratio];
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    g.font = "13px system-ui, sans-serif";
    g.fillStyle = g.strokeStyle = colourOf("--ink");
    g.lineWidth = 1.5;
    const [x0, y0, length] = [44, height - 44, 26];
    [g.textAlign, g.textBaseline] = ["center", "middle"];
    ["x", "y", "z"].forEach((name, axis) => {
      const [x, y] = [view[4 * axis], -view[4 * axis + 1]];
      g.beginPath();
      g.moveTo(x0, y0);
      g.lineTo(x0 + length * x, y0 + length * y);
      g.stroke();
      // An axis that points at the reader has its name beside the others'.
      const far = length + 10;
      g.fillText(name, x0 + far * x, y0 + far * y);
    });
    const pixelsPerM = height / (2 * this.distance * Math.tan(HALF_VIEW)), longest = Math.min(160, 0.3 * width) / pixelsPerM;
    const power = 10 ** Math.floor(Math.log10(longest)), bar = power * [5, 2, 1].find((m) => m * power <= longest);
    const [right, low] = [width - 20, height - 20];
    g.beginPath();
    g.moveTo(right - bar * pixelsPerM, low - 5);
    g.lineTo(right - bar * pixelsPerM, low);
    g.lineTo(right, low);
    g.lineTo(right, low - 5);
    g.stroke();
    g.textAlign = "center";
    g.fillText(withPrefix(bar, "m"), right - 0.5 * bar * pixelsPerM, low - 14);
    g.textAlign = "left";
    g.fillText(this.words, 16, 20);
  }
}

/** Edges at which two faces meet at an angle, or that belong to one face alone, as pairs of points. */
function sharpEdges({ points, triangles }) {
  const at = (i) => points.subarray(3 * i, 3 * i + 3), met = new Map();
  for (let t = 0; t < triangles.length; t += 3) {
    const corners = triangles.subarray(t, t + 3), [a, b, c] = [...corners].map(at);
    const n = cross([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]), size = Math.hypot(...n) || 1;
    corners.forEach((from, i) => {
      const to = corners[(i + 1) % 3], key = from < to ? from * 4294967296 + to : to * 4294967296 + from;
      const of = met.get(key) ?? { from, to, normals: [] };
      of.normals.push(n.map((v) => v / size));
      met.set(key, of);
    });
  }
  const sharp = [...met.values()].filter(({ normals: [m, n] }) => !n || Math.abs(m[0] * n[0] + m[1] * n[1] + m[2] * n[2]) < SHARP);
  return Uint32Array.from(sharp.flatMap(({ from, to }) => [from, to]));
}

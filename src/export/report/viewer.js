"use strict";
// The bodies in three dimensions: turned by the mouse, moved through a period, coloured by a field.

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
in vec3 position; in float value; in vec4 kind; uniform mat4 view, projection;
out float v; out vec4 share; out vec3 eye;
void main() {
  vec4 p = view * vec4(position, 1.0);
  eye = p.xyz; v = value; share = kind; gl_Position = projection * p;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in float v; in vec4 share; in vec3 eye; out vec4 colour;
uniform sampler2D map; uniform vec3 plain, kinds[4]; uniform bool line, sorted;
/** The kind of which a corner has most; there is nothing between two kinds. */
vec3 kindOf() {
  float most = max(max(share.x, share.y), max(share.z, share.w));
  if (most <= 0.0) return plain;
  return share.x == most ? kinds[0] : share.y == most ? kinds[1] : share.z == most ? kinds[2] : kinds[3];
}
void main() {
  if (line) { colour = vec4(plain, 1.0); return; }
  vec3 n = normalize(cross(dFdx(eye), dFdy(eye)));
  float light = 0.45 + 0.55 * abs(dot(n, normalize(vec3(0.25, 0.45, 1.0))));
  // Below zero: a part that has no value.
  vec3 c = sorted ? kindOf() : v < -0.5 ? plain : texture(map, vec2(clamp(v, 0.0, 1.0) * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
  colour = vec4(c * light, 1.0);
}`;

/**
 * Draws `mesh` in a canvas.
 * mesh: points (Float32Array, m), triangles, edges, flankTriangles (Uint32Array), body of each point (Uint8Array),
 * harmonics [{ k, cosine, sine }] (Float32Array as points, m).
 */
class Viewer {
  constructor(canvas, mesh) {
    this.canvas = canvas;
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
      flanks: this.indices(mesh.flankTriangles),
    };
    this.phase = 0;
    this.scale = 1;
    this.apart = 0;
    this.showEdges = false;
    this.measure();
    this.reset();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
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

  /** The middle and the size of the bodies. */
  measure() {
    const low = [Infinity, Infinity, Infinity], high = low.map((v) => -v);
    this.mesh.points.forEach((v, i) => {
      low[i % 3] = Math.min(low[i % 3], v);
      high[i % 3] = Math.max(high[i % 3], v);
    });
    this.centre = low.map((v, i) => (v + high[i]) / 2);
    this.radius = Math.hypot(...low.map((v, i) => high[i] - v)) / 2;
  }

  /** Looks along the axis of rotation's slant, outwards up. */
  reset() {
    const x = Quaternion.about([1, 0, 0], -Math.PI / 2 + 0.25);
    this.turn = Quaternion.times(x, Quaternion.about([0, 0, 1], -0.9));
    this.distance = 3.6 * this.radius;
    this.shift = [0, 0];
    this.draw();
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
      if (pointers.size === 2) this.distance *= before / Math.max(1, spread());
      else if (e.shiftKey || e.buttons === 2) this.pan(dx, dy);
      else this.rotate(dx, dy);
      this.draw();
    });
    c.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.distance *= Math.exp(0.001 * e.deltaY);
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
    const per = (2 * this.distance * Math.tan(0.3)) / this.canvas.clientHeight;
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

  /** Colours each point by its kind, 0 to 3 (below 0: none), with four colours [r, g, b]. */
  sort(kindOfPoint, colours) {
    const gl = this.gl, shares = new Float32Array((4 * this.mesh.points.length) / 3);
    kindOfPoint.forEach((kind, i) => {
      if (kind >= 0) shares[4 * i + kind] = 1;
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.kind);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, shares);
    this.kinds = colours.flat().map((c) => c / 255);
    this.draw();
  }

  /** Displacement from the mean at the phase, m. */
  displacement(out) {
    out.fill(0);
    for (const { k, cosine, sine } of this.mesh.harmonics) {
      const c = Math.cos(k * this.phase), s = Math.sin(k * this.phase);
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
    const gl = this.gl, c = this.canvas, { points, body } = this.mesh;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const [w, h] = [Math.round(c.clientWidth * ratio), Math.round(c.clientHeight * ratio)];
    if (w === 0 || h === 0) return;
    if (c.width !== w || c.height !== h) [c.width, c.height] = [w, h];
    this.displacement(this.moved);
    for (let i = 0; i < points.length; i++) {
      const away = i % 3 === 2 && body[(i / 3) | 0] === 0 ? this.apart * this.radius : 0;
      this.moved[i] = points[i] + this.scale * this.moved[i] + away;
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.position);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.moved);
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const d = this.distance, r = this.radius;
    const projection = Matrix.perspective(0.6, w / h, Math.max(0.01 * r, d - 3 * r), d + 3 * r);
    const view = Matrix.times(
      Matrix.translation([this.shift[0], this.shift[1], -d]),
      Matrix.times(Matrix.rotation(this.turn), Matrix.translation(this.centre.map((v) => -v))),
    );
    const at = (name) => gl.getUniformLocation(this.program, name);
    gl.uniformMatrix4fv(at("projection"), false, projection);
    gl.uniformMatrix4fv(at("view"), false, view);
    const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.uniform1i(at("line"), 0);
    gl.uniform1i(at("sorted"), this.kinds ? 1 : 0);
    if (this.kinds) gl.uniform3fv(at("kinds"), this.kinds);
    gl.uniform3fv(at("plain"), dark ? [0.5, 0.53, 0.58] : [0.78, 0.8, 0.83]);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.triangles.buffer);
    gl.drawElements(gl.TRIANGLES, this.buffers.triangles.count, gl.UNSIGNED_INT, 0);
    // The flanks lie on faces of the bodies: nearer by a little.
    gl.polygonOffset(-1, -1);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.flanks.buffer);
    gl.drawElements(gl.TRIANGLES, this.buffers.flanks.count, gl.UNSIGNED_INT, 0);
    if (this.showEdges) {
      gl.uniform1i(at("line"), 1);
      gl.uniform3fv(at("plain"), dark ? [0.1, 0.11, 0.13] : [0.35, 0.37, 0.4]);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.edges.buffer);
      gl.drawElements(gl.LINES, this.buffers.edges.count, gl.UNSIGNED_INT, 0);
    }
  }
}

// The 3D view: plain WebGL. Bodies are drawn with a lamp at the eye; rays are ribbons of pixels.
const VIEW_ANGLE = Math.PI / 6; // vertical
const SOLID_VERTEX = `
attribute vec3 place; attribute vec4 normal; attribute vec4 colour;
uniform mat4 project, model; varying vec3 at, across; varying vec4 paint;
void main() {
  vec4 moved = model * vec4(place, 1.0);
  at = moved.xyz; across = mat3(model) * normal.xyz; paint = colour;
  gl_Position = project * moved;
}`;
const SOLID_FRAGMENT = `
precision mediump float;
uniform vec3 eye; uniform float shine; varying vec3 at, across; varying vec4 paint;
void main() {
  vec3 n = normalize(across), look = normalize(eye - at);
  if (dot(n, look) < 0.0) n = -n;
  float facing = dot(n, look), up = 0.5 + 0.5 * n.z;
  float light = 0.30 + 0.52 * facing + 0.18 * up;
  float spot = shine * pow(max(dot(n, normalize(look + vec3(0.25, -0.2, 0.5))), 0.0), 40.0);
  gl_FragColor = vec4(paint.rgb * light + spot, paint.a);
}`;
const LINE_VERTEX = `
attribute vec3 place, other; attribute vec4 colour; attribute vec3 shape;
uniform mat4 project; uniform vec2 size; varying vec4 paint; varying float along;
void main() {
  vec4 a = project * vec4(place, 1.0), b = project * vec4(other, 1.0);
  vec2 p = a.xy / max(a.w, 1e-3), q = b.xy / max(b.w, 1e-3), way = (q - p) * size;
  vec2 side = normalize(vec2(-way.y, way.x) + 1e-6);
  gl_Position = a + vec4(side * shape.x * shape.y / size * a.w, 0.0, 0.0);
  paint = colour; along = shape.z;
}`;
const LINE_FRAGMENT = `
precision mediump float;
uniform float strength; varying vec4 paint; varying float along;
void main() {
  if (along > 0.0 && mod(along, 8.0) > 5.0) discard;
  gl_FragColor = vec4(paint.rgb, paint.a * strength);
}`;

const LINE_NUMBERS = [["place", 3], ["other", 3], ["colour", 4], ["shape", 3]]; // of each corner

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return made;
}

function buffered(gl, data, usage = gl.STATIC_DRAW) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, data, usage);
  return buffer;
}

function fed(gl, made, name, buffer, size, kind, normalised, stride = 0, first = 0) {
  const place = gl.getAttribLocation(made, name);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, size, kind, normalised, stride, first);
}

class Viewer {
  constructor(canvas, axis, changed) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) return;
    this.solid = program(this.gl, SOLID_VERTEX, SOLID_FRAGMENT);
    this.line = program(this.gl, LINE_VERTEX, LINE_FRAGMENT);
    Object.assign(this, { axis, changed, bodies: [], lines: null, explode: 0, angle: 0, waiting: false });
    Object.assign(this, { azimuth: -1.0, elevation: 0.35, target: [0, 0, 0], distance: 600 });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // A body is made when it is first shown, so that the page is there at once.
  add(record, meshOf) {
    this.bodies.push({ ...record, meshOf, shown: false, loaded: false });
  }

  load(body) {
    const gl = this.gl, mesh = body.meshOf(), colours = new Uint8Array(4 * mesh.positions.length / 3);
    for (let i = 0; i < colours.length; i++) colours[i] = 255 * body.colour[i % 4];
    Object.assign(body, mesh, {
      box: bounds(mesh.positions), colours, loaded: true, place: buffered(gl, mesh.positions),
      normal: buffered(gl, mesh.normals), paint: buffered(gl, colours, gl.DYNAMIC_DRAW),
    });
  }

  repaint(body) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, body.paint);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, body.colours);
    this.draw();
  }

  // Segments: { from, to, colour: [r, g, b, a], width (pixels), dashed }.
  setLines(segments) {
    const values = [];
    for (const { from, to, colour, width, dashed } of segments) {
      const end = dashed ? length(add(to, from, -1)) : 0;
      const one = (p, q, side, along) => values.push(...p, ...q, ...colour, side, width, along);
      const begin = dashed ? 1e-3 : 0;
      one(from, to, 1, begin); one(from, to, -1, begin); one(to, from, 1, end);
      one(from, to, 1, begin); one(to, from, 1, end); one(to, from, -1, end);
    }
    const { gl } = this, data = new Float32Array(values);
    this.lines = { buffer: this.lines?.buffer || gl.createBuffer(), count: data.length / 13 };
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lines.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    this.draw();
  }

  get eye() {
    const flat = Math.cos(this.elevation);
    const away = [flat * Math.cos(this.azimuth), flat * Math.sin(this.azimuth), Math.sin(this.elevation)];
    return add(this.target, away, this.distance);
  }

  // Where the picture's axes point: right, up, and forward.
  get axes() {
    const forward = unit(add(this.target, this.eye, -1)), right = unit(cross(forward, [0, 0, 1]));
    return { forward, right, up: cross(right, forward) };
  }

  get slope() { return Math.tan(VIEW_ANGLE / 2); }

  project() {
    const { forward, right, up } = this.axes, eye = this.eye, s = 1 / this.slope;
    const near = Math.max(this.distance / 100, 1), far = this.distance + 4000;
    const ratio = this.canvas.width / this.canvas.height;
    const [x, y] = ratio > 1 ? [s / ratio, s] : [s, s * ratio];
    const a = (far + near) / (far - near), b = -2 * far * near / (far - near);
    const rows = [scaled(right, x), scaled(up, y), scaled(forward, a), forward];
    const last = rows.map((one, k) => -dot(one, eye) + (k === 2 ? b : 0));
    const result = [];
    for (let c = 0; c < 3; c++) for (const one of rows) result.push(one[c]);
    return new Float32Array([...result, ...last]);
  }

  // How a body is placed: moved when taken apart, then turned with the base.
  model(body) {
    const turn = (p) => (body.turns ? rotated(p, this.axis, this.angle) : p);
    const moved = turn(scaled(body.apart, this.explode));
    const columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(turn);
    return new Float32Array([...columns.flatMap((c) => [...c, 0]), ...moved, 1]);
  }

  draw() {
    if (!this.gl || this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.render(); });
  }

  render() {
    const { gl, canvas } = this, scale = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * scale), height = Math.round(canvas.clientHeight * scale);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const project = this.project(), shown = this.bodies.filter((body) => body.shown);
    gl.disable(gl.BLEND);
    this.renderSolids(project, shown.filter((body) => body.colour[3] >= 1));
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.renderLines(project, scale);
    this.renderSolids(project, shown.filter((body) => body.colour[3] < 1));
    gl.depthMask(true);
    this.changed?.();
  }

  renderSolids(project, bodies) {
    const { gl, solid } = this;
    gl.useProgram(solid);
    gl.uniformMatrix4fv(gl.getUniformLocation(solid, "project"), false, project);
    gl.uniform3fv(gl.getUniformLocation(solid, "eye"), this.eye);
    const model = gl.getUniformLocation(solid, "model"), shine = gl.getUniformLocation(solid, "shine");
    for (const body of bodies) {
      gl.uniformMatrix4fv(model, false, this.model(body));
      gl.uniform1f(shine, body.colour[3] < 1 ? 0 : body.owner || body.group === "balls" ? 0.35 : 0.08);
      fed(gl, solid, "place", body.place, 3, gl.FLOAT, false);
      fed(gl, solid, "normal", body.normal, 4, gl.BYTE, true);
      fed(gl, solid, "colour", body.paint, 4, gl.UNSIGNED_BYTE, true);
      gl.drawArrays(gl.TRIANGLES, 0, body.positions.length / 3);
    }
  }

  renderLines(project, scale) {
    const { gl, line, lines } = this;
    if (!lines?.count) return;
    gl.useProgram(line);
    gl.uniformMatrix4fv(gl.getUniformLocation(line, "project"), false, project);
    gl.uniform2f(gl.getUniformLocation(line, "size"), this.canvas.width / scale, this.canvas.height / scale);
    let first = 0;
    for (const [name, size] of LINE_NUMBERS) {
      fed(gl, line, name, lines.buffer, size, gl.FLOAT, false, 52, first);
      first += 4 * size;
    }
    // What is hidden by a body shows through it faintly.
    for (const [test, strength] of [[gl.GREATER, 0.3], [gl.LEQUAL, 1]]) {
      gl.depthFunc(test);
      gl.uniform1f(gl.getUniformLocation(line, "strength"), strength);
      gl.drawArrays(gl.TRIANGLES, 0, lines.count);
    }
    gl.depthFunc(gl.LESS);
  }

  // Show all bodies that are switched on, and some points.
  fit(points = []) {
    const corners = [...points];
    for (const body of this.bodies.filter((one) => one.shown && one.colour[3] > 0.2)) {
      const moved = scaled(body.apart, this.explode), { low, high } = body.box;
      for (let k = 0; k < 8; k++) {
        const corner = [0, 1, 2].map((i) => ((k >> i) & 1 ? high[i] : low[i]) + moved[i]);
        corners.push(body.turns ? rotated(corner, this.axis, this.angle) : corner);
      }
    }
    if (!corners.length || !this.gl) return;
    const { low, high } = bounds(corners.flat());
    this.target = scaled(add(low, high), 0.5);
    const { right, up, forward } = this.axes;
    const wide = this.canvas.clientWidth / (this.canvas.clientHeight || 1) || 1;
    const [x, y] = wide > 1 ? [wide * this.slope, this.slope] : [this.slope, this.slope / wide];
    const needed = corners.map((p) => {
      const q = add(p, this.target, -1);
      return Math.max(Math.abs(dot(q, right)) / x, Math.abs(dot(q, up)) / y) - dot(q, forward);
    });
    this.distance = 1.04 * Math.max(...needed);
    this.draw();
  }

  // The body and triangle at a place of the canvas, in CSS pixels.
  pick(x, y) {
    const { right, up, forward } = this.axes, w = this.canvas.clientWidth, h = this.canvas.clientHeight;
    const half = Math.min(w, h) / 2, s = this.slope / half;
    const along = unit(add(add(forward, right, (x - w / 2) * s), up, (h / 2 - y) * s));
    let found = null;
    for (const body of this.bodies) {
      if (!body.shown || body.colour[3] < 0.5) continue;
      const back = (p) => (body.turns ? rotated(p, this.axis, -this.angle) : p);
      const from = add(back(this.eye), body.apart, -this.explode), way = back(along);
      if (!meetsBox(body.box, from, way)) continue;
      const met = metTriangle(body, from, way);
      if (met && (!found || met.distance < found.distance)) found = { body, ...met };
    }
    return found;
  }
}

// The page: 3D view, map and row of a mirror follow each other.
const id = (name) => document.getElementById(name);
const MARK = [214, 0, 108, 255], GREY = [0.5, 0.5, 0.5, 0.9];
const COVERAGE = ["covered", "facets", "designed"];

function setTheme(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  id("theme").textContent = dark ? "Light" : "Dark";
}

// Mirrors as objects, and the virtual cameras: both halves of a mirror on the seam make one.
function readMirrors(data, buffer) {
  const table = data.mirrors, pose = arrayAt(buffer, table.pose);
  const radius = arrayAt(buffer, table.radius), size = arrayAt(buffer, table.size);
  const triple = (i, k) => [pose[9 * i + k], pose[9 * i + k + 1], pose[9 * i + k + 2]];
  const mirrors = table.ids.map((name, i) => ({
    name, number: i, camera: name[0], u: triple(i, 0), apex: triple(i, 3), normal: triple(i, 6),
    radius: radius[i], size: size[i], plan: table.plan[i] || null,
  }));
  const views = [], seen = new Map();
  for (const mirror of mirrors) {
    const key = mirror.u.map((x) => Math.round(1e5 * x) || 0).join();
    if (!seen.has(key)) seen.set(key, views.push({ u: mirror.u, mirrors: [] }) - 1);
    mirror.view = seen.get(key);
    views[mirror.view].mirrors.push(mirror);
  }
  const quantities = table.quantities.map((one) => {
    const each = arrayAt(buffer, one.values);
    const values = views.map((view) => {
      const found = view.mirrors.map((mirror) => each[mirror.number]);
      return one.added ? found.reduce((a, b) => a + b, 0) : found[0];
    });
    return { ...one, each, values };
  });
  return { mirrors, views, quantities };
}

class Page {
  constructor(data, buffer) {
    Object.assign(this, { data, ...readMirrors(data, buffer), view: -1 });
    const offsets = arrayAt(buffer, data.outlines.offsets), points = arrayAt(buffer, data.outlines.points);
    this.perCamera = offsets.length - 1;
    this.outline = (mirror) => {
      const k = mirror.number % this.perCamera, side = mirror.camera === "a" ? 1 : -1, found = [];
      for (let i = offsets[k]; i < offsets[k + 1]; i++) {
        const [x, y, z] = row(points, i);
        found.push([side * x, y, z]);
      }
      return found;
    };
    this.map = new HemisphereMap(id("hemisphere"), this.views, (k) => this.choose(k));
    this.startViewer(buffer);
    this.startControls();
    this.showQuantity();
    this.choose(-1);
  }

  startViewer(buffer) {
    this.viewer = new Viewer(id("canvas"), this.data.axis);
    if (!this.viewer.gl) {
      id("no3d").hidden = false;
      return;
    }
    for (const record of this.data.bodies) {
      const source = this.data.bodies.find((one) => one.name === (record.mirrored || record.name));
      const meshOf = () => expanded(source, buffer);
      this.viewer.add({ ...source, ...record, hasMirrors: Boolean(source.owner) },
        record.mirrored ? () => mirrored(meshOf()) : meshOf);
    }
    for (const [group, label] of Object.entries(this.data.groups)) {
      const box = element("input", { type: "checkbox", id: `group_${group}` });
      box.addEventListener("change", () => this.switched());
      id("groups").append(element("label", {}, box, ` ${label}`));
    }
    this.startPresets();
    this.startPointer();
  }

  get hasShell() { return "shell_a" in this.data.groups; }
  get hasPrototype() { return "base" in this.data.groups; }

  startPresets() {
    const all = Object.keys(this.data.groups), shells = ["shell_a", "shell_b", "lamps"];
    const hidden = ["shroud", "views"], rig = all.filter((one) => ![...shells, ...hidden].includes(one));
    const presets = [];
    if (this.hasShell) presets.push(["Shells", shells, [-1.25, -0.55]], ["One shell", ["shell_b"], [-0.25, -0.12]]);
    if (this.hasPrototype) presets.push(["Prototype", rig, [-2.3, 0.22]]);
    if (this.hasShell && this.hasPrototype) presets.push(["Prototype and shell", [...rig, "shell_b"], [-1.0, 0.1]]);
    for (const [label, groups, way] of presets) {
      const button = element("button", { type: "button" }, label);
      button.addEventListener("click", () => this.preset(groups, way));
      id("presets").append(button);
    }
    this.presets = presets;
    if (presets.length) this.preset(presets[0][1], presets[0][2]);
  }

  preset(groups, [azimuth, elevation]) {
    for (const box of id("groups").querySelectorAll("input")) box.checked = groups.includes(box.id.slice(6));
    Object.assign(this.viewer, { azimuth, elevation });
    this.switched();
    this.fit();
  }

  fit() { this.viewer.fit(this.data.cameras.map((one) => scaled(one.pinhole, 1.2))); }

  switched() {
    const shown = (group) => id(`group_${group}`).checked;
    for (const body of this.viewer.bodies) {
      body.shown = shown(body.group);
      if (!body.shown || body.loaded) continue;
      this.viewer.load(body);
      if (body.hasMirrors && this.quantity) this.paint(body);
    }
    const on = Object.keys(this.data.groups).filter(shown).sort().join();
    [...id("presets").children].forEach((button, k) =>
      button.setAttribute("aria-pressed", [...this.presets[k][1]].sort().join() === on));
    this.showRays();
  }

  startPointer() {
    const canvas = id("canvas"), viewer = this.viewer, fingers = new Map();
    let travelled = 0, spread = 0;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (fingers.size === 1) travelled = 0;
      spread = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = fingers.get(event.pointerId);
      if (!last) return;
      const dx = event.clientX - last[0], dy = event.clientY - last[1];
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      travelled += Math.abs(dx) + Math.abs(dy);
      if (fingers.size > 1) {
        const [[ax, ay], [bx, by]] = [...fingers.values()], now = Math.hypot(ax - bx, ay - by);
        if (spread) viewer.distance *= spread / now;
        spread = now;
        travelled = 100;
        this.shift(dx / 2, dy / 2);
      } else if (event.shiftKey || event.buttons === 2) this.shift(dx, dy);
      else this.turn(-0.008 * dx, 0.008 * dy);
    });
    const lift = (event) => {
      const clicked = fingers.delete(event.pointerId) && travelled < 5 && event.type === "pointerup";
      if (clicked) this.clicked(event.offsetX, event.offsetY);
    };
    canvas.addEventListener("pointerup", lift);
    canvas.addEventListener("pointercancel", lift);
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.typed(event));
  }

  typed(event) {
    const step = 0.12;
    const does = {
      ArrowLeft: () => this.turn(-step, 0), ArrowRight: () => this.turn(step, 0),
      ArrowUp: () => this.turn(0, step), ArrowDown: () => this.turn(0, -step),
      "+": () => this.zoom(0.85), "=": () => this.zoom(0.85), "-": () => this.zoom(1 / 0.85),
      Home: () => this.fit(),
    }[event.key];
    if (!does) return;
    event.preventDefault();
    does();
  }

  turn(azimuth, elevation) {
    const viewer = this.viewer, most = 1.55;
    viewer.azimuth += azimuth;
    viewer.elevation = Math.min(Math.max(viewer.elevation + elevation, -most), most);
    viewer.draw();
  }

  zoom(factor) {
    this.viewer.distance = Math.min(Math.max(this.viewer.distance * factor, 20), 5000);
    this.viewer.draw();
  }

  shift(dx, dy) {
    const { right, up } = this.viewer.axes, canvas = id("canvas");
    const pitch = 2 * this.viewer.distance * this.viewer.slope / Math.min(canvas.clientWidth, canvas.clientHeight);
    this.viewer.target = add(add(this.viewer.target, right, -dx * pitch), up, dy * pitch);
    this.viewer.draw();
  }

  clicked(x, y) {
    const found = this.viewer.pick(x, y), owner = found?.body.owner?.[found.triangle];
    id("named").textContent = found && !owner ? found.body.name.replaceAll("_", " ") : "";
    if (!owner) return;
    const number = owner - 1 + (found.body.name === "shell_b" ? this.perCamera : 0);
    this.choose(this.mirrors[number].view);
  }

  startControls() {
    const select = id("quantity");
    for (const one of this.quantities.filter((quantity) => quantity.map))
      select.append(element("option", { value: one.key }, one.unit ? `${one.label} (${one.unit})` : one.label));
    select.value = this.firstShown();
    select.addEventListener("change", () => this.showQuantity());
    id("find").addEventListener("input", (event) => {
      const mirror = this.mirrors.find((one) => one.name === event.target.value.trim().toLowerCase());
      if (mirror) this.choose(mirror.view);
    });
    id("explode").addEventListener("input", (event) => {
      this.viewer.explode = Number(event.target.value);
      this.showRays();
      this.fit();
    });
    id("fit").addEventListener("click", () => this.fit());
  }

  // Coverage where it falls short; else it hardly differs, and pixels say more.
  firstShown() {
    const short = this.quantities.find((one) => COVERAGE.includes(one.key) && one.values.some((x) => x < this.data.target));
    const told = short || ["pixels", "radius"].map((key) => this.quantities.find((one) => one.key === key)).find(Boolean);
    return (told || this.quantities[0]).key;
  }

  showQuantity() {
    const quantity = this.quantities.find((one) => one.key === id("quantity").value);
    this.map.show(quantity, COVERAGE.includes(quantity.key) ? this.data.target : 0);
    this.quantity = quantity;
    this.paintAll();
  }

  paintAll() {
    for (const body of this.viewer.bodies || []) if (body.loaded && body.hasMirrors) this.paint(body);
  }

  // Mirrors in the colours of the map; the chosen one stands out.
  paint(body) {
    const first = body.name === "shell_b" ? this.perCamera : 0;
    const own = Array.from({ length: this.perCamera + 1 }, (_, k) => {
      if (k === 0) return body.colour.map((value) => 255 * value);
      const view = this.mirrors[first + k - 1].view;
      return view === this.view ? MARK : [...this.map.colour(this.quantity.values[view]), 255];
    });
    for (let t = 0; t < body.owner.length; t++)
      for (let k = 0; k < 3; k++) body.colours.set(own[body.owner[t]], 4 * (3 * t + k));
    this.viewer.repaint(body);
  }

  choose(k) {
    this.view = k;
    this.map.choose(k);
    this.showDetails();
    if (!this.viewer.gl) return;
    this.paintAll();
    const plan = k < 0 ? null : this.views[k].mirrors[0].plan;
    this.viewer.angle = plan ? plan[2] * Math.PI / 180 : 0;
    this.showRays();
  }

  showRays() {
    const grey = GREY, lines = objectSphere(this.data.target / 2, grey);
    for (const one of this.data.cameras) lines.push(...cameraSign(one.pinhole, scaled(one.pinhole, -1), 16, grey));
    const mirrors = this.view < 0 ? [] : this.views[this.view].mirrors;
    const shown = (group) => this.viewer.bodies.some((body) => body.group === group && body.shown);
    const onBall = shown("balls") && !shown("shell_a");
    for (const mirror of mirrors) {
      const ball = onBall && mirror === mirrors[0] ? this.ballFor(mirror) : null;
      if (ball) lines.push(...raysOf(ball, this.data.cameras[0].pinhole, ringOn(ball, mirror.size)));
      if (onBall && !shown(`shell_${mirror.camera}`)) continue;
      const pinhole = this.data.cameras.find((one) => one.id === mirror.camera).pinhole;
      const moved = this.hasShell ? this.apart(`shell_${mirror.camera}`) : [0, 0, 0];
      const rays = raysOf(mirror, pinhole, this.outline(mirror));
      if (length(moved) > 0) continue; // a shell that is taken away shows no light path
      lines.push(...rays, ...closed(this.outline(mirror), [0.84, 0, 0.42, 1], 2));
      const end = scaled(mirror.u, this.data.distance);
      lines.push({ from: mirror.apex, to: end, colour: RAY_COLOURS.virtual, width: 1, dashed: true });
    }
    this.viewer.setLines(lines);
    this.showLegend(mirrors.length > 0);
  }

  apart(name) {
    const body = this.viewer.bodies.find((one) => one.name === name);
    return body ? scaled(body.apart, this.viewer.explode) : [0, 0, 0];
  }

  // The ball that stands in for a mirror, where the base has turned it.
  ballFor(mirror) {
    if (!mirror.plan) return null;
    const ball = this.data.mirrors.balls.find((one) => one.number === mirror.plan[0]);
    const turn = (p) => rotated(p, this.data.axis, mirror.plan[2] * Math.PI / 180);
    return ball && { apex: turn(ball.apex), normal: turn(ball.normal), radius: ball.radius };
  }

  showLegend(rays) {
    const key = (colour, text) => [element("span", { class: "key", style: `background:${css(colour.slice(0, 3).map((x) => Math.round(255 * x)))}` }), text];
    id("legend3d").replaceChildren(...(rays
      ? [...key(RAY_COLOURS.camera, "camera to mirror"), ...key(RAY_COLOURS.object, "mirror to object"), ...key(RAY_COLOURS.virtual, "to the virtual camera")]
      : ["Mirrors have the colours of the map. Choose a virtual camera to see its rays."]));
  }

  showDetails() {
    const place = id("details");
    if (this.view < 0) {
      place.replaceChildren(element("p", {}, "No virtual camera is chosen."));
      return;
    }
    const { mirrors, u } = this.views[this.view], names = mirrors.map((one) => one.name).join(" and ");
    const halves = mirrors.length > 1 ? ": two halves of one mirror, one on each side of the seam" : "";
    const degrees = (x) => `${(x * 180 / Math.PI).toFixed(2)}°`;
    const rows = [["Direction", `azimuth ${degrees(Math.atan2(u[1], u[0]))}, elevation ${degrees(Math.asin(u[2]))}`]];
    for (const one of this.quantities) {
      const shown = mirrors.map((mirror) => this.figure(one, one.each[mirror.number]));
      rows.push([one.label, [...new Set(shown)].length > 1 || one.added ? shown.join(" and ") : shown[0]]);
    }
    rows.push(...mirrors.filter((one) => one.plan).map((one) => this.planRow(one)));
    const table = element("table", {}, ...rows.map(([head, text]) =>
      element("tr", {}, element("th", { scope: "row" }, head), element("td", {}, text))));
    place.replaceChildren(
      element("h3", { id: "chosen" }, `Virtual camera ${names}${halves}`),
      element("div", { class: "row" }, table, ...mirrors.flatMap((one) => this.photograph(one))),
    );
  }

  figure(quantity, value) {
    return Number.isFinite(value) ? `${value.toFixed(quantity.digits)} ${quantity.unit}`.trim() : "not known";
  }

  planRow(mirror) {
    const [number, stop, angle, turn] = mirror.plan;
    const ball = this.data.mirrors.balls.find((one) => one.number === number);
    const turned = turn ? `, object turned by ${turn}°` : "";
    return [`Prototype for ${mirror.name}`, `seat ${number} (${ball ? ball.name : "?"}), stop ${stop}, base at ${angle.toFixed(2)}°${turned}`];
  }

  // What the camera photographs in a mirror, with a little around it.
  photograph(mirror) {
    const photo = this.data.photographs[mirror.camera];
    if (!photo) return [];
    const [x0, y0, x1, y1] = photo.boxes[mirror.number % this.perCamera];
    const width = x1 - x0, height = y1 - y0, grown = Math.max(1, Math.round(240 / Math.max(width, height)));
    const canvas = element("canvas", { width: grown * width, height: grown * height });
    const image = new Image();
    image.onload = () => {
      const s = image.naturalWidth / photo.size[0];
      canvas.getContext("2d").drawImage(image, x0 * s, y0 * s, width * s, height * s, 0, 0, canvas.width, canvas.height);
    };
    image.src = photo.url;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `Photograph in mirror ${mirror.name}`);
    return [element("figure", {}, canvas, element("figcaption", {}, `${mirror.name} in the photograph of camera ${mirror.camera}`))];
  }
}

// Print what is seen: the 3D view as a picture; closed lists stay closed.
function startPrinting() {
  let picture = null;
  addEventListener("beforeprint", () => {
    picture = element("img", { class: "printed", src: id("canvas").toDataURL(), alt: "3D view" });
    id("canvas").parentElement.append(picture);
  });
  addEventListener("afterprint", () => picture?.remove());
  id("print").addEventListener("click", () => print());
}

// Cells know their column, which narrow screens show in front of them; keys scroll wide tables.
function labelTables() {
  for (const table of document.querySelectorAll(".wide table")) {
    const heads = [...table.tHead.rows[0].cells].map((cell) => cell.firstChild.textContent);
    for (const row of table.tBodies[0].rows) {
      [...row.cells].forEach((cell, k) => { cell.dataset.head = heads[k]; });
    }
    const title = table.closest("section").querySelector("h2").textContent;
    Object.assign(table.parentElement, { tabIndex: 0, role: "region", ariaLabel: title });
  }
}

async function start() {
  setTheme(matchMedia("(prefers-color-scheme: dark)").matches);
  id("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme !== "dark"));
  startPrinting();
  labelTables();
  const data = JSON.parse(id("data").textContent);
  window.report = new Page(data, await unpack(data.arrays));
  document.documentElement.dataset.ready = "true";
}

start();

// Asks the server for the view that is wanted now. Two requests are under way at most: while the
// server makes one picture, the other is sent, unpacked and drawn.
const IN_FLIGHT = 2;
// Degrees a pixel of a drag, a key, and a second of turning.
const DRAG_DEG = 0.4, KEY_DEG = 5, TURN_DEG = 40;
const WHEEL_STEP = 1.1;
// Without movement for so long, the best picture is asked for.
const STILL_MS = 180;
// Views that take longer than this, 15 a second, are asked for at half the width and height while
// they move; at the full size again when they take less than a fifth, as they have a quarter of the pixels.
const SLOW_MS = 1000 / 15, QUICK_MS = SLOW_MS / 5;
const SMOOTHING = 0.85;

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const canvas = byId("canvas"), context = canvas.getContext("2d");

const viewer = {
  state: { ...data.start },
  asked: 0, // number of the last request
  shown: 0, // number of the newest picture that was drawn
  inFlight: 0,
  wanted: false, // whether the state has changed since the last request
  turning: false,
  smaller: true, // whether slow views may be made smaller while they move
  step: 1, // by which width and height are divided while views move
  interval: 0, // ms from one picture to the next, while they move; 0: not known
  draws: [], // times of the last pictures
  last: null, // what the picture that is shown was asked for with
};

const clamped = (name, value) =>
  Math.min(Math.max(value, data.limits[name][0]), data.limits[name][1]);

function size() {
  if (viewer.interval < QUICK_MS || !viewer.smaller) viewer.step = 1;
  else if (viewer.interval > SLOW_MS) viewer.step = 2;
  return ["width", "height"].map((side) => Math.round(data.start[side] / viewer.step));
}

function query(still) {
  const [width, height] = still ? [data.start.width, data.start.height] : size();
  const asked = { ...viewer.state, width, height, still: still ? 1 : 0 };
  asked.azimuth = ((asked.azimuth % 360) + 360) % 360;
  return asked;
}

async function ask(still) {
  const number = ++viewer.asked, asked = query(still), begun = performance.now();
  viewer.inFlight++;
  viewer.wanted = false;
  try {
    const answer = await fetch("view?" + new URLSearchParams(asked));
    if (answer.status === 200) {
      const picture = await createImageBitmap(await answer.blob());
      if (number > viewer.shown) draw(picture, number, asked, begun);
      picture.close();
    } else if (answer.status !== 204) byId("problem").textContent = await answer.text();
  } catch {
    byId("problem").textContent = "tbcad show has ended: start it again for more views.";
    viewer.turning = false;
  } finally {
    viewer.inFlight--;
  }
  if (viewer.wanted || viewer.turning) next();
}

function draw(picture, number, asked, begun) {
  viewer.shown = number;
  viewer.last = asked;
  context.imageSmoothingEnabled = true;
  context.drawImage(picture, 0, 0, canvas.width, canvas.height);
  byId("problem").textContent = "";
  const now = performance.now();
  const before = viewer.draws.at(-1);
  // Pauses between movements are no intervals.
  const took = before === undefined || before < begun - STILL_MS ? now - begun : now - before;
  viewer.draws.push(now);
  if (viewer.draws.length > 30) viewer.draws.shift();
  if (!asked.still) {
    const old = viewer.interval || took;
    viewer.interval = SMOOTHING * old + (1 - SMOOTHING) * took;
  }
  rate();
}

function rate() {
  const { still, width, height } = viewer.last;
  byId("rate").textContent =
    still ? "" : `${Math.round(1000 / viewer.interval)} views/s, ${width} x ${height}`;
}

let timer = 0;
function changed() {
  viewer.wanted = true;
  show();
  next();
  clearTimeout(timer);
  timer = setTimeout(still, STILL_MS);
}

function next() {
  if (viewer.turning) advance();
  while (viewer.inFlight < IN_FLIGHT && (viewer.wanted || viewer.turning)) {
    ask(false);
    if (viewer.turning) advance();
  }
}

function still() {
  if (viewer.turning) return;
  if (viewer.inFlight) timer = setTimeout(still, STILL_MS);
  else ask(true);
}

let turnedAt = 0;
function advance() {
  const now = performance.now();
  viewer.state.azimuth += (TURN_DEG * Math.min(now - turnedAt, 200)) / 1000;
  turnedAt = now;
  show();
}

function turn(on) {
  viewer.turning = on;
  byId("turn").setAttribute("aria-pressed", String(on));
  turnedAt = performance.now();
  if (on) next();
  else changed();
}

function show() {
  const { azimuth, elevation } = viewer.state;
  const turned = ((azimuth % 360) + 360) % 360;
  byId("place").textContent =
    `azimuth ${turned.toFixed(0)}°, elevation ${elevation.toFixed(0)}°`;
  for (const name of ["distance", "aperture", "focus"]) {
    byId(name).value = name === "distance" ? Math.log(viewer.state[name]) : viewer.state[name];
    const pinhole = name === "aperture" && viewer.state[name] === 0;
    const text = pinhole ? "pinhole" : `${viewer.state[name].toFixed(0)} mm`;
    document.querySelector(`output[for=${name}]`).textContent = text;
  }
  byId("focus").disabled = viewer.state.aperture === 0;
}

function move(degreesRight, degreesUp) {
  viewer.state.azimuth += degreesRight;
  viewer.state.elevation = clamped("elevation", viewer.state.elevation + degreesUp);
  changed();
}

function zoom(factor) {
  viewer.state.distance = clamped("distance", viewer.state.distance * factor);
  changed();
}

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  if (viewer.turning) turn(false);
});
canvas.addEventListener("pointermove", (event) => {
  if (event.buttons & 1) move(-DRAG_DEG * event.movementX, DRAG_DEG * event.movementY);
});
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(event.deltaY > 0 ? WHEEL_STEP : 1 / WHEEL_STEP);
}, { passive: false });
canvas.addEventListener("keydown", (event) => {
  const keys = {
    ArrowLeft: () => move(-KEY_DEG, 0), ArrowRight: () => move(KEY_DEG, 0),
    ArrowUp: () => move(0, KEY_DEG), ArrowDown: () => move(0, -KEY_DEG),
    "+": () => zoom(1 / WHEEL_STEP), "-": () => zoom(WHEEL_STEP), Home: home,
  };
  if (!(event.key in keys)) return;
  event.preventDefault();
  keys[event.key]();
});

function home() {
  viewer.state = { ...data.start };
  changed();
}

for (const name of ["distance", "aperture", "focus"]) {
  const slide = byId(name), [low, high] = data.limits[name];
  const far = name === "distance";
  Object.assign(slide, {
    min: far ? Math.log(low) : low, max: far ? Math.log(high) : high, step: far ? 0.005 : 1,
  });
  slide.addEventListener("input", () => {
    viewer.state[name] = clamped(name, far ? Math.exp(slide.value) : Number(slide.value));
    changed();
  });
}
byId("turn").addEventListener("click", () => turn(!viewer.turning));
byId("home").addEventListener("click", home);

[canvas.width, canvas.height] = [data.start.width, data.start.height];
for (const part of document.querySelectorAll(".lens")) part.hidden = !data.lens;
const [moving, atRest] = {
  field: ["the field in larger steps", "the field"],
  depth: ["the nearest virtual cameras", "a blend at the depth that is found"],
  nearest: ["the nearest virtual cameras", "nearest rays"],
}[data.method];
const [few, many] = data.lens ? [", or 9 pinholes of the lens at half size", ", or 69 pinholes"] : ["", ""];
const empty = data.method === "field" ? "" : " Black: no captured ray is near.";
byId("how").textContent = `While it moves: ${moving}${few}; smaller where this computer is slow. `
  + `At rest: ${atRest}${many}.${empty}`;
show();
ask(true).then(() => { document.documentElement.dataset.ready = "true"; });

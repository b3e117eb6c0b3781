// Views all around the object, row by row of elevation, each an image that the page holds.
// Pixels of a drag from one view to the next, and ms from one to the next while it turns.
const DRAG_PX = 8, TURN_MS = 70;

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const canvas = byId("canvas"), context = canvas.getContext("2d");
[canvas.width, canvas.height] = data.size;

const table = { column: 0, row: data.row, turning: false, images: [] };

function loaded(text) {
  const image = new Image();
  image.src = data.kind + text;
  return image.decode().then(() => image);
}

function show() {
  const columns = data.frames[0].length;
  table.column = ((table.column % columns) + columns) % columns;
  table.row = Math.min(Math.max(table.row, 0), data.frames.length - 1);
  const image = table.images[Math.round(table.row)]?.[Math.round(table.column) % columns];
  if (image) context.drawImage(image, 0, 0);
  const azimuth = (360 / columns) * (Math.round(table.column) % columns);
  const elevation = data.elevations[Math.round(table.row)];
  byId("place").textContent = `azimuth ${azimuth.toFixed(0)}°, elevation ${elevation.toFixed(0)}°`;
}

function move(columns, rows) {
  table.column += columns;
  table.row += rows;
  show();
}

function turn(on) {
  table.turning = on;
  byId("turn").setAttribute("aria-pressed", String(on));
}

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  turn(false);
});
canvas.addEventListener("pointermove", (event) => {
  if (event.buttons & 1) move(-event.movementX / DRAG_PX, event.movementY / (4 * DRAG_PX));
});
canvas.addEventListener("keydown", (event) => {
  const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  if (!(event.key in steps)) return;
  event.preventDefault();
  move(...steps[event.key]);
});
byId("turn").addEventListener("click", () => turn(!table.turning));
setInterval(() => { if (table.turning) move(1, 0); }, TURN_MS);

Promise.all(data.frames.map((row) => Promise.all(row.map(loaded)))).then((images) => {
  table.images = images;
  show();
  document.documentElement.dataset.ready = "true";
});

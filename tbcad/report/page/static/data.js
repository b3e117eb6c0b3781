// Data of the page: arrays packed by tbcad/report/page/packing.py.
const KINDS = { Int16Array, Uint16Array, Uint32Array, Float32Array };

async function unpack(text) {
  const packed = atob(text), bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; i++) bytes[i] = packed.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

const arrayAt = (buffer, [first, count, kind]) => new KINDS[kind](buffer, first, count);

// Vectors of three numbers.
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.sqrt(dot(a, a));
const unit = (a) => scaled(a, 1 / (length(a) || 1));
const row = (array, i) => [array[3 * i], array[3 * i + 1], array[3 * i + 2]];

// Rodrigues' formula; the angle in radians.
function rotated(p, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scaled(p, c), cross(axis, p), s), axis, dot(axis, p) * (1 - c));
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

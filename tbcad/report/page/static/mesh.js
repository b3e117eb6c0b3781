// Triangles for the graphics card: three corners each, with normals that are smooth but at edges.
const EDGE_COS = Math.cos(Math.PI / 6); // faces that meet at a larger angle keep their edge

function expanded(record, buffer) {
  const places = arrayAt(buffer, record.vertices), count = places.length / 3;
  const corners = arrayAt(buffer, record.triangles);
  const owner = record.owner ? arrayAt(buffer, record.owner) : null;
  const points = new Float32Array(3 * count);
  for (let v = 0; v < count; v++)
    for (let k = 0; k < 3; k++) points[3 * v + k] = record.low[k] + record.step * places[k * count + v];
  const positions = new Float32Array(3 * corners.length);
  for (let i = 0; i < corners.length; i++)
    for (let k = 0; k < 3; k++) positions[3 * i + k] = points[3 * corners[i] + k];
  return { positions, normals: smoothed(positions, corners, count, owner), owner };
}

function faceNormals(positions) {
  const faces = positions.length / 9, areas = new Float32Array(3 * faces);
  for (let f = 0; f < faces; f++) {
    const o = 9 * f, p = positions;
    const ax = p[o + 3] - p[o], ay = p[o + 4] - p[o + 1], az = p[o + 5] - p[o + 2];
    const bx = p[o + 6] - p[o], by = p[o + 7] - p[o + 1], bz = p[o + 8] - p[o + 2];
    areas[3 * f] = ay * bz - az * by;
    areas[3 * f + 1] = az * bx - ax * bz;
    areas[3 * f + 2] = ax * by - ay * bx;
  }
  return areas;
}

// Faces at each vertex: those of vertex v are list[start[v]] to list[start[v + 1] - 1].
function facesAt(corners, count) {
  const start = new Uint32Array(count + 1);
  for (const v of corners) start[v + 1]++;
  for (let v = 0; v < count; v++) start[v + 1] += start[v];
  const list = new Uint32Array(corners.length), next = start.slice();
  for (let i = 0; i < corners.length; i++) list[next[corners[i]]++] = (i / 3) | 0;
  return { start, list };
}

function smoothed(positions, corners, count, owner) {
  const areas = faceNormals(positions), { start, list } = facesAt(corners, count);
  const size = new Float32Array(areas.length / 3);
  for (let f = 0; f < size.length; f++) size[f] = Math.hypot(areas[3 * f], areas[3 * f + 1], areas[3 * f + 2]);
  const normals = new Int8Array(4 * corners.length);
  for (let i = 0; i < corners.length; i++) {
    const f = (i / 3) | 0, fx = areas[3 * f], fy = areas[3 * f + 1], fz = areas[3 * f + 2];
    let x = 0, y = 0, z = 0;
    for (let k = start[corners[i]]; k < start[corners[i] + 1]; k++) {
      const g = list[k], gx = areas[3 * g], gy = areas[3 * g + 1], gz = areas[3 * g + 2];
      if (owner && owner[f] !== owner[g]) continue;
      if (fx * gx + fy * gy + fz * gz < EDGE_COS * size[f] * size[g]) continue;
      x += gx; y += gy; z += gz;
    }
    const s = 127 / (Math.hypot(x, y, z) || 1);
    normals[4 * i] = x * s; normals[4 * i + 1] = y * s; normals[4 * i + 2] = z * s;
  }
  return normals;
}

// Camera b's shell: the mirror image in the plane x = 0.
function mirrored(mesh) {
  const positions = mesh.positions.slice(), normals = mesh.normals.slice();
  for (let i = 0; i < positions.length; i += 3) positions[i] = -positions[i];
  for (let i = 0; i < normals.length; i += 4) normals[i] = -normals[i];
  return { positions, normals, owner: mesh.owner };
}

function bounds(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i++) {
    const k = i % 3;
    if (positions[i] < low[k]) low[k] = positions[i];
    if (positions[i] > high[k]) high[k] = positions[i];
  }
  return { low, high };
}

// Nearest triangle that a ray meets, of either side: its number and distance, or null.
function metTriangle(mesh, from, along) {
  const p = mesh.positions;
  let nearest = null;
  for (let o = 0; o < p.length; o += 9) {
    const e1 = [p[o + 3] - p[o], p[o + 4] - p[o + 1], p[o + 5] - p[o + 2]];
    const e2 = [p[o + 6] - p[o], p[o + 7] - p[o + 1], p[o + 8] - p[o + 2]];
    const h = cross(along, e2), det = dot(e1, h);
    if (Math.abs(det) < 1e-12) continue;
    const s = [from[0] - p[o], from[1] - p[o + 1], from[2] - p[o + 2]], u = dot(s, h) / det;
    if (u < 0 || u > 1) continue;
    const q = cross(s, e1), v = dot(along, q) / det;
    if (v < 0 || u + v > 1) continue;
    const distance = dot(e2, q) / det;
    if (distance > 0 && (!nearest || distance < nearest.distance)) nearest = { triangle: o / 9, distance };
  }
  return nearest;
}

function meetsBox({ low, high }, from, along) {
  let first = 0, last = Infinity;
  for (let k = 0; k < 3; k++) {
    const one = (low[k] - from[k]) / along[k], other = (high[k] - from[k]) / along[k];
    first = Math.max(first, Math.min(one, other));
    last = Math.min(last, Math.max(one, other));
  }
  return first <= last;
}

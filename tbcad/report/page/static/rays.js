// Rays of a mirror: from the camera to the mirror, and on to the object.
const RAY_COLOURS = { camera: [0.0, 0.45, 0.7, 0.9], object: [0.9, 0.4, 0.0, 0.9], virtual: [0.5, 0.5, 0.5, 0.9] };
const RING = 12; // rays round a ball's mirror

// Unit normal of a mirror at a point, toward the object; a flat mirror has one everywhere.
function normalAt(mirror, point) {
  if (!Number.isFinite(mirror.radius)) return mirror.normal;
  const centre = add(mirror.apex, mirror.normal, -mirror.radius);
  return unit(add(point, centre, -1));
}

function reflectedRay(mirror, pinhole, point) {
  const way = unit(add(point, pinhole, -1)), normal = normalAt(mirror, point);
  return add(way, normal, -2 * dot(way, normal));
}

// Where a ray comes nearest to the object's middle.
const nearestToObject = (point, way) => add(point, way, -dot(point, way));

function raysOf(mirror, pinhole, points) {
  const segments = [];
  const ray = (point, width, alpha) => {
    const paint = (colour) => [...colour.slice(0, 3), alpha];
    const end = nearestToObject(point, reflectedRay(mirror, pinhole, point));
    segments.push({ from: pinhole, to: point, colour: paint(RAY_COLOURS.camera), width });
    segments.push({ from: point, to: end, colour: paint(RAY_COLOURS.object), width });
  };
  for (const point of points) ray(point, 1, 0.65);
  ray(mirror.apex, 2, 1);
  return segments;
}

// Points round the apex of a ball, as far out as the mirror that it stands in for is wide.
function ringOn(mirror, halfWidth) {
  const first = unit(cross(mirror.normal, Math.abs(mirror.normal[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const second = cross(mirror.normal, first), points = [];
  const depth = mirror.radius - Math.sqrt(Math.max(mirror.radius ** 2 - halfWidth ** 2, 0));
  for (let k = 0; k < RING; k++) {
    const angle = (2 * Math.PI * k) / RING;
    const out = add(scaled(first, halfWidth * Math.cos(angle)), second, halfWidth * Math.sin(angle));
    points.push(add(add(mirror.apex, out), mirror.normal, -depth));
  }
  return points;
}

function closed(points, colour, width) {
  return points.map((from, k) => ({ from, to: points[(k + 1) % points.length], colour, width }));
}

// The object's sphere as three circles.
function objectSphere(radius, colour) {
  return [[0, 1, 2], [1, 2, 0], [2, 0, 1]].flatMap(([i, j]) => {
    const points = Array.from({ length: 48 }, (_, k) => {
      const p = [0, 0, 0], angle = (2 * Math.PI * k) / 48;
      p[i] = radius * Math.cos(angle);
      p[j] = radius * Math.sin(angle);
      return p;
    });
    return closed(points, colour, 1);
  });
}

// A camera as a pyramid that looks up from its pinhole: the pinhole is its tip.
function cameraSign(pinhole, toward, size, colour) {
  const forward = unit(toward), right = unit(cross(forward, [0, 1, 0])), up = cross(right, forward);
  const corners = [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([a, b]) =>
    add(add(add(pinhole, forward, -size), right, 0.6 * a * size), up, 0.45 * b * size));
  return [...closed(corners, colour, 2), ...corners.map((to) => ({ from: pinhole, to, colour, width: 2 }))];
}

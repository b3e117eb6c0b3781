"""Every edge of every cell in closed form, and the rays along it: compiled, one half at a time.

Surfaces p and q meet in a circle (two planes: in a line) in a plane of equal power. From its
point x0 nearest to p's apex, with unit tangent e, unit n away from its middle and curvature k,

    x(t) = x0 + (t e - k t^2 / 2 n) / w,    w = 1 + k^2 t^2 / 4,

t being 2 / k times the tangent of half the angle. With f and g value and gradient at x0 of any
third surface of curvature c (tbcad.optics.surfaces), its value at x(t) times w is the polynomial

    f + (g . e) t + (f k^2 / 4 - (g . n) k / 2 + c / 2) t^2,

so what the other mirrors, the seam and the foot leave of an edge are the intervals between roots
of quadratics, for spheres and planes alike, and no topology is assumed.
"""

from math import inf, sqrt

import numpy as np

from tbcad.simulate.parallel import compiled
from tbcad.types import Bools, Floats, Ints

# Samples of each edge, first over all of it, then about the least; a parabola does the rest.
SAMPLES = 9
ROUNDS = 4
# More stretches than this are never left of one edge.
STRETCHES = 16

# Columns of a table of surfaces; rows of an edge (its curvature begins the last); rows of a place.
NORMAL, CURVATURE = 3, 6
START, ALONG, OUT, BEND = 0, 1, 2, 3
PINHOLE, OBJECT, SCALE, RIGHT, DOWN, FORWARD = 0, 1, 2, 3, 4, 5


@compiled
def trace_cell_edges(
    surfaces: Floats,
    pair: Ints,
    offset: Ints,
    face: Ints,
    far: Floats,
    halved: Bools,
    place: Floats,
    screen: Floats,
) -> Floats:
    """What every mirror of one half sees, from the edges of its cell.

    Args:
        surfaces: apex, normal, curvature of the m mirrors, the seam and the foot, (m + 2, 7).
        pair: see tbcad.tolerance.near.Near, as are the next two.
        offset: likewise.
        face: likewise.
        far: how far from its middle each edge may go, mm, (e,).
        halved: mirrors whose seam edge does not limit what they see, (m,).
        place: pinhole, object's middle, scale, and the camera's axes right, down, forward, in the
            frame of the shell, (6, 3).
        screen: for each mirror two axes and the normal of a plane through the object, (m, 3, 3).

    Returns:
        For each mirror (m, 3): the least distance squared of its rays from the object's middle,
        inf without an edge; how often the outline's image passes the first axis of its screen;
        and the area of the cell's picture at unit distance.
    """
    found = np.zeros((len(surfaces) - 2, 3))
    found[:, 0] = inf
    edge, spans, spare = np.empty((4, 3)), np.empty((STRETCHES, 2)), np.empty((STRETCHES, 2))
    for e in range(len(pair)):
        p, q = pair[e, 0], pair[e, 1]
        if surfaces[q, CURVATURE] > surfaces[p, CURVATURE]:
            p, q = q, p
        if not _edge(surfaces[p], surfaces[q], edge):
            continue
        spans[0, 1] = _reach(far[e], edge[BEND, 0])
        spans[0, 0], count = -spans[0, 1], 1
        for k in face[offset[e] : offset[e + 1]]:
            a, b, c = _value(surfaces[k], edge)
            count = _cut(a, b, c, spans, spare, count)
            if count == 0:
                break
        for i, other, sign in ((p, q, 1), (q, p, -1)):
            if i < len(found):
                counted = not (halved[i] and other == len(found))
                for s in range(count):
                    _trace(surfaces[i], edge, spans[s], place, screen[i], found[i], sign, counted)
    return found


@compiled
def _edge(p: Floats, q: Floats, edge: Floats) -> bool:
    """Fill in the edge of two surfaces, p's curvature the greater; False where they do not meet."""
    kp, kq = p[CURVATURE], q[CURVATURE]
    ratio = kq / kp if kp > 0 else 0.0
    ax, ay, az = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    value = q[3] * ax + q[4] * ay + q[5] * az + kq / 2 * (ax * ax + ay * ay + az * az)
    gx = q[3] + kq * ax - ratio * p[3]
    gy = q[4] + kq * ay - ratio * p[4]
    gz = q[5] + kq * az - ratio * p[5]
    size = sqrt(gx * gx + gy * gy + gz * gz)
    if size == 0:
        return False
    gx, gy, gz, away = gx / size, gy / size, gz / size, value / size
    ex, ey, ez = p[4] * gz - p[5] * gy, p[5] * gx - p[3] * gz, p[3] * gy - p[4] * gx
    slope = sqrt(ex * ex + ey * ey + ez * ez)
    if slope == 0:
        return False
    ex, ey, ez = ex / slope, ey / slope, ez / slope
    nx, ny, nz = gy * ez - gz * ey, gz * ex - gx * ez, gx * ey - gy * ex
    height = p[3] * nx + p[4] * ny + p[5] * nz
    if height < 0:
        nx, ny, nz, height = -nx, -ny, -nz, -height
    c = kp / 2 * away * away - away * (p[3] * gx + p[4] * gy + p[5] * gz)
    root = height * height - 2 * kp * c
    if root <= 0:
        return False
    root = sqrt(root)
    s = -2 * c / (height + root)
    edge[START, 0] = p[0] + s * nx - away * gx
    edge[START, 1] = p[1] + s * ny - away * gy
    edge[START, 2] = p[2] + s * nz - away * gz
    edge[ALONG, 0], edge[ALONG, 1], edge[ALONG, 2] = ex, ey, ez
    edge[OUT, 0], edge[OUT, 1], edge[OUT, 2] = nx, ny, nz
    edge[BEND, 0] = kp / root
    return True


@compiled
def _reach(far: float, bend: float) -> float:
    """Parameter of the point at a distance from x0, of the quarter circle if that is nearer."""
    share = far * bend / 2
    return far / sqrt(1 - share * share) if share < sqrt(0.5) else 2 / bend


@compiled
def _value(surface: Floats, edge: Floats) -> tuple[float, float, float]:
    """Coefficients of a surface's value along an edge, times w."""
    f, along, out, k, bend = 0.0, 0.0, 0.0, surface[CURVATURE], edge[BEND, 0]
    for x in range(3):
        away, n = edge[START, x] - surface[x], surface[NORMAL + x]
        f += (n + k / 2 * away) * away
        along += (n + k * away) * edge[ALONG, x]
        out += (n + k * away) * edge[OUT, x]
    return f, along, f * bend * bend / 4 - out * bend / 2 + k / 2


@compiled
def _cut(a: float, b: float, c: float, spans: Floats, spare: Floats, count: int) -> int:
    """Keep of the spans where a + b t + c t^2 is not negative; how many there are then."""
    low, high, between = _roots(a, b, c)
    kept = 0
    for s in range(count):
        first, last = spans[s, 0], spans[s, 1]
        for side in range(1 if between else 2):
            begin, end = max(first, low), min(last, high)
            if not between:
                begin, end = (first, min(last, low)) if side == 0 else (max(first, high), last)
            if begin < end and kept < STRETCHES:
                spare[kept, 0], spare[kept, 1] = begin, end
                kept += 1
    spans[:kept] = spare[:kept]
    return kept


@compiled
def _roots(a: float, b: float, c: float) -> tuple[float, float, bool]:
    """Between what ends, or outside of them, a + b t + c t^2 is not negative."""
    root = b * b - 4 * a * c
    if root <= 0:
        return inf, inf, a + c < 0
    half = -(b + np.copysign(sqrt(root), b)) / 2
    one = a / half
    if c == 0:
        return (one, inf, True) if b > 0 else (-inf, one, True)
    return min(one, half / c), max(one, half / c), c < 0


@compiled
def _trace(
    surface: Floats,
    edge: Floats,
    span: Floats,
    place: Floats,
    screen: Floats,
    found: Floats,
    sign: int,
    counted: bool,
) -> None:
    """Add a stretch of an edge to what is found of one mirror, whose cell lies on a side of it."""
    sample, low, high = np.empty((SAMPLES, 5)), span[0], span[1]
    _sample(surface, edge, low, high, place, screen, sample)
    found[2] += sign * _swept(sample)
    if not counted:
        return
    found[1] += _passes(sample)
    for _ in range(ROUNDS - 1):
        best, step = np.argmin(sample[:, 0]), (high - low) / (SAMPLES - 1)
        low, high = max(low, low + (best - 1) * step), min(high, low + (best + 1) * step)
        _sample(surface, edge, low, high, place, screen, sample)
    found[0] = min(found[0], _lowest(sample[:, 0]))


@compiled
def _sample(
    surface: Floats,
    edge: Floats,
    low: float,
    high: float,
    place: Floats,
    screen: Floats,
    sample: Floats,
) -> None:
    """Fill in rays along an edge: distance squared, place on the screen, place in the picture."""
    k, bend = surface[CURVATURE], edge[BEND, 0]
    for s in range(SAMPLES):
        t = low + (high - low) * s / (SAMPLES - 1)
        w = 1 + bend * bend * t * t / 4
        along, out = t / w, -bend * t * t / 2 / w
        x = edge[0, 0] + along * edge[1, 0] + out * edge[2, 0]
        y = edge[0, 1] + along * edge[1, 1] + out * edge[2, 1]
        z = edge[0, 2] + along * edge[1, 2] + out * edge[2, 2]
        nx = (surface[3] + k * (x - surface[0])) / place[SCALE, 0]
        ny = (surface[4] + k * (y - surface[1])) / place[SCALE, 1]
        nz = (surface[5] + k * (z - surface[2])) / place[SCALE, 2]
        x, y, z = x * place[SCALE, 0], y * place[SCALE, 1], z * place[SCALE, 2]
        rx, ry, rz = x - place[0, 0], y - place[0, 1], z - place[0, 2]
        depth = rx * place[5, 0] + ry * place[5, 1] + rz * place[5, 2]
        sample[s, 3] = (rx * place[3, 0] + ry * place[3, 1] + rz * place[3, 2]) / depth
        sample[s, 4] = (rx * place[4, 0] + ry * place[4, 1] + rz * place[4, 2]) / depth
        # Lengths do not matter but in the end: a mirror image is as long as what it shows.
        turn = 2 * (rx * nx + ry * ny + rz * nz) / (nx * nx + ny * ny + nz * nz)
        dx, dy, dz = rx - turn * nx, ry - turn * ny, rz - turn * nz
        x, y, z = x - place[1, 0], y - place[1, 1], z - place[1, 2]
        cx, cy, cz = y * dz - z * dy, z * dx - x * dz, x * dy - y * dx
        sample[s, 0] = (cx * cx + cy * cy + cz * cz) / (dx * dx + dy * dy + dz * dz)
        far = -(x * screen[2, 0] + y * screen[2, 1] + z * screen[2, 2])
        far /= dx * screen[2, 0] + dy * screen[2, 1] + dz * screen[2, 2]
        x, y, z = x + far * dx, y + far * dy, z + far * dz
        sample[s, 1] = x * screen[0, 0] + y * screen[0, 1] + z * screen[0, 2]
        sample[s, 2] = x * screen[1, 0] + y * screen[1, 1] + z * screen[1, 2]


@compiled
def _passes(sample: Floats) -> int:
    """How often the samples' line on the screen passes the positive half of the first axis."""
    count = 0
    for s in range(SAMPLES - 1):
        y, after = sample[s, 2], sample[s + 1, 2]
        if (y > 0) != (after > 0):
            share = y / (y - after)
            count += sample[s, 1] + share * (sample[s + 1, 1] - sample[s, 1]) > 0
    return count


@compiled
def _swept(sample: Floats) -> float:
    """Area between the picture's middle and the samples' line in it, by Richardson's rule."""
    fine, coarse = 0.0, 0.0
    for s in range(SAMPLES - 1):
        fine += sample[s, 3] * sample[s + 1, 4] - sample[s, 4] * sample[s + 1, 3]
    for s in range(0, SAMPLES - 2, 2):
        coarse += sample[s, 3] * sample[s + 2, 4] - sample[s, 4] * sample[s + 2, 3]
    area: float = (4 * fine - coarse) / 6
    return area


@compiled
def _lowest(values: Floats) -> float:
    """Least of even samples, on the parabola through its neighbours."""
    best = np.argmin(values)
    least: float = values[best]
    if best in (0, SAMPLES - 1):
        return least
    bend = values[best - 1] - 2 * values[best] + values[best + 1]
    slope = values[best + 1] - values[best - 1]
    return max(least - (slope * slope / (8 * bend) if bend > 0 else 0.0), 0.0)

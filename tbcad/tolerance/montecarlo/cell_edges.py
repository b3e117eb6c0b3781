"""Every edge of every cell in closed form, and the rays along it: compiled, one half at a time.

Surfaces p and q meet in a circle (two planes: in a line) in a plane of equal power. From its
point x0 nearest to p's apex, with unit tangent e, unit n away from its middle and curvature k,

    x(t) = x0 + (t e - k t^2 / 2 n) / w,    w = 1 + k^2 t^2 / 4,

t being 2 / k times the tangent of half the angle. With f and g value and gradient at x0 of any
third surface of curvature c (tbcad.optics.surfaces), its value at x(t) times w is the polynomial

    f + (g . e) t + (f k^2 / 4 - (g . n) k / 2 + c / 2) t^2,

so the parts of an edge that the other mirrors, the seam and the foot leave visible are the
intervals between roots of quadratics, for spheres and planes alike, and no topology is assumed.
"""

from math import inf, sqrt

import numpy as np

from tbcad.simulate.parallel import compiled
from tbcad.tolerance.vectors import (
    Vector,
    cross,
    divided,
    dot,
    minus,
    plus_scaled,
    scaled,
    vector,
)
from tbcad.types import Bools, Floats, Ints

# Samples of each edge, first over all of it, then about the minimum; a parabola refines the last.
SAMPLES = 9
ROUNDS = 4
# Maximum number of visible intervals of one edge.
INTERVALS = 16

# Columns of a table of surfaces.
APEX, NORMAL, CURVATURE = 0, 3, 6
# Rows of an edge: point x0, unit vectors e and n; its curvature begins the last row.
START, TANGENT, OUTWARD, BEND = 0, 1, 2, 3
# Rows of a view; axes of a screen.
PINHOLE, OBJECT, SCALE, RIGHT, DOWN, FORWARD = 0, 1, 2, 3, 4, 5
FIRST_AXIS, SECOND_AXIS, FACING = 0, 1, 2
# Columns of a sample: the ray's distance squared from the object's centre, its place on the screen
# and the point's place in the picture.
DISTANCE, SCREEN_X, SCREEN_Y, PICTURE_X, PICTURE_Y = 0, 1, 2, 3, 4
# Columns of the result.
MISS_SQUARED, CROSSINGS, AREA = 0, 1, 2


@compiled
def trace_cell_edges(
    surfaces: Floats,
    pair: Ints,
    offset: Ints,
    face: Ints,
    reach: Floats,
    halved: Bools,
    view: Floats,
    screen: Floats,
) -> Floats:
    """Coverage of every mirror of one half, from the edges of its cell.

    Args:
        surfaces: apex, normal, curvature of the m mirrors, the seam and the foot, (m + 2, 7).
        pair: see tbcad.tolerance.montecarlo.neighbour_pairs, as for the next three.
        offset: likewise.
        face: likewise.
        reach: likewise.
        halved: mirrors whose seam edge does not limit their coverage, (m,).
        view: pinhole, object's centre, scale, and the camera's axes right, down, forward, in the
            frame of the shell, (6, 3).
        screen: for each mirror two axes and the normal of a plane through the object, (m, 3, 3).

    Returns:
        For each mirror (m, 3): the minimum distance squared of its rays from the object's centre,
        inf without an edge; how often the outline's image crosses the first axis of its screen;
        and the area of the cell's picture at unit distance.
    """
    result = np.zeros((len(surfaces) - 2, 3))
    result[:, MISS_SQUARED] = inf
    edge, spans, spare = np.empty((4, 3)), np.empty((INTERVALS, 2)), np.empty((INTERVALS, 2))
    for e in range(len(pair)):
        p, q = pair[e, 0], pair[e, 1]
        if surfaces[q, CURVATURE] > surfaces[p, CURVATURE]:
            p, q = q, p
        if not _edge(surfaces[p], surfaces[q], edge):
            continue
        spans[0, 1] = _end_parameter(reach[e], edge[BEND, 0])
        spans[0, 0], count = -spans[0, 1], 1
        for k in face[offset[e] : offset[e + 1]]:
            a, b, c = _value_along(surfaces[k], edge)
            count = _visible(a, b, c, spans, spare, count)
            if count == 0:
                break
        for i, other, sign in ((p, q, 1), (q, p, -1)):
            if i < len(result):
                limits = not (halved[i] and other == len(result))
                for s in range(count):
                    _trace(surfaces[i], edge, spans[s], view, screen[i], result[i], sign, limits)
    return result


@compiled
def _edge(p: Floats, q: Floats, edge: Floats) -> bool:
    """Fill in the edge of two surfaces, p's curvature the greater; False where they do not meet."""
    kp, kq = p[CURVATURE], q[CURVATURE]
    ratio = kq / kp if kp > 0 else 0.0
    normal, other_normal = vector(p, NORMAL), vector(q, NORMAL)
    apart = minus(vector(p, APEX), vector(q, APEX))
    value = dot(other_normal, apart) + kq / 2 * dot(apart, apart)
    gradient = plus_scaled(plus_scaled(other_normal, kq, apart), -ratio, normal)
    size = sqrt(dot(gradient, gradient))
    if size == 0:
        return False
    gradient, distance = divided(gradient, size), value / size
    tangent = cross(normal, gradient)
    slope = sqrt(dot(tangent, tangent))
    if slope == 0:
        return False
    tangent = divided(tangent, slope)
    outward = cross(gradient, tangent)
    height = dot(normal, outward)
    if height < 0:
        outward, height = scaled(-1.0, outward), -height
    c = kp / 2 * distance * distance - distance * dot(normal, gradient)
    root = height * height - 2 * kp * c
    if root <= 0:
        return False
    root = sqrt(root)
    start = plus_scaled(vector(p, APEX), -2 * c / (height + root), outward)
    edge[START] = plus_scaled(start, -distance, gradient)
    edge[TANGENT] = tangent
    edge[OUTWARD] = outward
    edge[BEND, 0] = kp / root
    return True


@compiled
def _end_parameter(reach: float, bend: float) -> float:
    """Parameter of the point at a distance from x0, of the quarter circle if that is nearer."""
    share = reach * bend / 2
    return reach / sqrt(1 - share * share) if share < sqrt(0.5) else 2 / bend


@compiled
def _value_along(surface: Floats, edge: Floats) -> Vector:
    """Coefficients of a surface's value along an edge, times w."""
    k, bend = surface[CURVATURE], edge[BEND, 0]
    normal, away = vector(surface, NORMAL), minus(vector(edge[START]), vector(surface, APEX))
    value = dot(plus_scaled(normal, k / 2, away), away)
    gradient = plus_scaled(normal, k, away)
    along, out = dot(gradient, vector(edge[TANGENT])), dot(gradient, vector(edge[OUTWARD]))
    return value, along, value * bend * bend / 4 - out * bend / 2 + k / 2


@compiled
def _visible(a: float, b: float, c: float, spans: Floats, spare: Floats, count: int) -> int:
    """Keep the parts of the spans where a + b t + c t^2 is not negative; return their number."""
    low, high, between = _roots(a, b, c)
    kept = 0
    for s in range(count):
        first, last = spans[s, 0], spans[s, 1]
        for side in range(1 if between else 2):
            begin, end = max(first, low), min(last, high)
            if not between:
                begin, end = (first, min(last, low)) if side == 0 else (max(first, high), last)
            if begin < end and kept < INTERVALS:
                spare[kept, 0], spare[kept, 1] = begin, end
                kept += 1
    spans[:kept] = spare[:kept]
    return kept


@compiled
def _roots(a: float, b: float, c: float) -> tuple[float, float, bool]:
    """Ends of the interval where a + b t + c t^2 is not negative, or else of where it is."""
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
    view: Floats,
    screen: Floats,
    result: Floats,
    sign: int,
    limits: bool,
) -> None:
    """Add a part of an edge to the result of the mirror on one side of it."""
    sample, low, high = np.empty((SAMPLES, 5)), span[0], span[1]
    _sample(surface, edge, low, high, view, screen, sample)
    result[AREA] += sign * _swept_area(sample)
    if not limits:
        return
    for s in range(SAMPLES - 1):
        result[CROSSINGS] += crosses_half_axis(
            sample[s, SCREEN_X : SCREEN_Y + 1], sample[s + 1, SCREEN_X : SCREEN_Y + 1]
        )
    for _ in range(ROUNDS - 1):
        best, step = np.argmin(sample[:, DISTANCE]), (high - low) / (SAMPLES - 1)
        low, high = max(low, low + (best - 1) * step), min(high, low + (best + 1) * step)
        _sample(surface, edge, low, high, view, screen, sample)
    result[MISS_SQUARED] = min(result[MISS_SQUARED], _parabola_minimum(sample[:, DISTANCE]))


@compiled
def _sample(
    surface: Floats,
    edge: Floats,
    low: float,
    high: float,
    view: Floats,
    screen: Floats,
    sample: Floats,
) -> None:
    """Fill in the rays through evenly spaced points of an edge."""
    bend, scale = edge[BEND, 0], vector(view[SCALE])
    for s in range(SAMPLES):
        t = low + (high - low) * s / (SAMPLES - 1)
        w = 1 + bend * bend * t * t / 4
        chord = plus_scaled(vector(edge[START]), t / w, vector(edge[TANGENT]))
        point = plus_scaled(chord, -bend * t * t / 2 / w, vector(edge[OUTWARD]))
        from_apex = minus(point, vector(surface, APEX))
        gradient = plus_scaled(vector(surface, NORMAL), surface[CURVATURE], from_apex)
        normal = (gradient[0] / scale[0], gradient[1] / scale[1], gradient[2] / scale[2])
        point = (point[0] * scale[0], point[1] * scale[1], point[2] * scale[2])
        ray = minus(point, vector(view[PINHOLE]))
        depth = dot(ray, vector(view[FORWARD]))
        sample[s, PICTURE_X] = dot(ray, vector(view[RIGHT])) / depth
        sample[s, PICTURE_Y] = dot(ray, vector(view[DOWN])) / depth
        # Neither the normal nor the ray has to be of unit length.
        out = plus_scaled(ray, -(2 * dot(ray, normal) / dot(normal, normal)), normal)
        from_object = minus(point, vector(view[OBJECT]))
        moment = cross(from_object, out)
        sample[s, DISTANCE] = dot(moment, moment) / dot(out, out)
        facing = vector(screen[FACING])
        image = plus_scaled(from_object, -dot(from_object, facing) / dot(out, facing), out)
        sample[s, SCREEN_X] = dot(image, vector(screen[FIRST_AXIS]))
        sample[s, SCREEN_Y] = dot(image, vector(screen[SECOND_AXIS]))


@compiled
def crosses_half_axis(a: Floats, b: Floats) -> bool:
    """Whether the line from a to b (2,) crosses the positive half of the first axis."""
    if (a[1] > 0) == (b[1] > 0):
        return False
    return bool(a[0] + a[1] / (a[1] - b[1]) * (b[0] - a[0]) > 0)


@compiled
def _swept_area(sample: Floats) -> float:
    """Area between the picture's centre and the samples' line in it, by Richardson's rule."""
    fine, coarse = 0.0, 0.0
    for s in range(SAMPLES - 1):
        fine += _parallelogram(sample[s], sample[s + 1])
    for s in range(0, SAMPLES - 2, 2):
        coarse += _parallelogram(sample[s], sample[s + 2])
    return (4 * fine - coarse) / 6


@compiled
def _parallelogram(a: Floats, b: Floats) -> float:
    area: float = a[PICTURE_X] * b[PICTURE_Y] - a[PICTURE_Y] * b[PICTURE_X]
    return area


@compiled
def _parabola_minimum(values: Floats) -> float:
    """Minimum of even samples, on the parabola through its neighbours."""
    best = np.argmin(values)
    minimum: float = values[best]
    if best in (0, SAMPLES - 1):
        return minimum
    bend = values[best - 1] - 2 * values[best] + values[best + 1]
    slope = values[best + 1] - values[best - 1]
    return max(minimum - (slope * slope / (8 * bend) if bend > 0 else 0.0), 0.0)

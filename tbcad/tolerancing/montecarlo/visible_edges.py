"""Every edge of every cell in closed form, and which parts of it can be seen: compiled.

Surfaces p and q meet in a circle (two planes: in a line) in a plane of equal power. From its
point x0 nearest to p's apex, with unit tangent e, unit n away from its middle and curvature k,

    x(t) = x0 + (t e - k t^2 / 2 n) / w,    w = 1 + k^2 t^2 / 4,

t being 2 / k times the tangent of half the angle. With f and g value and gradient at x0 of any
third surface of curvature c (core.optics.surfaces), its value at x(t) times w is the polynomial

    f + (g . e) t + (f k^2 / 4 - (g . n) k / 2 + c / 2) t^2,

so the parts of an edge that the other mirrors, the seam and the foot leave visible are the
intervals between roots of quadratics, for spheres and planes alike, and no topology is assumed.
"""

from math import inf, sqrt

import numpy as np

from tbcad.common.compiled import compiled_part
from tbcad.core.geometry.loop_vectors import (
    Vector,
    cross,
    divided,
    dot,
    minus,
    plus_scaled,
    scaled,
    vector,
)
from tbcad.types import Floats, Ints

INTERVALS = 16  # maximum number of visible intervals of one edge
CERTAIN = 1e-9  # share of a value's largest term, beyond which rounding cannot change its sign

APEX, NORMAL, CURVATURE = 0, 3, 6  # columns of a table of surfaces
# Columns of an edge: point x0, unit vectors e and n, curvature.
START, TANGENT, OUTWARD, BEND, EDGE_COLUMNS = 0, 3, 6, 9, 10


@compiled_part
def visible_spans(
    surfaces: Floats, faces: Ints, edge: Floats, reach: float, spans: Floats, spare: Floats
) -> int:
    """Fill in the parts of an edge (`find_edge`) that faces leave visible, and return their number.

    Surfaces are apex, normal, curvature of all faces, (f, 7); parts are parameters of their begin
    and end, (INTERVALS, 2), spare of the same shape; the reach is from x0, mm.
    """
    spans[0, 1] = _end_parameter(reach, edge[BEND])
    spans[0, 0], count = -spans[0, 1], 1
    for face in faces:
        a, b, c = _value_along(surfaces[face], edge)
        if count == 1 and _surely_visible(a, b, c, spans[0, 0], spans[0, 1]):
            continue
        count = _cut(a, b, c, spans, spare, count)
        if count == 0:
            break
    return count


@compiled_part
def _surely_visible(a: float, b: float, c: float, first: float, last: float) -> bool:
    """Whether a + b t + c t^2 is positive from the first to the last t, beyond any rounding."""
    if not (_surely_positive(a, b * first, c * first * first)):
        return False
    if not (_surely_positive(a, b * last, c * last * last)):
        return False
    return c <= 0 or (b + 2 * c * first) * (b + 2 * c * last) > 0


@compiled_part
def _surely_positive(a: float, b: float, c: float) -> bool:
    return a + b + c > CERTAIN * (abs(a) + abs(b) + abs(c))


@compiled_part
def find_edge(p: Floats, q: Floats, edge: Floats) -> bool:
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
    _put(edge, START, plus_scaled(start, -distance, gradient))
    _put(edge, TANGENT, tangent)
    _put(edge, OUTWARD, outward)
    edge[BEND] = kp / root
    return True


@compiled_part
def _put(edge: Floats, first: int, value: Vector) -> None:
    edge[first], edge[first + 1], edge[first + 2] = value


@compiled_part
def _end_parameter(reach: float, bend: float) -> float:
    """Parameter of the point at a distance from x0, of the quarter circle if that is nearer."""
    share = reach * bend / 2
    return reach / sqrt(1 - share * share) if share < sqrt(0.5) else 2 / bend


@compiled_part
def _value_along(surface: Floats, edge: Floats) -> Vector:
    """Coefficients of a surface's value along an edge, times w."""
    k, bend = surface[CURVATURE], edge[BEND]
    normal, offset = vector(surface, NORMAL), minus(vector(edge, START), vector(surface, APEX))
    value = dot(plus_scaled(normal, k / 2, offset), offset)
    gradient = plus_scaled(normal, k, offset)
    along, out = dot(gradient, vector(edge, TANGENT)), dot(gradient, vector(edge, OUTWARD))
    return value, along, value * bend * bend / 4 - out * bend / 2 + k / 2


@compiled_part
def _cut(a: float, b: float, c: float, spans: Floats, spare: Floats, count: int) -> int:
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
    for s in range(kept):
        spans[s, 0], spans[s, 1] = spare[s, 0], spare[s, 1]
    return kept


@compiled_part
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

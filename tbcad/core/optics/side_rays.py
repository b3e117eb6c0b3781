"""How far rays through the sides of cells miss the origin after a mirror or a ball: compiled.

The same as with the arrays of `tbcad.core.optics.reflection`, without an array for each step.
"""

from math import inf, sqrt

import numpy as np

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.core.geometry.loop_vectors import (
    Vector,
    cross,
    dot,
    minus,
    plus_scaled,
    reflect,
    scaled,
    unit,
    vector,
)
from tbcad.types import Floats, Ints

APEX, NORMAL, CURVATURE = 0, 3, 6  # columns of a mirror
# Columns of a ball in a window: its centre, its radius, and the axis that the window is turned
# about, with cosine and sine of the angle.
CENTRE, RADIUS, AXIS, COSINE, SINE = 0, 3, 4, 7, 8


@compiled_loop
def misses_of_mirrors(
    points: Floats, weight: Floats, mirror: Ints, mirrors: Floats, pinhole: Floats, t: Floats
) -> Floats:
    """Distances from the origin of rays from a pinhole after mirrors, mm, (e, s).

    Sides of mirrors have control points (e, 3, 3) and weights (e,), see
    tbcad.core.optics.cells.Arcs, and points at parameters t in [0, 1], (e, s); mirrors are apex,
    normal and curvature, (m, 7).
    """
    result, start = np.empty(t.shape), vector(pinhole)
    for e in range(len(t)):
        row = mirrors[mirror[e]]
        apex, normal = vector(row, APEX), vector(row, NORMAL)
        for s in range(t.shape[1]):
            point = _on_side(points[e], weight[e], t[e, s])
            at_point = plus_scaled(normal, row[CURVATURE], minus(point, apex))
            moment = cross(point, reflect(unit(minus(point, start)), at_point))
            result[e, s] = sqrt(dot(moment, moment))
    return result


@compiled_loop
def misses_of_balls(
    points: Floats,
    weight: Floats,
    mirror: Ints,
    balls: Floats,
    pinholes: Floats,
    t: Floats,
) -> Floats:
    """Distances from the origin of rays after balls, through sides that are turned, mm, (e, s).

    Infinite where the ray misses the ball, or leaves it away from the origin. Sides as of
    `misses_of_mirrors`; balls (m, 9) in the columns above, for each mirror one; pinholes of the
    sides, and of the camera that sees the balls, mm, (2, 3).
    """
    result, place, camera = np.empty(t.shape), vector(pinholes[0]), vector(pinholes[1])
    for e in range(len(t)):
        ball = balls[mirror[e]]
        for s in range(t.shape[1]):
            ray = unit(minus(_on_side(points[e], weight[e], t[e, s]), place))
            result[e, s] = _miss_of_ball(_turned(ray, ball), ball, camera)
    return result


@compiled_part
def _on_side(points: Floats, weight: float, t: float) -> Vector:
    """Point of a side at a parameter."""
    first, middle, last = (1 - t) * (1 - t), 2 * t * (1 - t) * weight, t * t
    total = first + middle + last
    point = scaled(first / total, vector(points[0]))
    point = plus_scaled(point, middle / total, vector(points[1]))
    return plus_scaled(point, last / total, vector(points[2]))


@compiled_part
def _turned(ray: Vector, ball: Floats) -> Vector:
    """A ray turned about the axis of a ball's window (Rodrigues' formula)."""
    axis, cosine = vector(ball, AXIS), ball[COSINE]
    turned = plus_scaled(scaled(cosine, ray), ball[SINE], cross(axis, ray))
    return plus_scaled(turned, (1 - cosine) * dot(axis, ray), axis)


@compiled_part
def _miss_of_ball(ray: Vector, ball: Floats, camera: Vector) -> float:
    """Distance from the origin of a ray of unit length from a camera after a ball."""
    centre, radius = vector(ball, CENTRE), ball[RADIUS]
    to_centre = minus(centre, camera)
    along = dot(ray, to_centre)
    inside = radius * radius - dot(to_centre, to_centre) + along * along
    if inside < 0:
        return inf
    point = plus_scaled(camera, along - sqrt(inside), ray)
    direction = reflect(ray, scaled(1 / radius, minus(point, centre)))
    if dot(direction, point) > 0:
        return inf
    moment = cross(point, direction)
    return sqrt(dot(moment, moment))

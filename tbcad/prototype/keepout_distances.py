"""Distances of points to the light in use and to what the base sweeps: compiled.

A point is given by z, r and azimuth about the axis. What turns between two azimuths is nearest to
it at the azimuth nearest to its own. Most bodies are passed over: what is quick to compute shows
that they are not nearer than what has been found.
"""

from math import cos, inf, pi, sin, sqrt

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.loop_vectors import Vector
from tbcad.core.geometry.round_cones import RoundCones
from tbcad.core.geometry.vectors import norm
from tbcad.types import Floats

# Columns of a cone: centre and radius where it starts, unit vector and length from there to its
# other centre, by how much its radius grows, and how far the foot of a point that is a millimetre
# from its axis is pushed along it.
START, START_RADIUS, AXIS, LENGTH, GROWTH, LEAN, CONE_COLUMNS = 0, 2, 3, 5, 6, 7, 8
# Columns of a range of azimuths, radians.
CENTRE, HALF = 0, 1


def azimuth_ranges(azimuths: Floats) -> Floats:
    """Middle and half width of ranges from the smallest to the largest azimuth (m, 2), (m, 2)."""
    return np.column_stack([azimuths.mean(axis=1), np.diff(azimuths, axis=1)[:, 0] / 2])


def cone_table(cones: RoundCones) -> Floats:
    """Round cones as the loops take them, (m, CONE_COLUMNS)."""
    axis, growth = cones.end - cones.start, cones.end_radius - cones.start_radius
    length = norm(axis)
    shrink = -growth / length
    lean = shrink / np.sqrt(1 - shrink**2)
    columns = (cones.start, cones.start_radius, axis / length[:, None], length, growth, lean)
    return np.column_stack(columns)


@compiled_loop
def distances_to_cones(points: Floats, cones: Floats, ranges: Floats) -> Floats:
    """Distance of points (n, 3) to the nearest of round cones, mm, (n,); negative inside.

    Args:
        points: z, r, azimuth.
        cones: see `cone_table`, (m, CONE_COLUMNS).
        ranges: in which each cone turns, see `azimuth_ranges`, (m, 2).
    """
    result, near = np.full(len(points), inf), 0
    for i in range(len(points)):
        z, r, azimuth = points[i]
        nearest = _to_cone(_from_range(z, r, azimuth, ranges[near]), cones[near])
        for k in range(len(cones)):
            # The cone's centres are on one side of the axis: nothing is nearer than in its plane.
            if _to_cone((z, r, 0.0), cones[k]) < nearest:
                distance = _to_cone(_from_range(z, r, azimuth, ranges[k]), cones[k])
                if distance < nearest:
                    nearest, near = distance, k
        result[i] = nearest
    return result


@compiled_loop
def distances_to_balls(points: Floats, centre: Floats, radius: Floats, ranges: Floats) -> Floats:
    """Distance of points (n, 3) to the nearest of balls, mm, (n,); negative inside.

    Args:
        points: z, r, azimuth.
        centre: z and r of the balls, mm, (k, 2).
        radius: of the balls, mm, (k,).
        ranges: in which each ball turns, see `azimuth_ranges`, (k, 2).
    """
    result = np.full(len(points), inf)
    for i in range(len(points)):
        for k in range(len(centre)):
            place = _from_range(points[i, 0], points[i, 1], points[i, 2], ranges[k])
            z, out = place[0] - centre[k, 0], place[1] - centre[k, 1]
            distance = sqrt(z * z + out * out + place[2] * place[2]) - radius[k]
            result[i] = min(result[i], distance)
    return result


@compiled_loop
def lower_to_section(points: Floats, polygon: Floats, turned: Floats, distances: Floats) -> None:
    """Lower the distances (n,) of points (n, 3) to those to a section that turns, 0 inside.

    Args:
        points: z, r, azimuth.
        polygon: z and r of the section's corners, mm, (p, 2).
        turned: range in which it turns, see `azimuth_ranges`, (2,).
        distances: of the points from other bodies, mm.
    """
    low_z, high_z = polygon[:, 0].min(), polygon[:, 0].max()
    low_r, high_r = polygon[:, 1].min(), polygon[:, 1].max()
    for i in range(len(points)):
        z, out, away = _from_range(points[i, 0], points[i, 1], points[i, 2], turned)
        beyond_z, beyond_r = max(low_z - z, z - high_z, 0.0), max(low_r - out, out - high_r, 0.0)
        box = sqrt(beyond_z * beyond_z + beyond_r * beyond_r + away * away)
        if box < distances[i]:
            square = _square_to_polygon(z, out, polygon)
            distances[i] = min(distances[i], sqrt(square + away * away))


@compiled_loop
def _from_range(z: float, r: float, azimuth: float, turned: Floats) -> Vector:
    """A point as seen from the nearest half-plane of a range of azimuths.

    Along the axis, out in that half-plane, and away from it.
    """
    from_middle = abs((azimuth - turned[CENTRE] + pi) % (2 * pi) - pi)
    beyond = from_middle - turned[HALF]
    if beyond <= 0:
        return z, r, 0.0
    return z, r * cos(beyond), r * sin(beyond)


@compiled_loop
def _to_cone(point: Vector, cone: Floats) -> float:
    """Signed distance of a point to a round cone, exact outside.

    In the plane through both centres and the point the hull is a trapezium between two circles.
    """
    z, out, away = point[0] - cone[START], point[1] - cone[START + 1], point[2]
    along = z * cone[AXIS] + out * cone[AXIS + 1]
    across = sqrt(max(z * z + out * out + away * away - along * along, 0.0))
    # Foot of the perpendicular on the common tangent, as a share of the way between the circles.
    foot = min(max((along - across * cone[LEAN]) / cone[LENGTH], 0.0), 1.0)
    rest = along - foot * cone[LENGTH]
    distance: float = sqrt(rest * rest + across * across) - cone[START_RADIUS] - foot * cone[GROWTH]
    return distance


@compiled_loop
def _square_to_polygon(x: float, y: float, polygon: Floats) -> float:
    """Square of the distance of a point to a polygon (p, 2), 0 inside."""
    square, inside, last = inf, False, len(polygon) - 1
    for k in range(len(polygon)):
        corner_x, corner_y = polygon[last]
        side_x, side_y = polygon[k, 0] - corner_x, polygon[k, 1] - corner_y
        from_x, from_y = x - corner_x, y - corner_y
        share = (from_x * side_x + from_y * side_y) / (side_x * side_x + side_y * side_y)
        share = min(max(share, 0.0), 1.0)
        rest_x, rest_y = from_x - share * side_x, from_y - share * side_y
        square = min(square, rest_x * rest_x + rest_y * rest_y)
        if (corner_y > y) != (polygon[k, 1] > y) and from_x < from_y / side_y * side_x:
            inside = not inside
        last = k
    return 0.0 if inside else square

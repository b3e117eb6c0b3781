"""The keep-out volume of all static parts: the light in use, and what the base sweeps.

Distances to both are in closed form. A round cone of light, a ball or a cross-section that turns
about the axis between two azimuths is nearest to a point at the azimuth nearest to the point's.
"""

from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass
from math import cos, inf, pi, sin, sqrt

import numpy as np
from scipy.spatial import ConvexHull

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.core.geometry.loop_vectors import Vector
from tbcad.core.geometry.primitives import Primitive, enclosing_triangles, rectangle
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.round_cones import RoundCones
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.ball_light import light_hulls
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import FACETS_OUT_MM, BaseLayout
from tbcad.prototype.base.profile import offset, shortened
from tbcad.types import Floats

# Smallest distances are exact to this, or to this share of them, and never too large: where two
# faces are parallel, a closer search would not end.
EXACT_MM = 0.05
EXACT = 0.1
CIRCLE_SIDES = 48
MAX_SPLITS = 60
# Columns of a cone: centre and radius where it starts, unit vector and length from there to its
# other centre, by how much its radius grows, and how far the foot of a point that is a millimetre
# from its axis is pushed along it.
START, START_RADIUS, AXIS, LENGTH, GROWTH, LEAN, CONE_COLUMNS = 0, 2, 3, 5, 6, 7, 8
# Columns of a range of azimuths, radians.
CENTRE, HALF = 0, 1


@dataclass(frozen=True)
class SweptSection:
    """A cross-section that is turned about the axis."""

    polygon: Floats  # (z along the axis, r), mm, (p, 2)
    low: float  # smallest azimuth it reaches, radians
    high: float  # largest one


@dataclass(frozen=True)
class KeepOut:
    """The volume that static parts must keep out of; azimuths in radians."""

    frame: Floats  # rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3)
    capture: float  # radius of the capture sphere, mm
    cones: RoundCones  # all light, first capture sphere to ball, then ball to pinhole, (2 k,)
    used: Floats  # smallest and largest azimuth at which each cone is in use, (2 k, 2)
    centre: Floats  # of the balls, (z, r), mm, (k, 2)
    radius: Floats  # of the balls, mm, (k,)
    swung: Floats  # smallest and largest azimuth of each ball, (k, 2)
    # wall, ribs and bosses over the whole swing, and the hub all round
    sections: tuple[SweptSection, ...]
    # the same while the base is at its stops or between them; None: this is that
    at_stops: "KeepOut | None" = None

    def to_light(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light in use, mm, (n,); negative in it."""
        cones, ranges = cone_table(self.cones), azimuth_ranges(self.used)
        return distances_to_cones(_cylindrical(self.frame, points), cones, ranges)

    def to_light_outside_sphere(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light outside the capture sphere, mm, (n,).

        What is inside the sphere is part of the scene. The distance is never too large; negative
        in the light.
        """
        return np.maximum(self.to_light(points), self.capture - norm(points))

    def to_swept(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to what the base sweeps over its swing, mm, (n,)."""
        local, swung = _cylindrical(self.frame, points), azimuth_ranges(self.swung)
        nearest = distances_to_balls(local, self.centre, self.radius, swung)
        for section in self.sections:
            (turned,) = azimuth_ranges(np.array([[section.low, section.high]]))
            lower_to_section(local, section.polygon, turned, nearest)
        return nearest


def keep_out_volume(
    prototype: PrototypeLayout, base: BaseLayout, capture: float, approach: float
) -> KeepOut:
    """The keep-out volume of a prototype, by the radius of the capture sphere, mm.

    The base starts below its first stop by the approach, radians.
    """
    stops, azimuth = prototype.stops, prototype.placement.azimuth
    angle = stops.angle[stops.stop]
    of_ball = [angle[prototype.fit.ball == k] for k in range(len(prototype))]
    used = np.array([(angles.min(), angles.max()) for angles in of_ball]) + azimuth[:, None]
    to_object, to_camera = light_hulls(prototype.balls.outline, base.light.pinhole, capture)
    swing = np.array([min(float(angle.min()), 0.0) - approach, max(float(angle.max()), 0.0)])
    return KeepOut(
        at_stops=keep_out_volume(prototype, base, capture, 0.0) if approach else None,
        frame=base.frame,
        capture=capture,
        cones=RoundCones(
            *map(np.concatenate, zip(astuple(to_object), astuple(to_camera), strict=True))
        ),
        used=np.concatenate([used, used]),
        centre=prototype.balls.body_centre[:, :2],
        radius=prototype.balls.body_radius,
        swung=azimuth[:, None] + swing,
        sections=_sections(base, swing),
    )


def min_distance(
    distance: Callable[[Floats], Floats], bodies: Iterable[Primitive], enough: float = 0.0
) -> float:
    """Smallest distance of the surfaces of bodies by a function of points (n, 3), mm.

    Never too large, and too small by at most EXACT_MM or a share EXACT: a distance changes by no
    more than the point moves, so each triangle bounds it, and those that may hold the smallest are
    split. A distance below `enough` ends the search: a body that collides is refused anyway.
    """
    triangles = np.concatenate([enclosing_triangles(body) for body in bodies])
    best = np.inf
    for _ in range(MAX_SPLITS):
        centre = triangles.mean(axis=1)
        reach, at_centre = norm(triangles - centre[:, None]).max(axis=1), distance(centre)
        best = min(best, float(at_centre.min()))
        triangles = _split(triangles[at_centre - reach < best - _uncertainty(best)])
        if not len(triangles) or best < enough + EXACT_MM:
            break
    return best - _uncertainty(best)


def _uncertainty(distance: float) -> float:
    return max(EXACT_MM, EXACT * distance)


def _split(triangles: Floats) -> Floats:
    """Each triangle as four, by the middles of its sides."""
    middle = (triangles + np.roll(triangles, -1, axis=1)) / 2
    tips = np.stack([triangles, middle, np.roll(middle, 1, axis=1)], axis=2).reshape(-1, 3, 3)
    return np.concatenate([tips, middle])


def _sections(base: BaseLayout, swing: Floats) -> tuple[SweptSection, ...]:
    low, high = base.sector[0] + float(swing[0]), base.sector[1] + float(swing[1])
    # The wall with the edges of its facets, which are off its cones.
    line = shortened(base.inner, -FACETS_OUT_MM)
    wall = np.vstack([line, offset(line, base.spec.thickness_mm + FACETS_OUT_MM)[::-1]])
    ribs = np.vstack([base.outline, base.inner[::-1]])
    bosses = [_boss(base, k) for k in range(len(base.seats))]
    hub = base.hub
    discs = [rectangle((hub.back, 0.0), (hub.front, hub.disc))]
    discs += [rectangle((hub.face, 0.0), (hub.back, hub.boss))] if hub.boss else []
    turning = [SweptSection(polygon, low, high) for polygon in (wall, ribs, *base.rings, *bosses)]
    return (*turning, *(SweptSection(polygon, -np.pi, np.pi) for polygon in discs))


def _boss(base: BaseLayout, k: int) -> Floats:
    """Hull of a boss and its number in (z, r), (p, 2)."""
    seats = base.seats
    radius = float(seats.boss[k]) / np.cos(np.pi / CIRCLE_SIDES)
    circle = radius * unit_circle(even_angles(CIRCLE_SIDES)) @ seats.axes[k, :2]
    lengths = (seats.front[k], seats.back[k] + base.spec.relief_mm)
    ends = [seats.centre[k] + length * seats.axes[k, 2] + circle for length in lengths]
    section = _cylindrical(base.frame, np.vstack(ends))[:, :2]
    return np.asarray(section[ConvexHull(section).vertices])


def _cylindrical(frame: Floats, points: Floats) -> Floats:
    """Points (n, 3) as z, r and azimuth about the first row of a frame, (n, 3)."""
    z, out, third = (points @ frame.T).T
    return np.stack([z, np.hypot(out, third), np.arctan2(third, out)], axis=1)


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
    """Distance of points (n, 3) to the nearest of round cones (m, ...), mm, (n,); negative inside.

    Each cone turns in a range (m, 2).
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

    Centres are z and r, mm, (k, 2); each ball turns in a range (k, 2).
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

    The polygon (p, 2) has z and r of the section's corners, mm; it turns in a range (2,).
    """
    low_z, low_r, high_z, high_r = inf, inf, -inf, -inf
    for k in range(len(polygon)):
        low_z, high_z = min(low_z, polygon[k, 0]), max(high_z, polygon[k, 0])
        low_r, high_r = min(low_r, polygon[k, 1]), max(high_r, polygon[k, 1])
    for i in range(len(points)):
        z, out, away = _from_range(points[i, 0], points[i, 1], points[i, 2], turned)
        beyond_z, beyond_r = max(low_z - z, z - high_z, 0.0), max(low_r - out, out - high_r, 0.0)
        box = sqrt(beyond_z * beyond_z + beyond_r * beyond_r + away * away)
        if box < distances[i]:
            square = _square_to_polygon(z, out, polygon)
            distances[i] = min(distances[i], sqrt(square + away * away))


@compiled_part
def _from_range(z: float, r: float, azimuth: float, turned: Floats) -> Vector:
    """A point as seen from the nearest half-plane of a range of azimuths.

    Along the axis, out in that half-plane, and away from it.
    """
    from_middle = abs((azimuth - turned[CENTRE] + pi) % (2 * pi) - pi)
    beyond = from_middle - turned[HALF]
    if beyond <= 0:
        return z, r, 0.0
    return z, r * cos(beyond), r * sin(beyond)


@compiled_part
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


@compiled_part
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

"""The keep-out volume of all static parts: the light in use, and what the base sweeps.

Distances to both are in closed form. A round cone of light, a ball or a cross-section that turns
about the axis between two azimuths is nearest to a point at the azimuth nearest to the point's.
"""

from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass

import numpy as np
from scipy.spatial import ConvexHull

from tbcad.geometry.primitives import Primitive, enclosing_triangles, rectangle
from tbcad.geometry.rotations import even_angles, unit_circle
from tbcad.geometry.round_cones import RoundCones
from tbcad.geometry.vectors import norm
from tbcad.optics.ball_light import light_hulls
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
CHUNK = 1024


@dataclass(frozen=True)
class SweptSection:
    """A cross-section that is turned about the axis.

    Attributes:
        polygon: (z along the axis, r), mm, (p, 2).
        low: smallest azimuth it reaches, radians.
        high: largest one.
    """

    polygon: Floats
    low: float
    high: float

    @property
    def azimuths(self) -> tuple[float, float]:
        """The range that it reaches."""
        return self.low, self.high


@dataclass(frozen=True)
class KeepOut:
    """The volume that static parts must keep out of; azimuths in radians.

    Attributes:
        frame: rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3).
        capture: radius of the capture sphere, mm.
        cones: all light, first capture sphere to ball, then ball to pinhole, (2 k,).
        used: smallest and largest azimuth at which each cone is in use, (2 k, 2).
        centre: of the balls, (z, r), mm, (k, 2).
        radius: of the balls, mm, (k,).
        swung: smallest and largest azimuth of each ball, (k, 2).
        sections: wall, ribs and bosses over the whole swing, and the hub all round.
        at_stops: the same while the base is at its stops or between them; None: this is that.
    """

    frame: Floats
    capture: float
    cones: RoundCones
    used: Floats
    centre: Floats
    radius: Floats
    swung: Floats
    sections: tuple[SweptSection, ...]
    at_stops: "KeepOut | None" = None

    def to_light(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light in use, mm, (n,); negative in it."""
        local = _cylindrical(self.frame, points)
        # Few points at a time: the arrays of all points and cones would not stay in the cache.
        parts = [local[k : k + CHUNK] for k in range(0, max(len(local), 1), CHUNK)]
        return np.concatenate([self._to_cones(part) for part in parts])

    def _to_cones(self, local: Floats) -> Floats:
        """Distance of points (n, 3) about the axis to the nearest cone in use, mm, (n,)."""
        return np.asarray(_to_cones(_from_range(local, self.used), self.cones).min(axis=1))

    def to_light_outside_sphere(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light outside the capture sphere, mm, (n,).

        What is inside the sphere is part of the scene. The distance is never too large; negative
        in the light.
        """
        return np.maximum(self.to_light(points), self.capture - norm(points))

    def to_swept(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to what the base sweeps over its swing, mm, (n,)."""
        local = _cylindrical(self.frame, points)
        balls = np.column_stack([self.centre, 0 * self.radius])
        from_balls = norm(_from_range(local, self.swung) - balls) - self.radius
        nearest: Floats = from_balls.min(axis=1)
        places = {
            azimuths: _from_range(local, np.array([azimuths]))[:, 0]
            for azimuths in dict.fromkeys(section.azimuths for section in self.sections)
        }
        for section in self.sections:
            place = places[section.azimuths]
            # The box round a section is cheap to measure, and mostly farther than the nearest.
            near = np.hypot(_to_box(place[:, :2], section.polygon), place[:, 2]) < nearest
            across = _to_polygon(place[near, :2], section.polygon)
            nearest[near] = np.minimum(nearest[near], np.hypot(across, place[near, 2]))
        return nearest


def keep_out_volume(
    prototype: PrototypeLayout, base: BaseLayout, capture: float, approach: float
) -> KeepOut:
    """The keep-out volume of a prototype.

    Args:
        prototype: balls, their places and stops.
        base: that carries them.
        capture: radius of the capture sphere, mm.
        approach: angle by which the base starts below its first stop, radians.
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
    wall = _wall(base)
    ribs = np.vstack([base.outline, base.inner[::-1]])
    bosses = [_boss(base, k) for k in range(len(base.seats))]
    hub = base.hub
    discs = [rectangle((hub.back, 0.0), (hub.front, hub.disc))]
    discs += [rectangle((hub.face, 0.0), (hub.back, hub.boss))] if hub.boss else []
    turning = [SweptSection(polygon, low, high) for polygon in (wall, ribs, *base.rings, *bosses)]
    return (*turning, *(SweptSection(polygon, -np.pi, np.pi) for polygon in discs))


def _wall(base: BaseLayout) -> Floats:
    """Section of the wall with the edges of its facets, which are off its cones, (z, r), (p, 2)."""
    line = shortened(base.inner, -FACETS_OUT_MM)
    return np.vstack([line, offset(line, base.spec.thickness_mm + FACETS_OUT_MM)[::-1]])


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


def _from_range(local: Floats, azimuths: Floats) -> Floats:
    """Points (n, m, 3) as seen from the nearest half-plane of each range of azimuths (m, 2).

    Along the axis, out in that half-plane, and away from it.
    """
    middle, half = azimuths.mean(axis=1), np.diff(azimuths, axis=1)[:, 0] / 2
    from_middle = np.abs((local[:, 2, None] - middle + np.pi) % (2 * np.pi) - np.pi)
    beyond = np.maximum(from_middle - half, 0)
    r = local[:, 1, None]
    z = np.broadcast_to(local[:, 0, None], beyond.shape)
    return np.stack([z, r * np.cos(beyond), r * np.sin(beyond)], axis=-1)


def _to_cones(points: Floats, cones: RoundCones) -> Floats:
    """Signed distances (n, m) of points (n, m, 3) to round cones (m,), exact outside.

    In the plane through both centres and the point the hull is a trapezium between two circles.
    """
    flat = np.zeros((len(cones), 1))
    start, end = np.hstack([cones.start, flat]), np.hstack([cones.end, flat])
    length = norm(end - start)
    from_start = points - start
    along = np.einsum("nmx,mx->nm", from_start, (end - start) / length[:, None])
    out = np.sqrt(np.maximum((from_start**2).sum(axis=-1) - along**2, 0))
    shrink = (cones.start_radius - cones.end_radius) / length
    straight = np.sqrt(1 - shrink**2)
    # Foot of the perpendicular on the common tangent, as a share of the way between the circles.
    foot = np.clip((along - out * shrink / straight) / length, 0, 1)
    radius = cones.start_radius + foot * (cones.end_radius - cones.start_radius)
    return np.asarray(np.hypot(along - foot * length, out) - radius)


def _to_box(points: Floats, polygon: Floats) -> Floats:
    """Distance (n,) of points (n, 2) to the box round a polygon (p, 2), 0 inside."""
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    return norm(np.maximum(0, np.maximum(low - points, points - high)))


def _to_polygon(points: Floats, polygon: Floats) -> Floats:
    """Distance (n,) of points (n, 2) to a polygon (p, 2), 0 inside."""
    side = np.roll(polygon, -1, axis=0) - polygon
    from_corner = points[:, None] - polygon
    share = np.clip((from_corner * side).sum(axis=-1) / (side**2).sum(axis=-1), 0, 1)
    distance: Floats = norm(from_corner - share[..., None] * side).min(axis=1)
    above = polygon[:, 1] > points[:, 1, None]
    crosses = above != np.roll(above, -1, axis=1)
    rise = np.where(side[:, 1] == 0, 1.0, side[:, 1])
    right = points[:, 0, None] < polygon[:, 0] + from_corner[..., 1] / rise * side[:, 0]
    inside = (crosses & right).sum(axis=1) % 2 == 1
    return np.where(inside, 0.0, distance)

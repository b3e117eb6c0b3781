"""The room that is left for what stands still: outside all light in use and all the base sweeps.

Both are distances in closed form. A round cone of light or a ball that turns about the axis within
two azimuths is nearest to a point at the azimuth nearest to the point's; so is what a cross-section
sweeps.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from tbcad.geometry.primitives import Primitive, enclosing_triangles
from tbcad.geometry.round_cones import RoundCones
from tbcad.geometry.vectors import norm
from tbcad.optics.ball_light import light_hulls
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.types import Floats

# Least distances are right to this, or to this share of them, on the safe side: where two faces are
# parallel, to look closer would take forever.
EXACT_MM = 0.05
EXACT = 0.1
CIRCLE = 48
ROUNDS = 60


@dataclass(frozen=True)
class Section:
    """A cross-section that is turned about the axis.

    Attributes:
        polygon: (z along the axis, r), mm, (p, 2).
        low: least azimuth it reaches, radians.
        high: largest one.
    """

    polygon: Floats
    low: float
    high: float


@dataclass(frozen=True)
class Room:
    """What stands still must keep out of this; azimuths in radians.

    Attributes:
        frame: rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3).
        capture: radius of the capture sphere, mm.
        cones: all light, first capture sphere to ball, then ball to pinhole, (2 k,).
        used: least and largest azimuth at which each cone is in use, (2 k, 2).
        centre: of the balls, (z, r), mm, (k, 2).
        radius: of the balls, mm, (k,).
        swung: least and largest azimuth of each ball, (k, 2).
        sections: wall, ribs and bosses over the whole swing, and the hub all round.
    """

    frame: Floats
    capture: float
    cones: RoundCones
    used: Floats
    centre: Floats
    radius: Floats
    swung: Floats
    sections: tuple[Section, ...]

    def light(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light in use, mm, (n,); less than 0 in it."""
        local = _local(self.frame, points)
        result: Floats = _to_cones(_beside(local, self.used), self.cones).min(axis=1)
        return result

    def scene(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light outside the capture sphere, mm, (n,).

        What is inside the sphere is part of the scene. The distance is never too large; less than
        0 in the light.
        """
        return np.maximum(self.light(points), self.capture - norm(points))

    def swept(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to what the base sweeps over its swing, mm, (n,)."""
        local = _local(self.frame, points)
        at = _beside(local, self.swung)
        away = norm(at - np.column_stack([self.centre, 0 * self.radius]))
        found = [(away - self.radius).min(axis=1)]
        for one in self.sections:
            beside = _beside(local, np.array([[one.low, one.high]]))[:, 0]
            found.append(np.hypot(_to_polygon(beside[:, :2], one.polygon), beside[:, 2]))
        result: Floats = np.min(found, axis=0)
        return result


def room(made: PrototypeLayout, base: BaseLayout, capture: float, approach: float) -> Room:
    """The room that a prototype leaves.

    Args:
        made: balls, places and stops.
        base: that carries them.
        capture: radius of the capture sphere, mm.
        approach: angle by which the base starts below its first stop, radians.
    """
    stops, azimuth = made.stops, made.placement.azimuth
    angle = stops.angle[stops.stop]
    used = np.stack([_extreme(np.min, made, angle), _extreme(np.max, made, angle)], axis=1)
    used += azimuth[:, None]
    to_object, to_camera = light_hulls(made.balls.outline, base.light.pinhole, capture)
    swing = np.array([min(float(angle.min()), 0.0) - approach, max(float(angle.max()), 0.0)])
    return Room(
        frame=base.frame,
        capture=capture,
        cones=_both(to_object, to_camera),
        used=np.concatenate([used, used]),
        centre=made.balls.body_centre[:, :2],
        radius=made.balls.body_radius,
        swung=azimuth[:, None] + swing,
        sections=_sections(base, swing),
    )


def least(
    distance: Callable[[Floats], Floats], bodies: Iterable[Primitive], enough: float = 0.0
) -> float:
    """Least distance of the surfaces of bodies by a function of points (n, 3), mm.

    Never too large, and too small by at most EXACT_MM or a share EXACT: a distance changes by no
    more than the point moves, so each triangle bounds it, and those that may hold the least are
    split. Some distance below `enough` ends the search: a body that meets something is wrong
    anyway.
    """
    open_ = np.concatenate([enclosing_triangles(body) for body in bodies])
    best = np.inf
    for _ in range(ROUNDS):
        middle = open_.mean(axis=1)
        reach, at = norm(open_ - middle[:, None]).max(axis=1), distance(middle)
        best = min(best, float(at.min()))
        open_ = _split(open_[at - reach < best - _slack(best)])
        if not len(open_) or best < enough + EXACT_MM:
            break
    return best - _slack(best)


def _slack(distance: float) -> float:
    return max(EXACT_MM, EXACT * distance)


def _split(corners: Floats) -> Floats:
    half = (corners + np.roll(corners, -1, axis=1)) / 2
    tips = np.stack([corners, half, np.roll(half, 1, axis=1)], axis=2).reshape(-1, 3, 3)
    return np.concatenate([tips, half])


def _extreme(of: Callable[..., Floats], made: PrototypeLayout, angle: Floats) -> Floats:
    return np.array([of(angle[made.fit.ball == k]) for k in range(len(made))])


def _both(a: RoundCones, b: RoundCones) -> RoundCones:
    names = ("start", "end", "start_radius", "end_radius")
    return RoundCones(*(np.concatenate([getattr(a, name), getattr(b, name)]) for name in names))


def _sections(base: BaseLayout, swing: Floats) -> tuple[Section, ...]:
    low, high = base.sector[0] + float(swing[0]), base.sector[1] + float(swing[1])
    wall = np.vstack([base.inner, base.outer[::-1]])
    ribs = np.vstack([base.outline, base.inner[::-1]])
    bosses = [_boss(base, k) for k in range(len(base.seats))]
    held = base.hub
    round_ = [_disc(held.back, held.front, held.disc)]
    round_ += [_disc(held.face, held.back, held.boss)] if held.boss else []
    turning = [Section(one, low, high) for one in (wall, ribs, *base.rings, *bosses)]
    return (*turning, *(Section(one, -np.pi, np.pi) for one in round_))


def _disc(low: float, high: float, radius: float) -> Floats:
    return np.array([[low, 0.0], [high, 0.0], [high, radius], [low, radius]])


def _boss(base: BaseLayout, k: int) -> Floats:
    """Hull of a boss and its number in (z, r), (p, 2)."""
    seat, turn = base.seats, 2 * np.pi * np.arange(CIRCLE) / CIRCLE
    wide = float(seat.boss[k]) / np.cos(np.pi / CIRCLE)
    circle = wide * np.stack([np.cos(turn), np.sin(turn)], axis=1) @ seat.axes[k, :2]
    lengths = (seat.front[k], seat.back[k] + base.spec.relief_mm)
    ends = [seat.centre[k] + length * seat.axes[k, 2] + circle for length in lengths]
    local = np.vstack(ends) @ base.frame.T
    plane = np.column_stack([local[:, 0], norm(local[:, 1:])])
    result: Floats = plane[ConvexHull(plane).vertices]
    return result


def _local(frame: Floats, points: Floats) -> Floats:
    """Points (n, 3) as z, r and azimuth, (n, 3)."""
    z, out, third = (points @ frame.T).T
    return np.stack([z, np.hypot(out, third), np.arctan2(third, out)], axis=1)


def _beside(local: Floats, azimuths: Floats) -> Floats:
    """Points (n, m, 3) as seen from the nearest half-plane of each range of azimuths (m, 2).

    Along the axis, out in that half-plane, and away from it.
    """
    middle, half = azimuths.mean(axis=1), np.diff(azimuths, axis=1)[:, 0] / 2
    turn = np.abs((local[:, 2, None] - middle + np.pi) % (2 * np.pi) - np.pi)
    beyond = np.maximum(turn - half, 0)
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
    away = points - start
    along = np.einsum("nmx,mx->nm", away, (end - start) / length[:, None])
    out = np.sqrt(np.maximum((away**2).sum(axis=-1) - along**2, 0))
    shrink = (cones.start_radius - cones.end_radius) / length
    straight = np.sqrt(1 - shrink**2)
    # Foot of the perpendicular on the common tangent, as a share of the way between the circles.
    foot = np.clip((along - out * shrink / straight) / length, 0, 1)
    radius = cones.start_radius + foot * (cones.end_radius - cones.start_radius)
    result: Floats = np.hypot(along - foot * length, out) - radius
    return result


def _to_polygon(points: Floats, polygon: Floats) -> Floats:
    """Distance (n,) of points (n, 2) to a polygon (p, 2), 0 inside."""
    side = np.roll(polygon, -1, axis=0) - polygon
    away = points[:, None] - polygon
    share = np.clip((away * side).sum(axis=-1) / (side**2).sum(axis=-1), 0, 1)
    result: Floats = norm(away - share[..., None] * side).min(axis=1)
    above = polygon[:, 1] > points[:, 1, None]
    crosses = above != np.roll(above, -1, axis=1)
    rise = np.where(side[:, 1] == 0, 1.0, side[:, 1])
    right = points[:, 0, None] < polygon[:, 0] + away[..., 1] / rise * side[:, 0]
    inside = (crosses & right).sum(axis=1) % 2 == 1
    return np.where(inside, 0.0, result)

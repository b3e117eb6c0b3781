"""Joints between pieces of the base: flanges on both sides of a plane, dowels, screws, numbers.

A hole is placed where the flange is whole all round it and no boss is near; a screw's head also
where a key reaches it from outside. All is in the carrier's own frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.geometry.vectors import norm, unit
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import distance_outside, offset
from tbcad.prototype.base.screws import access_radius, joint_hardware
from tbcad.types import Bools, Floats

GRID_MM = 2.0
AROUND_MM = 1.2  # least wall round a hole
ABOVE_MM = 15.0  # what is kept clear over a boss, for its number
ACCESS_MM = 25.0  # from a flange, for a screw's length and the key
HEAD_PLAY_MM = 0.3  # from a boss to what passes by it
LABEL_MM = 4.2  # radius of the place of a piece's number
APART_MM = 8.0  # of holes, from middle to middle
MOST_SCREWS = 8
OFF_HUB_MM = 1.0


@dataclass(frozen=True)
class CutPlane:
    """A plane: all points whose product with the unit normal (3,) is the level, mm."""

    normal: Floats
    level: float

    def above(self, points: Floats) -> Floats:
        """Distance of points (..., 3) on the side the normal points to, mm, (...)."""
        result: Floats = points @ self.normal - self.level
        return result


@dataclass(frozen=True)
class Joint:
    """A joint on a plane.

    Attributes:
        plane: between both sides.
        within: rows (h, 4) of normal and level below which the joint lies.
        dowels: places on the plane, mm, (d, 3); pressed in below it.
        screws: places on the plane, mm, (s, 3).
        heads: the side of each screw's head, 1 above the plane, -1 below, (s,).
        labels: places on the plane of the numbers below and above, mm, (2, 3).
    """

    plane: CutPlane
    within: Floats
    dowels: Floats
    screws: Floats
    heads: NDArray[np.int64]
    labels: Floats


def flange_profile(base: BaseLayout) -> Floats:
    """Cross-section of the flanges, from within the wall, (z, r), mm, (n, 2).

    It begins off the hub and ends before the wall does.
    """
    line, height = base.middle, base.keys.thickness_mm / 2 + base.keys.joint_height_mm
    share = (base.hub.disc + OFF_HUB_MM - line[0, 1]) / (line[1, 1] - line[0, 1])
    line = np.vstack([line[0] + max(share, 0) * (line[1] - line[0]), line[1:]])
    return np.vstack([line, offset(line, height)[::-1]])


def _top(base: BaseLayout) -> Floats:
    return offset(base.inner, base.keys.thickness_mm + base.keys.joint_height_mm)


def plan_joint(
    base: BaseLayout, plane: CutPlane, within: Floats, others: Sequence[tuple[CutPlane, Floats]]
) -> Joint | None:
    """Dowels, screws and numbers of a joint, or None where they have no room.

    Args:
        base: to be cut.
        plane: of the joint.
        within: rows (h, 4) of normal and level below which the joint lies.
        others: planes of all other joints, each with what it lies within.
    """
    size, room = joint_hardware(base.keys), _Room(base, plane, within, others)
    pin, bolt, free = base.keys.dowel_mm / 2, base.keys.insert_hole_mm / 2, access_radius(size)
    places = room.places(max(pin, bolt))
    sides = [room.reached(places, side, free, ACCESS_MM) for side in (-1, 1)]
    dowels = _farthest_two(places)
    if dowels is None:
        return None
    can = sides[0] | sides[1]
    count = int(
        np.clip(np.round(norm(dowels[1] - dowels[0]) / base.keys.screw_pitch_mm), 2, MOST_SCREWS)
    )
    screws = _spread(places[can], dowels, count, APART_MM)
    if len(screws) < 2:
        return None
    taken = np.vstack([dowels, screws])
    labels = [_label(room, side, taken, free) for side in (-1, 1)]
    if not all(len(one) for one in labels):
        return None
    upper = [bool(sides[1][(places == one).all(axis=1).argmax()]) for one in screws]
    return Joint(plane, within, dowels, screws, np.where(upper, 1, -1), np.vstack(labels))


def _label(room: "_Room", side: int, taken: Floats, free: float) -> Floats:
    """Place for a number on a side, if there is one; where it needs no notch in a rib, if can be.

    Args:
        room: on the plane.
        side: above the plane 1, below -1.
        taken: places of holes, mm, (n, 3).
        free: radius of what is kept clear round them, mm.
    """
    spots = room.places(LABEL_MM - AROUND_MM)
    spots = spots[room.reached(spots, side, LABEL_MM, ACCESS_MM)]
    best = _spread(spots[room.off_ribs(spots, side)], taken, 1, LABEL_MM + free)
    return best if len(best) else _spread(spots, taken, 1, LABEL_MM + free)


@dataclass(frozen=True)
class _Room:
    base: BaseLayout
    plane: CutPlane
    within: Floats
    others: Sequence[tuple[CutPlane, Floats]]

    def places(self, radius: float) -> Floats:
        """Points of the plane round which both flanges have room for a hole, (n, 3)."""
        thick = self.base.keys.joint_mm
        points = self._grid()
        axis = self._along(points, np.linspace(-thick, thick, 9))
        inside = self._in_flange(axis, radius + AROUND_MM).all(axis=1)
        points, axis = points[inside], axis[inside]
        good = self._off_bosses(axis, radius + AROUND_MM, ABOVE_MM)
        good &= self._off_others(axis, thick + radius + AROUND_MM)
        return points[good.all(axis=1)]

    def reached(self, points: Floats, side: int, radius: float, length: float) -> Bools:
        """Whether a flange's outer face is reached by something round along the normal, (n,)."""
        thick = self.base.keys.joint_mm
        axis = self._along(points, side * np.linspace(thick, thick + length, 10))
        good = self._off_bosses(axis, radius + HEAD_PLAY_MM, self.base.keys.relief_mm)
        good &= self._off_others(axis, thick + radius)
        good &= distance_outside(self.base.outer, _section(axis)) >= radius
        result: Bools = np.asarray(good.all(axis=1))
        return result

    def off_ribs(self, points: Floats, side: int) -> Bools:
        """Whether ribs and rings leave a number free on a flange's outer face, (n,)."""
        base, thick = self.base, self.base.keys.joint_mm
        axis = self._along(points, side * np.linspace(thick, thick + LABEL_MM, 4))
        azimuth = np.arctan2(axis[..., 1], axis[..., 0])
        at = _section(axis)
        away = at[..., 1, None] * np.abs(np.sin(azimuth[..., None] - base.ribs))
        good = np.asarray((away >= base.keys.rib_mm + LABEL_MM).all(axis=(1, 2)))
        for ring in base.rings:
            good &= (distance_outside(np.vstack([ring, ring[:1]]), at) >= LABEL_MM).all(axis=1)
        return good

    def _grid(self) -> Floats:
        normal = self.plane.normal
        one = unit(np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))]))
        most = 2 * float(np.abs(_top(self.base)).max())
        step = np.arange(-most, most, GRID_MM)
        across = np.stack(np.meshgrid(step, step, indexing="ij"), axis=-1).reshape(-1, 2)
        points = self.plane.level * normal + across @ np.stack([one, np.cross(normal, one)])
        at, top = _section(points), _top(self.base)
        points = points[((at >= [top[0, 0], self.base.hub.disc]) & (at <= top.max(axis=0))).all(1)]
        near: Floats = points[self._in_flange(points, 0.0)]
        return near

    def _along(self, points: Floats, lengths: Floats) -> Floats:
        result: Floats = points[:, None] + lengths[:, None] * self.plane.normal
        return result

    def _in_flange(self, points: Floats, margin: float) -> Bools:
        """Whether points (..., 3) lie so far inside of what a flange may fill, (...)."""
        base, at = self.base, _section(points)
        end = unit(base.inner[-1] - base.inner[-2])
        low, high = base.sector
        azimuth = np.arctan2(points[..., 1], points[..., 0])
        edge = at[..., 1] * np.sin(np.clip(np.minimum(azimuth - low, high - azimuth), -1, 1))
        good: Bools = (
            (distance_outside(base.inner, at) >= margin)
            & (distance_outside(_top(base), at) <= -margin)
            & ((at - base.inner[-1]) @ end <= -margin - 1)
            & (at[..., 1] >= base.hub.disc + margin)
            & (edge >= margin + base.keys.rib_mm)
            & (points @ self.within[:, :3].T <= self.within[:, 3] - margin).all(axis=-1)
        )
        return good

    def _off_bosses(self, points: Floats, margin: float, over: float) -> Bools:
        """Whether points (..., 3) are so far off all bosses and what is over their ends, (...)."""
        seats, good = self.base.own_seats, np.ones(points.shape[:-1], dtype=bool)
        for k in range(len(seats)):
            away = points - seats.centre[k]
            along = np.clip(away @ seats.axis[k], seats.front[k], seats.back[k] + over)
            good &= norm(away - along[..., None] * seats.axis[k]) >= seats.boss[k] + margin
        return good

    def _off_others(self, points: Floats, margin: float) -> Bools:
        good = np.ones(points.shape[:-1], dtype=bool)
        for plane, within in self.others:
            inside = (points @ within[:, :3].T <= within[:, 3] + margin).all(axis=-1)
            good &= ~inside | (np.abs(plane.above(points)) >= margin)
        return good


def _section(points: Floats) -> Floats:
    """Points (..., 3) as (z, r), (..., 2)."""
    return np.stack([points[..., 2], norm(points[..., :2])], axis=-1)


def _farthest_two(points: Floats) -> Floats | None:
    """The two points that stand farthest apart, (2, 3)."""
    if len(points) < 2:
        return None
    away = norm(points[:, None] - points)
    found: Floats = points[list(np.unravel_index(int(np.round(away, 6).argmax()), away.shape))]
    return found if norm(found[1] - found[0]) >= APART_MM else None


def _spread(points: Floats, taken: Floats, count: int, apart: float) -> Floats:
    """Up to so many points, each as far as can be from those before it, (n, 3)."""
    chosen = taken
    for _ in range(count):
        if not len(points):
            break
        away = norm(points[:, None] - chosen).min(axis=1)
        best = int(np.round(away, 6).argmax())
        if away[best] < apart:
            break
        chosen = np.vstack([chosen, points[best]])
    return chosen[len(taken) :]

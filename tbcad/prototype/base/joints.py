"""Joints between pieces of the base: flanges on both sides of a plane, dowels, screws, numbers.

A hole is placed where the flange is whole all round it and no boss is near; a screw's head also
where a key reaches it from outside. All is in the carrier's own frame.

A region is rows (h, 4) of a unit normal and a level: all points on the lower side of all planes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import norm, perpendicular_axes, unit
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import distance_outside, half_plane, offset
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, load_parts, of_kind
from tbcad.types import Bools, Floats

GRID_MM = 2.0  # of places tried for holes
MIN_WALL_MM = 1.2  # round a hole
ABOVE_BOSS_MM = 15.0  # that is kept clear over a boss, for its number
ACCESS_MM = 25.0  # that is kept clear from a flange, for a screw's length and the key
HEAD_PLAY_MM = 0.3  # from a boss to what passes by it
LABEL_MM = 4.2  # radius of the place of a piece's number
MIN_SPACING_MM = 8.0  # of holes, from middle to middle
MIN_SCREWS, MAX_SCREWS = 2, 8
OFF_HUB_MM = 1.0  # of a flange
OFF_END_MM = 1.0  # of a hole's margin from the wall's end
# Points along an axis that are checked: through both flanges, over a head, within a label.
THROUGH_POINTS, ACCESS_POINTS, LABEL_POINTS = 9, 10, 4
DECIMALS = 6  # to which distances are compared, mm
M3_MM = 3.0
FLOOR_MM = 1.0  # below holes
MIN_ENGAGEMENT_MM = 4.0  # of a screw in its insert: 1.3 diameters
BEYOND_DOWEL_MM = 0.5  # depth of a hole beyond its dowel
KEY_PLAY_MM = 0.55  # round a screw's head


@dataclass(frozen=True)
class CutPlane:
    """A plane: all points whose product with the unit normal (3,) is the level, mm."""

    normal: Floats
    level: float

    def height(self, points: Floats) -> Floats:
        """Distance of points (..., 3) on the side the normal points to, mm, (...)."""
        return np.asarray(points @ self.normal - self.level)

    @property
    def row(self) -> Floats:
        """Normal and level as a row of a region, (4,)."""
        return np.array([*self.normal, self.level])


@dataclass(frozen=True)
class Joint:
    """A joint on a plane."""

    plane: CutPlane  # between both sides
    region: Floats  # that the joint is in, (h, 4)
    dowels: Floats  # places on the plane, mm, (d, 3); pressed in below it
    screws: Floats  # places on the plane, mm, (s, 3)
    heads: NDArray[np.int64]  # the side of each screw's head, 1 above the plane, -1 below, (s,)
    labels: Floats  # places on the plane of the numbers below and above, mm, (2, 3)


Cut = tuple[CutPlane, Floats]
"""A plane, and the region that it cuts."""


def in_region(points: Floats, region: Floats, slack: float = 0.0) -> Bools:
    """Whether points (..., 3) are in a region (h, 4), or at most a slack (mm) outside, (...)."""
    below = points @ region[:, :3].T <= region[:, 3] + slack
    return np.asarray(below.all(axis=-1))


def flange_profile(base: BaseLayout) -> Floats:
    """Cross-section of the flanges, from within the wall, (z, r), mm, (n, 2).

    It begins off the hub and ends before the wall does.
    """
    line, height = base.middle, base.spec.thickness_mm / 2 + base.spec.joint_height_mm
    share = (base.hub.disc + OFF_HUB_MM - line[0, 1]) / (line[1, 1] - line[0, 1])
    line = np.vstack([line[0] + max(share, 0) * (line[1] - line[0]), line[1:]])
    return np.vstack([line, offset(line, height)[::-1]])


def flange_top(base: BaseLayout) -> Floats:
    """Outer line of the flanges, (z, r), mm, (n, 2)."""
    return offset(base.inner, base.spec.thickness_mm + base.spec.joint_height_mm)


def plan_joint(base: BaseLayout, cut: Cut, others: Sequence[Cut]) -> Joint | None:
    """Dowels, screws and numbers of a joint clear of other cuts; None where they have no room."""
    spec, flanges = base.spec, _Flanges(base, *cut, others)
    head = joint_hardware(spec).access_radius
    places = flanges.places(max(spec.dowel_mm / 2, spec.insert_hole_mm / 2))
    below, above = (flanges.accessible(places, side, head, ACCESS_MM) for side in (-1, 1))
    dowels = _farthest_two(places)
    if dowels is None:
        return None
    pitches = np.round(norm(dowels[1] - dowels[0]) / spec.screw_pitch_mm)
    count = int(np.clip(pitches, MIN_SCREWS, MAX_SCREWS))
    screws = _spread(places[below | above], dowels, count, MIN_SPACING_MM)
    if len(screws) < MIN_SCREWS:
        return None
    holes = np.vstack([dowels, screws])
    labels = [_label(flanges, side, holes, head) for side in (-1, 1)]
    if not all(len(one) for one in labels):
        return None
    upper = [bool(above[(places == one).all(axis=1).argmax()]) for one in screws]
    return Joint(*cut, dowels, screws, np.where(upper, 1, -1), np.vstack(labels))


def _label(flanges: "_Flanges", side: int, holes: Floats, head: float) -> Floats:
    """Place (0 or 1, 3) for a number off holes (n, 3) and heads' radius, best off all ribs."""
    places = flanges.places(LABEL_MM - MIN_WALL_MM)
    places = places[flanges.accessible(places, side, LABEL_MM, ACCESS_MM)]
    best = _spread(places[flanges.off_ribs(places, side)], holes, 1, LABEL_MM + head)
    return best if len(best) else _spread(places, holes, 1, LABEL_MM + head)


@dataclass(frozen=True)
class _Flanges:
    """The two flanges of a joint, and where they have room."""

    base: BaseLayout
    plane: CutPlane
    region: Floats
    others: Sequence[Cut]

    def places(self, radius: float) -> Floats:
        """Points of the plane round which both flanges have room for a hole, (n, 3)."""
        thickness, margin = self.base.spec.joint_mm, radius + MIN_WALL_MM
        points = self._grid()
        axis = self._along(points, np.linspace(-thickness, thickness, THROUGH_POINTS))
        inside = self._in_flange(axis, margin).all(axis=1)
        points, axis = points[inside], axis[inside]
        clear = self._off_bosses(axis, margin, ABOVE_BOSS_MM)
        clear &= self._off_others(axis, thickness + radius + MIN_WALL_MM)
        return points[clear.all(axis=1)]

    def accessible(self, points: Floats, side: int, radius: float, length: float) -> Bools:
        """Whether something round along the normal reaches a flange's outer face, (n,)."""
        thickness = self.base.spec.joint_mm
        lengths = side * np.linspace(thickness, thickness + length, ACCESS_POINTS)
        axis = self._along(points, lengths)
        clear = self._off_bosses(axis, radius + HEAD_PLAY_MM, self.base.spec.relief_mm)
        clear &= self._off_others(axis, thickness + radius)
        clear &= distance_outside(self.base.outer, half_plane(axis)) >= radius
        return np.asarray(clear.all(axis=1))

    def off_ribs(self, points: Floats, side: int) -> Bools:
        """Whether ribs and rings leave a number free on a flange's outer face, (n,)."""
        base, thickness = self.base, self.base.spec.joint_mm
        lengths = side * np.linspace(thickness, thickness + LABEL_MM, LABEL_POINTS)
        axis = self._along(points, lengths)
        azimuth, section = np.arctan2(axis[..., 1], axis[..., 0]), half_plane(axis)
        distance = section[..., 1, None] * np.abs(np.sin(azimuth[..., None] - base.ribs))
        clear = np.asarray((distance >= base.spec.rib_mm + LABEL_MM).all(axis=(1, 2)))
        for ring in base.rings:
            closed = np.vstack([ring, ring[:1]])
            clear &= (distance_outside(closed, section) >= LABEL_MM).all(axis=1)
        return clear

    def _grid(self) -> Floats:
        """Points of the plane in the flanges, GRID_MM apart, (n, 3)."""
        normal, top = self.plane.normal, flange_top(self.base)
        reach = 2 * float(np.abs(top).max())
        step = np.arange(-reach, reach, GRID_MM)
        across = np.stack(np.meshgrid(step, step, indexing="ij"), axis=-1).reshape(-1, 2)
        points = self.plane.level * normal + across @ -perpendicular_axes(normal)
        section = half_plane(points)
        near = (section >= [top[0, 0], self.base.hub.disc]) & (section <= top.max(axis=0))
        points = points[near.all(axis=1)]
        return np.asarray(points[self._in_flange(points, 0.0)])

    def _along(self, points: Floats, lengths: Floats) -> Floats:
        return np.asarray(points[:, None] + lengths[:, None] * self.plane.normal)

    def _in_flange(self, points: Floats, margin: float) -> Bools:
        """Whether points (..., 3) are a margin (mm) inside of what a flange may fill, (...)."""
        base, section = self.base, half_plane(points)
        end = unit(base.inner[-1] - base.inner[-2])
        low, high = base.sector
        azimuth = np.arctan2(points[..., 1], points[..., 0])
        to_edge = np.clip(np.minimum(azimuth - low, high - azimuth), -1, 1)
        return np.asarray(
            (distance_outside(base.inner, section) >= margin)
            & (distance_outside(flange_top(base), section) <= -margin)
            & ((section - base.inner[-1]) @ end <= -margin - OFF_END_MM)
            & (section[..., 1] >= base.hub.disc + margin)
            & (section[..., 1] * np.sin(to_edge) >= margin + base.spec.rib_mm)
            & in_region(points, self.region, -margin)
        )

    def _off_bosses(self, points: Floats, margin: float, over: float) -> Bools:
        """Whether points (..., 3) are a margin off all bosses and the space over their ends."""
        seats, clear = self.base.local_seats, np.ones(points.shape[:-1], dtype=bool)
        for k in range(len(seats)):
            from_centre = points - seats.centre[k]
            along = np.clip(from_centre @ seats.axis[k], seats.front[k], seats.back[k] + over)
            distance = norm(from_centre - along[..., None] * seats.axis[k])
            clear &= distance >= seats.boss[k] + margin
        return clear

    def _off_others(self, points: Floats, margin: float) -> Bools:
        """Whether points (..., 3) are a margin off all other cuts, (...)."""
        clear = np.ones(points.shape[:-1], dtype=bool)
        for plane, region in self.others:
            near = in_region(points, region, margin)
            clear &= ~near | (np.abs(plane.height(points)) >= margin)
        return clear


def _farthest_two(points: Floats) -> Floats | None:
    """The two points with the largest distance, (2, 3); None when they are too near."""
    if len(points) < 2:
        return None
    distance = np.round(norm(points[:, None] - points), DECIMALS)
    pair: Floats = points[list(np.unravel_index(int(distance.argmax()), distance.shape))]
    return pair if norm(pair[1] - pair[0]) >= MIN_SPACING_MM else None


def _spread(points: Floats, taken: Floats, count: int, spacing: float) -> Floats:
    """Up to a number of points, each as far as possible from those before it, (n, 3)."""
    chosen = taken
    for _ in range(count):
        if not len(points):
            break
        distance = norm(points[:, None] - chosen).min(axis=1)
        best = int(np.round(distance, DECIMALS).argmax())
        if distance[best] < spacing:
            break
        chosen = np.vstack([chosen, points[best]])
    return chosen[len(taken) :]


@dataclass(frozen=True)
class JointHardware:
    """Purchased parts of joints: names, and what their holes need, mm.

    The access radius is that of what is kept clear over a screw's head.
    """

    dowel: str
    dowel_depth: float
    screw: str
    access_radius: float


def by_length(
    parts: Parts, kind: str, refusal: str, low: float = 0.0, high: float = np.inf, **sizes: float
) -> list[PurchasedPart]:
    """Parts of a kind with lengths between two (mm), the shortest first; refused without any."""
    some = [one for one in of_kind(parts, kind, **sizes) if low <= one["length_mm"] <= high]
    if not some:
        raise SpecError(refusal)
    return sorted(some, key=lambda one: one["length_mm"])


def joint_hardware(spec: BaseSpec) -> JointHardware:
    """The longest dowel and the shortest M3 screw for the flanges; SpecError without any."""
    minimum, parts = spec.insert_depth_mm + FLOOR_MM, load_parts()
    if spec.joint_mm < minimum:
        raise SpecError(
            f"flanges of {spec.joint_mm:g} mm are too thin for inserts: make "
            f"prototype.base.joint_mm at least {minimum:g}"
        )
    longest = 2 * (spec.joint_mm - FLOOR_MM - BEYOND_DOWEL_MM)
    refusal = (
        f"no dowel of {spec.dowel_mm:g} mm is at most {longest:g} mm long: make "
        "prototype.base.joint_mm larger or prototype.base.dowel_mm smaller"
    )
    dowel = by_length(parts, "dowels", refusal, high=longest, diameter_mm=spec.dowel_mm)[-1]
    low, high = spec.joint_mm + MIN_ENGAGEMENT_MM, spec.joint_mm + spec.insert_depth_mm
    refusal = (
        f"no M3 screw is {low:g} to {high:g} mm long: make prototype.base.joint_mm one of the "
        "lengths on sale less 4"
    )
    screw = by_length(parts, "screws", refusal, low, high, thread_mm=M3_MM)[0]
    depth = dowel["length_mm"] / 2 + BEYOND_DOWEL_MM
    return JointHardware(dowel.name, depth, screw.name, screw["head_mm"] / 2 + KEY_PLAY_MM)

"""How the base is cut to fit the printer's bed: planes that miss the hub and every boss.

Bosses are so close that no half-plane through the axis misses them all (at the paper's design the
widest such gap is negative), so planes of every slope are tried. A piece is cut again until all
fit; the fewest pieces win. All is in the carrier's own frame: z the axis, x azimuth zero.

A piece is a region: rows (h, 4) of a unit normal and a level, the piece on the lower side of all.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.ndimage import label
from scipy.spatial import ConvexHull

from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import norm, perpendicular_axes
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.base.joints import (
    Cut,
    CutPlane,
    Joint,
    flange_top,
    in_region,
    joint_hardware,
    plan_joint,
)
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import at_azimuths, meridian
from tbcad.prototype.print_bed import min_bed, shortfall, size_text
from tbcad.types import Bools, Floats, Ints

CLEARANCE_MM = 1.0  # of a plane from any boss
NORMALS = 6000  # directions of planes, evenly over the half sphere
PLANES_PER_PARTITION = 5  # that have the same bosses on each side
# Planes tried, the best first, for a piece that is to become this many pieces.
PLANES_TRIED = {2: 1000, 3: 5, 4: 2}
MAX_PIECES = max(PLANES_TRIED)
WIDE_GAP = 2  # gaps of at least 1/2 of the widest are tried
SLIVER = 50  # a piece of less than 1/50 of the wall is a sliver
ROUNDING_MM = 1e-9
DECIMALS = 3  # to which sizes of pieces are compared, mm
WHOLE: Floats = np.zeros((0, 4))  # the region that nothing cuts
AZIMUTH_STEP = np.radians(1.5)
STEP_MM = 4.0  # maximum distance of points along a line
RIM_CORNERS = 24


class BedError(SpecError):
    """The printer's bed is too small for a base, however it is cut."""


@dataclass(frozen=True)
class BaseSplit:
    """Pieces and joints of the base."""

    pieces: tuple[Floats, ...]  # regions (h, 4); the piece with the hub first
    joints: tuple[Joint, ...]  # one for each cut; none: the base stays whole

    def piece_of(self, point: Floats) -> int:
        """Number, from 0, of the piece that a point (3,) is in."""
        return [bool(in_region(point, piece)) for piece in self.pieces].index(True)


UNCUT = BaseSplit((WHOLE,), ())


def split_base(base: BaseLayout, printer: PrinterSpec) -> BaseSplit:
    """How a base is cut so that every piece fits the bed: into as few as can be found.

    BedError when no cut does; it names the bed that would.
    """
    search = _SplitSearch(base, printer)
    if search.shortfall(WHOLE) <= 0:
        return UNCUT
    joint_hardware(base.spec)  # refused now, not after a long search
    for count in range(2, MAX_PIECES + 1):
        for split in search.splits(count):
            return split
    raise BedError(
        "no way was found to cut the base for the printer's bed: make printer.bed_mm at least "
        f"{size_text(search.min_bed())}, or prototype.largest_ball_mm or prototype.k smaller"
    )


def downward_directions(base: BaseLayout, piece: Floats) -> list[Floats]:
    """Directions of the carrier's own frame that may point down when a piece is printed."""
    x, y, up = np.eye(3)
    low, high = (meridian(azimuth)[1] for azimuth in base.sector)
    return [-up, up, 0.0 - low, high, -x, -y, y, *piece[:, :3], *-piece[:, :3]]


Tree = tuple[tuple[Floats, ...], tuple[Cut, ...]]
"""Pieces, and the cuts that make them."""


@dataclass
class _SplitSearch:
    """Search for cuts of a base into pieces that fit a bed."""

    base: BaseLayout
    printer: PrinterSpec
    cuts: dict[bytes, list[tuple[float, CutPlane]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.bodies = bosses_and_hub(self.base)
        self.wall, self.hull, self.flange_tops = base_points(self.base, self.bodies)
        # Spread evenly over the half sphere x >= 0 by a spiral.
        share, turn = (np.arange(NORMALS) + 0.5) / NORMALS, np.pi * (1 + np.sqrt(5))
        spiral = np.sqrt(1 - share**2)[:, None] * unit_circle(turn * np.arange(NORMALS))
        self.normals = np.column_stack([share, spiral])

    def splits(self, count: int) -> Iterator[BaseSplit]:
        """Splits into a number of pieces that fit the bed and whose joints have room."""
        for pieces, cuts in self._trees(WHOLE, count):
            if (split := self._with_joints(pieces, cuts)) is not None:
                yield split

    def _with_joints(self, pieces: tuple[Floats, ...], cuts: tuple[Cut, ...]) -> BaseSplit | None:
        joints = []
        for k, cut in enumerate(cuts):
            joint = plan_joint(self.base, cut, cuts[:k] + cuts[k + 1 :])
            if joint is None:
                return None
            joints.append(joint)
        hub = self.bodies.start[-1]
        first = sorted(pieces, key=lambda piece: bool(in_region(hub, piece)), reverse=True)
        return BaseSplit(tuple(first), tuple(joints))

    def _trees(self, piece: Floats, count: int) -> Iterator[Tree]:
        """Ways to cut a piece into a number of pieces that fit."""
        if count == 1:
            if self.shortfall(piece) <= 0:
                yield (piece,), ()
            return
        for shortfall_mm, plane in self._ranked_planes(piece)[: PLANES_TRIED[count]]:
            if count == 2 and shortfall_mm > 0:
                return
            lower, upper = _sides(piece, plane)
            for lower_count in range(1, count):
                for lower_pieces, lower_cuts in self._trees(lower, lower_count):
                    for upper_pieces, upper_cuts in self._trees(upper, count - lower_count):
                        cuts = ((plane, piece), *lower_cuts, *upper_cuts)
                        yield lower_pieces + upper_pieces, cuts

    def shortfall(self, piece: Floats) -> float:
        """By how much the bed is too small for a piece, mm; 0 or less: it fits."""
        return shortfall(self._corners(piece), downward_directions(self.base, piece), self.printer)

    def min_bed(self) -> Floats:
        """The bed that the best cut into two needs, or the base as a whole, mm, (3,)."""
        for _, plane in self._ranked_planes(WHOLE):
            sides = _sides(WHOLE, plane)
            if self._with_joints(sides, ((plane, WHOLE),)) is not None:
                return np.maximum(*(self._needed_bed(side) for side in sides))
        return self._needed_bed(WHOLE)

    def _needed_bed(self, piece: Floats) -> Floats:
        return min_bed(self._corners(piece), downward_directions(self.base, piece), self.printer)

    def _ranked_planes(self, piece: Floats) -> list[tuple[float, CutPlane]]:
        """Planes that part a piece, with the larger shortfall of both sides, the smallest first."""
        key = piece.tobytes()
        if key not in self.cuts:
            ranked = []
            for plane in self._planes(piece):
                sides = _sides(piece, plane)
                if all(self._is_one_part(side) for side in sides):
                    ranked.append((max(self.shortfall(side) for side in sides), plane))
            self.cuts[key] = sorted(ranked, key=lambda one: round(one[0], DECIMALS))
        return self.cuts[key]

    def _planes(self, piece: Floats) -> Iterator[CutPlane]:
        """Planes half way between bodies of a piece, a few for each partition of the bodies."""
        bodies = np.flatnonzero(in_region(self.bodies.start, piece))
        low, high = (level[:, bodies] for level in self.bodies.levels(self.normals))
        order = np.argsort(low, axis=1)
        low = np.take_along_axis(low, order, axis=1)
        high = np.maximum.accumulate(np.take_along_axis(high, order, axis=1), axis=1)
        gap = low[:, 1:] - high[:, :-1]
        level = (low[:, 1:] + high[:, :-1]) / 2
        normal, place = np.nonzero(gap >= 2 * CLEARANCE_MM)
        below = np.argsort(order, axis=1)[normal] <= place[:, None]
        for row in _widest_of_each_partition(below, gap[normal, place]):
            yield CutPlane(self.normals[normal[row]], float(level[normal[row], place[row]]))

    def _corners(self, piece: Floats) -> Floats:
        """Points round a piece and its flanges, at most a step outside of it, (c, 3)."""
        reach, tops = STEP_MM + ROUNDING_MM, self.flange_tops
        from_planes = np.abs(tops @ piece[:, :3].T - piece[:, 3])
        flange = in_region(tops, piece, reach)
        flange &= (from_planes <= self.base.spec.joint_mm + reach).any(axis=1)
        hull = self.hull[in_region(self.hull, piece, reach)]
        points = np.vstack([hull, tops[flange]])
        return points[ConvexHull(points).vertices]

    def _is_one_part(self, piece: Floats) -> bool:
        """Whether a piece of the wall hangs together, and is no sliver."""
        inside = in_region(self.wall, piece)
        return bool(inside.sum() > inside.size / SLIVER) and label(inside)[1] == 1


def _sides(piece: Floats, plane: CutPlane) -> tuple[Floats, Floats]:
    """The regions below and above a plane in a piece."""
    return np.vstack([piece, plane.row]), np.vstack([piece, -plane.row])


def _widest_of_each_partition(below: Bools, gap: Floats) -> list[int]:
    """A few planes for each partition of bodies below (p, b): the widest gaps (p,), thinned."""
    # Partitions in the order of binary numbers, the last body's digit first.
    _, partition = np.unique(below[:, ::-1], axis=0, return_inverse=True)
    chosen: list[int] = []
    for one in range(int(partition.max(initial=-1)) + 1):
        rows: Ints = np.flatnonzero(partition.ravel() == one)
        rows = rows[np.argsort(-gap[rows], kind="stable")]
        wide = rows[gap[rows] >= gap[rows[0]] / WIDE_GAP]
        thinned = np.unique(np.linspace(0, len(wide) - 1, PLANES_PER_PARTITION).astype(np.int64))
        chosen += wide[thinned].tolist()
    return chosen


@dataclass(frozen=True)
class RoundBodies:
    """Cylinders that no plane may cut: ends (m, 3) of their axes, radii (m,), mm."""

    start: Floats
    end: Floats
    radius: Floats

    @property
    def axis(self) -> Floats:
        """Unit vectors from start to end, (m, 3)."""
        return np.asarray((self.end - self.start) / norm(self.end - self.start)[:, None])

    def levels(self, normals: Floats) -> tuple[Floats, Floats]:
        """Minimum and maximum level of each along unit normals (n, 3), both (n, m)."""
        across = self.radius * np.sqrt(np.maximum(1 - (normals @ self.axis.T) ** 2, 0))
        ends = np.stack([normals @ self.start.T, normals @ self.end.T])
        return ends.min(axis=0) - across, ends.max(axis=0) + across

    def rims(self) -> Floats:
        """Corners of polygons round both ends of each, (m, 2, RIM_CORNERS, 3)."""
        first, second = np.moveaxis(-perpendicular_axes(self.axis), 1, 0)
        angle = even_angles(RIM_CORNERS)
        circle = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
        circle *= (self.radius / np.cos(np.pi / RIM_CORNERS))[:, None, None]
        ends = np.stack([self.start, self.end], axis=1)
        return np.asarray(ends[:, :, None] + circle[:, None])


def bosses_and_hub(base: BaseLayout) -> RoundBodies:
    """Bosses with their numbers, and last the hub."""
    seats, hub = base.local_seats, base.hub
    up = np.array([0.0, 0.0, 1.0])
    return RoundBodies(
        np.vstack([seats.at_depth(seats.front), hub.face * up]),
        np.vstack([seats.at_depth(seats.back + base.spec.relief_mm), hub.front * up]),
        np.append(seats.boss, max(hub.disc, hub.boss)),
    )


def base_points(base: BaseLayout, bodies: RoundBodies) -> tuple[Floats, Floats, Floats]:
    """Points of a base with its bosses and hub, mm.

    In the middle of the wall, a grid over azimuth and meridian, (a, p, 3); round all of the base,
    (c, 3); and on the outer faces that flanges could have, (t, 3).
    """
    low, high = base.sector
    azimuth = np.linspace(low, high, int(np.ceil((high - low) / AZIMUTH_STEP)) + 1)
    parts = [
        *(at_azimuths(_dense(line), azimuth) for line in (base.inner, base.outer)),
        at_azimuths(_dense(base.outline), base.ribs),
        *(at_azimuths(ring, azimuth) for ring in base.rings),
        bodies.rims(),
    ]
    return (
        at_azimuths(_dense(base.middle), azimuth),
        np.vstack([part.reshape(-1, 3) for part in parts]),
        at_azimuths(_dense(flange_top(base)), azimuth).reshape(-1, 3),
    )


def _dense(line: Floats) -> Floats:
    """A line (n, 2) with points no farther apart than a step."""
    parts = [
        np.linspace(a, b, int(np.ceil(norm(b - a) / STEP_MM)), endpoint=False)
        for a, b in pairwise(line)
    ]
    return np.vstack([*parts, line[-1:]])

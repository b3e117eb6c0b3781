"""How the base is cut to fit the printer's bed: planes that miss the hub and every boss.

Bosses stand so close that no half-plane through the axis misses them all (at the paper's design the
widest such gap is negative), so planes of every slope are tried. A piece is cut again until all
fit; fewest pieces win. All is in the carrier's own frame: z the axis, x azimuth zero.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.spatial import ConvexHull

from tbcad.geometry.vectors import norm
from tbcad.prototype.base.joints import CutPlane, Joint, plan_joint
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import offset
from tbcad.prototype.base.screws import joint_hardware
from tbcad.prototype.printing.bed import as_text, needed, shortfall
from tbcad.spec.errors import SpecError
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats, Ints

MISS_MM = 1.0  # of a plane from any boss
MOST = 4  # pieces
NORMALS = 6000
KEPT = 5  # planes that part the bosses in the same way
TRIED = {2: 1000, 3: 5, 4: 2}  # planes, best first, where this many pieces are made
STEP = np.radians(1.5)
STEP_MM = 4.0
ROUND = 24


@dataclass(frozen=True)
class BaseSplit:
    """Pieces and joints of the base.

    Attributes:
        pieces: what each is cut by: rows (h, 4) of a unit normal and a level, of which a piece's
            points are on the lower side; the piece with the hub first.
        joints: one for each cut; none: the base stays whole.
    """

    pieces: tuple[Floats, ...]
    joints: tuple[Joint, ...]

    def piece_of(self, point: Floats) -> int:
        """Number, from 0, of the piece that a point (3,) lies in."""
        low = [bool((one[:, :3] @ point <= one[:, 3]).all()) for one in self.pieces]
        return low.index(True)


def split_base(base: BaseLayout, printer: PrinterSpec) -> BaseSplit:
    """How a base is cut so that every piece fits the bed: into as few as can be found.

    Raises:
        SpecError: when no cut does; it names the bed that would.
    """
    search = _Search(base, printer)
    if search.lack(np.zeros((0, 4))) <= 0:
        return BaseSplit((np.zeros((0, 4)),), ())
    joint_hardware(base.keys)
    for count in range(2, MOST + 1):
        for found in search.splits(count):
            return found
    raise SpecError(
        "no way was found to cut the base for the printer's bed: make printer.bed_mm at least "
        f"{as_text(search.least_bed())}, or prototype.largest_ball_mm or prototype.k smaller"
    )


def downward_directions(base: BaseLayout, planes: Floats) -> list[Floats]:
    """Directions of the carrier's own frame that may point down when a piece is printed.

    Args:
        base: with its sector.
        planes: that the piece is cut by, (h, 4).
    """
    low, high = base.sector
    up, x, y = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    edges = [
        np.array([np.sin(low), -np.cos(low), 0.0]),
        np.array([-np.sin(high), np.cos(high), 0.0]),
    ]
    return [-up, up, *edges, -x, -y, y, *planes[:, :3], *-planes[:, :3]]


@dataclass(frozen=True)
class _Bodies:
    """Round bodies that no plane may cut: ends (m, 3) of their axes, radii (m,)."""

    start: Floats
    end: Floats
    radius: Floats

    def reach(self, normals: Floats) -> tuple[Floats, Floats]:
        """Least and largest level of each along unit normals (n, 3), both (n, m)."""
        along = (self.end - self.start) / norm(self.end - self.start)[:, None]
        across = self.radius * np.sqrt(np.maximum(1 - (normals @ along.T) ** 2, 0))
        ends = np.stack([normals @ self.start.T, normals @ self.end.T])
        return ends.min(axis=0) - across, ends.max(axis=0) + across


Cut = tuple[CutPlane, Floats]  # a plane, and what bounds the piece that it cuts
Tree = tuple[tuple[Floats, ...], tuple[Cut, ...]]


@dataclass
class _Search:
    base: BaseLayout
    printer: PrinterSpec
    cuts: dict[bytes, list[tuple[float, CutPlane]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.bodies = _bodies(self.base)
        self.middle, self.cloud, self.tops = _clouds(self.base)
        self.normals = _half_sphere(NORMALS)

    def splits(self, count: int) -> Iterator[BaseSplit]:
        """Splits into a number of pieces that fit the bed and whose joints have room."""
        for pieces, cuts in self._trees(np.zeros((0, 4)), count):
            if (found := self._split(pieces, cuts)) is not None:
                yield found

    def _split(self, pieces: tuple[Floats, ...], cuts: tuple[Cut, ...]) -> BaseSplit | None:
        joints = []
        for k, (plane, within) in enumerate(cuts):
            joint = plan_joint(self.base, plane, within, cuts[:k] + cuts[k + 1 :])
            if joint is None:
                return None
            joints.append(joint)
        order = sorted(pieces, key=self._has_hub, reverse=True)
        return BaseSplit(tuple(order), tuple(joints))

    def _has_hub(self, piece: Floats) -> bool:
        return bool((piece[:, :3] @ self.bodies.start[-1] <= piece[:, 3]).all())

    def _trees(self, piece: Floats, count: int) -> Iterator[Tree]:
        """Ways to cut a piece into a number of pieces that fit."""
        if count == 1:
            if self.lack(piece) <= 0:
                yield (piece,), ()
            return
        for short, plane in self._cuts_of(piece)[: TRIED[count]]:
            if count == 2 and short > 0:
                return
            low, high = _sides(piece, plane)
            for first in range(1, count):
                for one, ones in self._trees(low, first):
                    for two, twos in self._trees(high, count - first):
                        yield one + two, ((plane, piece), *ones, *twos)

    def lack(self, piece: Floats) -> float:
        """By how much the bed is too small for a piece, mm; 0 or less: it fits."""
        return shortfall(self._corners(piece), downward_directions(self.base, piece), self.printer)

    def least_bed(self) -> Floats:
        """The bed that the best cut into two needs, or the base as a whole, mm, (3,)."""
        none = np.zeros((0, 4))
        for _, plane in self._cuts_of(none):
            sides = _sides(none, plane)
            if self._split(sides, ((plane, none),)) is not None:
                beds = [self._needed(side) for side in sides]
                return np.maximum(*beds)
        return self._needed(none)

    def _needed(self, piece: Floats) -> Floats:
        return needed(self._corners(piece), downward_directions(self.base, piece), self.printer)

    def _cuts_of(self, piece: Floats) -> list[tuple[float, CutPlane]]:
        """Planes that part a piece, those that leave the least too large first."""
        key = piece.tobytes()
        if key not in self.cuts:
            found = []
            for plane in self._planes(piece):
                sides = _sides(piece, plane)
                if all(self._in_one(side) for side in sides):
                    found.append((max(self.lack(side) for side in sides), plane))
            self.cuts[key] = sorted(found, key=lambda one: round(one[0], 3))
        return self.cuts[key]

    def _planes(self, piece: Floats) -> Iterator[CutPlane]:
        """Planes half way between bodies of a piece, a few for each way to part them."""
        inside = (self.bodies.start @ piece[:, :3].T <= piece[:, 3]).all(axis=1)
        which = np.flatnonzero(inside)
        low, high = (reach[:, which] for reach in self.bodies.reach(self.normals))
        order = np.argsort(low, axis=1)
        low = np.take_along_axis(low, order, axis=1)
        high = np.maximum.accumulate(np.take_along_axis(high, order, axis=1), axis=1)
        gap = low[:, 1:] - high[:, :-1]
        below = np.cumsum(1 << which[order].astype(object), axis=1)[:, :-1]
        wide = gap >= 2 * MISS_MM
        level = (low[:, 1:] + high[:, :-1]) / 2
        normal = np.broadcast_to(np.arange(len(gap))[:, None], gap.shape)[wide]
        for rows in _groups(below[wide], gap[wide]):
            for row in rows:
                yield CutPlane(self.normals[normal[row]], float(level[wide][row]))

    def _corners(self, piece: Floats) -> Floats:
        """Points round a piece and its flanges, at most a step outside of it, (c, 3)."""
        reach = STEP_MM + 1e-9
        near = _within(self.cloud, piece, reach)
        away = np.abs(self.tops @ piece[:, :3].T - piece[:, 3])
        flange = _within(self.tops, piece, reach)
        flange &= np.asarray((away <= self.base.keys.joint_mm + reach).any(axis=1))
        points = np.vstack([self.cloud[near], self.tops[flange]])
        return points[ConvexHull(points).vertices]

    def _in_one(self, piece: Floats) -> bool:
        """Whether a piece of the wall hangs together, and is not a mere sliver."""
        inside = _within(self.middle, piece, 0.0)
        return bool(inside.sum() > inside.size / 50) and label(inside)[1] == 1


def _sides(piece: Floats, plane: CutPlane) -> tuple[Floats, Floats]:
    row = np.array([*plane.normal, plane.level])
    return np.vstack([piece, row]), np.vstack([piece, -row])


def _within(points: Floats, piece: Floats, slack: float) -> NDArray[np.bool_]:
    below = points @ piece[:, :3].T <= piece[:, 3] + slack
    return np.asarray(below.all(axis=-1))


def _groups(below: NDArray[np.object_], gap: Floats) -> Iterator[Ints]:
    """Rows of a few planes for each way to part the bodies: the widest gaps, evenly thinned."""
    ways = list(dict.fromkeys(below.tolist()))
    for way in sorted(ways):
        rows = np.flatnonzero(below == way)
        rows = rows[np.argsort(-gap[rows], kind="stable")]
        good = rows[gap[rows] >= gap[rows[0]] / 2]
        yield good[np.unique(np.linspace(0, len(good) - 1, KEPT).astype(np.int64))]


def _half_sphere(count: int) -> Floats:
    """Directions spread evenly over the half sphere x >= 0 by a spiral, (count, 3)."""
    share = (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    side = np.sqrt(1 - share**2)
    return np.stack([share, side * np.cos(turn), side * np.sin(turn)], axis=1)


def _bodies(base: BaseLayout) -> _Bodies:
    """Bosses with their numbers, and last the hub."""
    seats, hub = base.own_seats, base.hub
    start = seats.centre + seats.front[:, None] * seats.axis
    end = seats.centre + (seats.back + base.keys.relief_mm)[:, None] * seats.axis
    up = np.array([0.0, 0.0, 1.0])
    return _Bodies(
        np.vstack([start, hub.face * up]),
        np.vstack([end, hub.front * up]),
        np.append(seats.boss, max(hub.disc, hub.boss)),
    )


def _clouds(base: BaseLayout) -> tuple[Floats, Floats, Floats]:
    """The wall's middle (a, p, 3), points round all of the base (c, 3), tops of flanges (t, 3)."""
    keys = base.keys
    count = int(np.ceil((base.sector[1] - base.sector[0]) / STEP)) + 1
    azimuth = np.linspace(*base.sector, count)
    wall = [_turned(_dense(line), azimuth) for line in (base.inner, base.outer)]
    ribs = _turned(_dense(base.outline), base.ribs)
    rings = [_turned(ring, azimuth) for ring in base.rings]
    tops = _turned(_dense(offset(base.inner, keys.thickness_mm + keys.joint_height_mm)), azimuth)
    cloud = [*wall, ribs, *rings, _rims(_bodies(base))]
    points = np.vstack([one.reshape(-1, 3) for one in cloud])
    return _turned(_dense(base.middle), azimuth), points, tops.reshape(-1, 3)


def _dense(line: Floats) -> Floats:
    """A line (n, 2) with points no farther apart than a step."""
    parts = [
        np.linspace(a, b, int(np.ceil(norm(b - a) / STEP_MM)), endpoint=False)
        for a, b in pairwise(line)
    ]
    return np.vstack([*parts, line[-1:]])


def _turned(line: Floats, azimuth: Floats) -> Floats:
    """Points (a, n, 3) of a line (n, 2) of (z, r) at azimuths (a,)."""
    z, r = np.broadcast_arrays(line[:, 0], line[:, 1])
    cosine, sine = np.cos(azimuth)[:, None], np.sin(azimuth)[:, None]
    return np.stack([r * cosine, r * sine, z + 0 * cosine], axis=-1)


def _rims(bodies: _Bodies) -> Floats:
    """Corners of polygons round the ends of round bodies, (m, 2, ROUND, 3)."""
    along = (bodies.end - bodies.start) / norm(bodies.end - bodies.start)[:, None]
    one = np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)])
    one /= norm(one)[:, None]
    two = np.cross(along, one)
    turn = 2 * np.pi * np.arange(ROUND) / ROUND
    circle = np.cos(turn)[:, None] * one[:, None] + np.sin(turn)[:, None] * two[:, None]
    circle *= (bodies.radius / np.cos(np.pi / ROUND))[:, None, None]
    rims: Floats = np.stack([bodies.start, bodies.end], axis=1)[:, :, None] + circle[:, None]
    return rims

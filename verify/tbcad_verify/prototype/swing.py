"""The base rotates through its swing and touches nothing that is fixed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tbcad_verify.prototype.bodies import MeasuredPrototype, turning
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import PLACED
from tbcad_verify.report.checks import Check, CheckName, at_most, informative, short_list
from tbcad_verify.run.kept import Shared, kept
from tbcad_verify.types import Floats

SEARCH_MM = 8.0  # larger clearances are all reported as this
MIN_STEP_RAD = np.radians(0.5)  # between two samples, however near things are
TOUCH_MM3 = 0.01
BALL_SEGMENTS = 64
GRAIN_MM = 3.0  # longest edge between points on surfaces
# Points of two surfaces may be farther apart than these by this: no point of a facet is farther
# from a corner than 1/sqrt(3) of its longest edge.
BETWEEN_MM = 2 * GRAIN_MM / float(np.sqrt(3))
FARTHEST_MM = SEARCH_MM + BETWEEN_MM
CLEAR_MM = 1.0  # a distance about the axis for which one sample is enough
GROWTH = 1.5  # of a distance from one sample to the next, mostly at most
MIN_LEVER_MM = 1e-9
FILE = PLACED
CHECKS = {"swing": "mm^3", "swing clearance": "mm"}

SUNK = ("INSERT-", "DOWEL-", "MAGNET-", "LED-")  # fasteners that stand out of nothing
TITLES = {True: "fasteners of the base", False: "fasteners of stage and frame"}

NamedSolids = list[tuple[str, Any]]  # name and manifold3d solid


@dataclass(frozen=True)
class AxialSolid:
    """A solid, and how it lies about the axis."""

    name: str  # of the part
    solid: Any  # at angle zero, as manifold3d has it
    frame: Floats  # (3, 3) unit vectors along the axis and across it, as rows

    @cached_property
    def facet_boxes(self) -> Floats:
        """(2, 2, F) lower and upper bounds of each facet: along the axis, and from it, mm."""
        mesh = self.solid.to_mesh64()
        place = self.frame @ mesh.vert_properties[:, :3].T
        place = np.vstack([place, np.hypot(*place[1:])])
        corners = [place[:, one] for one in mesh.tri_verts.T]  # three of (4, F)
        low, high = reduce(np.minimum, corners), reduce(np.maximum, corners)
        # A facet is no nearer to the axis than the rectangle round it.
        nearest = np.hypot(*np.maximum(low[1:3], -high[1:3]).clip(min=0))
        return np.array([[low[0], nearest], [high[0], high[3]]])

    @cached_property
    def box(self) -> Floats:
        """(2, 2) lower and upper bounds of position along the axis and distance from it, mm."""
        low, high = self.facet_boxes
        return np.array([low.min(axis=1, initial=np.inf), high.max(axis=1, initial=0)])

    @cached_property
    def profile(self) -> Floats:
        """(P, 2) position along the axis and distance from it of points all over the surface, mm.

        No facet between them has an edge of more than `GRAIN_MM`.
        """
        corners = self.solid.refine_to_length(GRAIN_MM).to_mesh64().vert_properties[:, :3]
        along, *across = self.frame @ corners.T
        return np.stack([along, np.hypot(*across)], axis=1)

    @cached_property
    def tree(self) -> cKDTree:
        """The points, to be searched."""
        return cKDTree(self.profile)

    @property
    def reach(self) -> float:
        """Maximum distance from the axis, mm: a corner's."""
        return float(self.box[1, 1])

    def distance_at_any_angle(self, other: AxialSolid) -> float:
        """Distance that two surfaces keep at any angle about the axis, mm; may be negative.

        It is infinite where it is more than `SEARCH_MM`, which for most pairs boxes of facets show.
        """
        if max(self._facets_apart(other), other._facets_apart(self)) > FARTHEST_MM:
            return np.inf
        low, high = self.profile.min(axis=0) - FARTHEST_MM, self.profile.max(axis=0) + FARTHEST_MM
        near = other.profile[((other.profile >= low) & (other.profile <= high)).all(axis=1)]
        distance = self.tree.query(near, distance_upper_bound=FARTHEST_MM)[0]
        return float(np.min(distance, initial=np.inf)) - BETWEEN_MM

    def _facets_apart(self, other: AxialSolid) -> float:
        """Lower bound of the distance at any angle, mm: of own facets from the other's box."""
        one, two = self.facet_boxes, other.box[:, :, None]
        apart = np.hypot(*np.maximum(one[0] - two[1], two[0] - one[1]).clip(min=0))
        return float(apart.min(initial=np.inf))


@dataclass(frozen=True)
class PairSweep:
    """The sweep of one rotating part past one fixed part."""

    names: tuple[str, str]  # of both
    volume: float  # maximum that they share, mm^3
    gap: float  # minimum distance, mm; at most `SEARCH_MM`
    at: float  # base angle of the worse of both, rad
    samples: int = 1  # number of angles


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    measured: MeasuredPrototype,
    closed: Mapping[str, Any],
) -> list[Check]:
    """Rotate the base from end to end of its swing."""
    swing, clearance = names
    swung, fixed = _groups(measured, closed)
    moving = [axial_solid(measured, *one) for one in swung]
    room, ends = room_of(moving, context.frame), swing_ends(measured)
    still = [axial_solid(measured, name, solid ^ room) for name, solid in fixed]
    shared = Shared(moving)
    past = [sweeps_past(one, shared, ends) for one in still]
    sweeps = [one for of_moving in zip(*past, strict=True) for one in of_moving]
    volume = max((one.volume for one in sweeps), default=0.0)
    nearest = min(sweeps, key=lambda one: one.gap, default=None)
    hits = [
        f"{' and '.join(one.names)} share {one.volume:.3g} mm^3 at {np.degrees(one.at):.1f} deg"
        for one in sorted(sweeps, key=lambda one: -one.volume)
        if one.volume > TOUCH_MM3
    ]
    where = "nothing is fixed beside the base"
    if nearest:
        at = f"{' to '.join(nearest.names)} at {np.degrees(nearest.at):.1f} deg"
        where = at if nearest.gap < SEARCH_MM else "or more everywhere"
    return [
        at_most(swing, volume, TOUCH_MM3, short_list(hits)),
        informative(clearance, nearest.gap if nearest else SEARCH_MM, where),
    ]


def _groups(
    measured: MeasuredPrototype, solids: Mapping[str, Any]
) -> tuple[NamedSolids, NamedSolids]:
    """Bodies that rotate with the base, and those that do not; screws and nuts are one each.

    What is on the shaft rotates in its bearings, and is left out.
    """
    import manifold3d

    prototype, swung = measured.context.prototype, turning(measured.context, solids)
    driven = {one.name for one in prototype.bought if one.turns}
    apart = {one.name for one in prototype.fasteners} | driven
    groups: dict[bool, NamedSolids] = {True: _ball_solids(measured), False: []}
    for name in sorted(solids.keys() - apart):
        if not name.startswith("ball_"):
            groups[name in swung].append((name, solids[name]))
    for turns, title in TITLES.items():
        some = [one for one in prototype.fasteners if one.turns == turns]
        screws = [solids[one.name] for one in some if not one.part.startswith(SUNK)]
        if screws:
            groups[turns].append((title, manifold3d.Manifold.compose(screws)))
    return groups[True], groups[False]


def room_of(moving: Sequence[AxialSolid], frame: Floats) -> Any:
    """A box that solids do not leave at any angle, and `FARTHEST_MM` round it.

    What is fixed outside it cannot matter.
    """
    import manifold3d

    ends = np.array([one.box for one in moving]).reshape(-1, 2, 2)
    low = ends[:, 0, 0].min(initial=0) - FARTHEST_MM
    high, reach = ends[:, 1].max(axis=0, initial=0) + FARTHEST_MM
    cube = manifold3d.Manifold.cube([high - low, 2 * reach, 2 * reach])
    return cube.translate([low, -reach, -reach]).transform(np.c_[frame.T, np.zeros(3)])


def swing_ends(measured: MeasuredPrototype) -> tuple[float, float]:
    """First and last angle of the base, rad."""
    first, last = np.radians(measured.context.prototype.swing).tolist()
    return first, last


@kept("checks of the swing")
def sweeps_past(still: AxialSolid, moving: Shared, ends: tuple[float, float]) -> list[PairSweep]:
    """The sweeps of all rotating solids (`AxialSolid`) past one that is fixed."""
    return [sweep(ends, one, still) for one in moving.value]


def sweep(ends: tuple[float, float], moving: AxialSolid, still: AxialSolid) -> PairSweep:
    """Rotate one solid past another that is fixed, each step no larger than their distance allows.

    Where both touch is no farther from the axis than either of them reaches, so no point of it
    moves more than that distance times the step. No step is smaller than `MIN_STEP_RAD`. Where
    their positions along the axis and distances from it keep both apart, no sample is needed: a
    body inside another is so at angle zero too, where all are tested against all.
    """
    low, high = ends
    names = (moving.name, still.name)
    bound = moving.distance_at_any_angle(still)
    if bound >= CLEAR_MM:
        return PairSweep(names, 0.0, min(SEARCH_MM, bound), low)
    lever = max(min(moving.reach, still.reach), MIN_LEVER_MM)
    at, samples, volume, worst, gap, distance = low, 0, 0.0, low, SEARCH_MM, SEARCH_MM
    while True:
        distance, shared = _gap_and_volume(*_placed(moving, still, at), distance)
        samples += 1
        if shared > volume or (volume == 0 and distance < gap):
            worst = at
        volume, gap = max(volume, shared), min(gap, distance)
        if at >= high:
            return PairSweep(names, volume, gap, worst, samples)
        at = min(at + max(distance / lever, MIN_STEP_RAD), high)


def _gap_and_volume(one: Any, two: Any, before: float) -> tuple[float, float]:
    """Distance of two solids, mm, `SEARCH_MM` at most, and the volume that they share, mm^3.

    One of both is 0. Solids that overlapped at the angle before mostly still do, and near the
    distance before the search is short.
    """
    if before == 0 and not (both := one ^ two).is_empty():
        return 0.0, float(both.volume())
    near = GROWTH * before
    distance = float(one.min_gap(two, near)) if 0 < near < SEARCH_MM else near
    if not distance < near:
        distance = float(one.min_gap(two, SEARCH_MM))
    return distance, 0.0 if distance > 0 else float((one ^ two).volume())


def _placed(moving: AxialSolid, still: AxialSolid, angle: float) -> tuple[Any, Any]:
    """Both solids as they lie to each other at a base angle, rad.

    The one with fewer facets is rotated: the other's are sorted in space only once.
    """
    back = moving.solid.num_tri() > still.solid.num_tri()
    turned, other = (still.solid, moving.solid) if back else (moving.solid, still.solid)
    angles = np.array([-angle if back else angle])
    rotation = Rotation.from_rotvec(angles[:, None] * moving.frame[0]).as_matrix()[0]
    turned = turned.transform(np.hstack([rotation, np.zeros((3, 1))]))
    return (other, turned) if back else (turned, other)


def axial_solid(measured: MeasuredPrototype, name: str, solid: Any) -> AxialSolid:
    """A solid about the base's axis."""
    return AxialSolid(name, solid, measured.context.frame)


def _ball_solids(measured: MeasuredPrototype) -> NamedSolids:
    """All purchased balls as one solid of polyhedra that contain them."""
    import manifold3d

    which = np.flatnonzero(~measured.context.prototype.balls.cap)
    if not which.size:
        return []
    radius = measured.body_radius[which] / np.cos(np.pi / BALL_SEGMENTS) ** 2
    polyhedra = [
        manifold3d.Manifold.sphere(r, BALL_SEGMENTS).translate(centre)
        for r, centre in zip(radius.tolist(), measured.body.T[which], strict=True)
    ]
    return [("the balls", manifold3d.Manifold.compose(polyhedra))]

"""The base rotates through its swing and touches nothing that is fixed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import combinations
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    informative,
    short_list,
)
from tbcad_verify.types import Floats

SEARCH_MM = 8.0  # larger clearances are all reported as this
MIN_STEP_RAD = np.radians(0.5)  # between two samples, however near things are
TOUCH_MM3 = 0.01
# Faces in contact, as of screwed parts, overlap by the error of facets and float32.
CONTACT_MM3 = 1.0
BALL_SEGMENTS = 64
GRAINS_MM = (8.0, 4.0, 2.0)  # of points on surfaces, few to many
GRAIN_MM = GRAINS_MM[-1]
BETWEEN_MM = 2 * GRAIN_MM  # more than points of two surfaces are farther apart than these
CLEAR_MM = 1.0  # a distance about the axis for which one sample is enough
GROWTH = 1.5  # of a distance from one sample to the next, mostly at most
MIN_LEVER_MM = 1e-9
# Points may be farther apart than their surfaces by this for each millimetre of grain: no point of
# a facet is farther from a corner than 1/sqrt(3) of its longest edge.
OFF_SURFACE = 1 / float(np.sqrt(3))
FAR_MM = 1e3  # reported of a prototype with one ball
NAMED = 3  # pairs of parts
CHECKS = {
    "swing": "mm^3",
    "swing clearance": "mm",
    "swing angles": "angles",
    "parts apart": "mm^3",
    "balls apart": "mm",
}

NamedSolids = list[tuple[str, Any]]  # name and manifold3d solid


@dataclass(frozen=True)
class SurfacePoints:
    """Points all over a surface, as they lie about the axis."""

    profile: Floats  # (P, 2) position along the axis and distance from it, mm
    grain: float  # longest edge between them, mm

    @cached_property
    def tree(self) -> cKDTree:
        """The points, to be searched."""
        return cKDTree(self.profile)

    def distance_at_any_angle(self, other: SurfacePoints, limit: float) -> float:
        """Distance that two surfaces keep at any angle about the axis, mm; may be negative.

        It is infinite where it is more than a limit, mm.
        """
        between = OFF_SURFACE * (self.grain + other.grain)
        farthest = limit + between
        low, high = self.profile.min(axis=0) - farthest, self.profile.max(axis=0) + farthest
        near = other.profile[((other.profile >= low) & (other.profile <= high)).all(axis=1)]
        distance = self.tree.query(near, distance_upper_bound=farthest)[0]
        return float(np.min(distance, initial=np.inf)) - between


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

    def points(self, grain: float) -> SurfacePoints:
        """Points with a grain of `GRAINS_MM`, made once."""
        if grain not in self._by_grain:
            corners = self.solid.refine_to_length(grain).to_mesh64().vert_properties[:, :3]
            along, *across = self.frame @ corners.T
            profile = np.stack([along, np.hypot(*across)], axis=1)
            self._by_grain[grain] = SurfacePoints(profile, grain)
        return self._by_grain[grain]

    @cached_property
    def _by_grain(self) -> dict[float, SurfacePoints]:
        return {}

    @property
    def reach(self) -> float:
        """Maximum distance from the axis, mm: a corner's."""
        return float(self.box[1, 1])


@dataclass(frozen=True)
class PairSweep:
    """The sweep of one rotating part past one fixed part."""

    names: tuple[str, str]  # of both
    volume: float  # maximum that they share, mm^3
    gap: float  # minimum distance, mm; at most `SEARCH_MM`
    at: float  # base angle of the worse of both, rad
    samples: int  # number of angles
    blind: float  # by how much a step exceeded what the distance allows, at most, rad; 0: never
    rough: bool = False  # whether the gap is only known to be no less

    @property
    def pair(self) -> str:
        """Both names."""
        return " and ".join(self.names)


def checks(
    names: list[CheckName],
    measured: MeasuredPrototype,
    parts: list[MeasuredPart],
    bought: NamedSolids,
    on_base: NamedSolids,
) -> list[Check]:
    """Rotate the base from end to end of its swing, and test whether parts fit at angle zero.

    Args:
        names: of the checks.
        measured: the prototype.
        parts: printed.
        bought: what is bought and fixed.
        on_base: what is bought and rotates with the base, without the balls.
    """
    swing, clearance, samples, apart, balls = names
    rotating, fixed = _solids(parts, "base", "cap"), _solids(parts, "stage", "frame")
    moving = [axial_solid(measured, *one) for one in [*rotating, *on_base, *_ball_solids(measured)]]
    still = [axial_solid(measured, *one) for one in [*fixed, *bought]]
    pairs = [(one, two) for one in moving for two in still]
    sweeps = _nearest_exactly(pairs, [sweep(measured, *pair) for pair in pairs])
    volume = max((one.volume for one in sweeps), default=0.0)
    nearest = min(sweeps, key=lambda one: one.gap, default=None)
    hits = [
        f"{one.pair} share {one.volume:.3g} mm^3 at {np.degrees(one.at):.1f} deg"
        for one in sorted(sweeps, key=lambda one: -one.volume)
        if one.volume > TOUCH_MM3
    ]
    return [
        at_most(swing, volume, TOUCH_MM3, short_list(hits)),
        informative(clearance, nearest.gap if nearest else SEARCH_MM, _clearance_text(nearest)),
        informative(samples, sum(one.samples for one in sweeps), _step_text(sweeps)),
        _parts_apart(apart, [rotating, fixed]),
        _balls_apart(balls, measured),
    ]


def sweep(measured: MeasuredPrototype, moving: AxialSolid, still: AxialSolid) -> PairSweep:
    """Rotate one solid past another, each step no larger than their distance allows.

    Where both touch is no farther from the axis than either of them reaches, so no point of it
    moves more than that distance times the step. No step is smaller than `MIN_STEP_RAD`. Where
    their positions along the axis and distances from it keep both apart, one sample is enough.

    Args:
        measured: the prototype; its swing and its axis.
        moving: at angle zero.
        still: fixed.
    """
    low, high = np.radians(measured.context.prototype.swing).tolist()
    names = (moving.name, still.name)
    if _boxes_apart(moving, still):
        return PairSweep(names, 0.0, SEARCH_MM, low, 1, 0.0)
    bound, rough = _bound_at_any_angle(moving, still)
    if bound >= CLEAR_MM:
        shared = _volume_inside(measured, moving, still, low)
        return PairSweep(names, shared, min(SEARCH_MM, bound), low, 1, 0.0, rough)
    lever = max(min(moving.reach, still.reach), MIN_LEVER_MM)
    at, samples, blind = low, 0, 0.0
    volume, worst, gap, distance = 0.0, low, SEARCH_MM, SEARCH_MM
    while True:
        one, two = _placed(measured, moving, still, at)
        distance, shared = _gap_and_volume(one, two, distance)
        samples += 1
        if shared > volume or (volume == 0 and distance < gap):
            worst = at
        volume, gap = max(volume, shared), min(gap, distance)
        if at >= high:
            return PairSweep(names, volume, gap, worst, samples, blind)
        step = max(distance / lever, MIN_STEP_RAD)
        blind = max(blind, min(step, high - at) - distance / lever)
        at = min(at + step, high)


def _nearest_exactly(
    pairs: list[tuple[AxialSolid, AxialSolid]], sweeps: list[PairSweep]
) -> list[PairSweep]:
    """The sweeps of some pairs, with the gap of each that may be the smallest."""
    nearest = min((one.gap for one in sweeps if not one.rough), default=SEARCH_MM)
    return [
        replace(one, gap=min(SEARCH_MM, _distance_at_any_angle(*pair)), rough=False)
        if one.rough and one.gap <= nearest
        else one
        for pair, one in zip(pairs, sweeps, strict=True)
    ]


def _gap_and_volume(one: Any, two: Any, before: float) -> tuple[float, float]:
    """Distance of two solids, mm, and the volume that they share, mm^3; one of both is 0.

    Solids that overlapped at the angle before mostly still do: then the distance is not searched.
    """
    if before == 0 and not (both := one ^ two).is_empty():
        return 0.0, float(both.volume())
    distance = _gap(one, two, before)
    return distance, 0.0 if distance > 0 else float((one ^ two).volume())


def _volume_inside(
    measured: MeasuredPrototype, moving: AxialSolid, still: AxialSolid, angle: float
) -> float:
    """Volume, mm^3, that two solids share whose surfaces never meet: one is inside the other.

    It is where its positions along the axis are between those of the other, its farthest point
    from the axis is nearer than the other's, and its box is in the other's; else no volume need be
    worked out.
    """
    if not (_may_be_inside(moving, still) or _may_be_inside(still, moving)):
        return 0.0
    one, two = _placed(measured, moving, still, angle)
    if not (_box_inside(one, two) or _box_inside(two, one)):
        return 0.0
    return float((one ^ two).volume())


def _may_be_inside(inner: AxialSolid, outer: AxialSolid) -> bool:
    low, high = inner.box
    return bool(low[0] >= outer.box[0, 0] and (high <= outer.box[1]).all())


def _box_inside(inner: Any, outer: Any) -> bool:
    """Whether the box of a solid is in that of another."""
    (low, high), (least, most) = (np.reshape(one.bounding_box(), (2, 3)) for one in (inner, outer))
    return bool((low >= least).all() and (high <= most).all())


def _gap(one: Any, two: Any, before: float) -> float:
    """Distance of two solids, mm, `SEARCH_MM` at most; 0 where they share room.

    Args:
        one: a solid; it may be inside the other.
        two: another.
        before: the distance at the angle before, mm: near it the search is short.
    """
    if 0 < (near := GROWTH * before) < SEARCH_MM and (distance := one.min_gap(two, near)) < near:
        return float(distance)
    return float(one.min_gap(two, SEARCH_MM))


def _placed(
    measured: MeasuredPrototype, moving: AxialSolid, still: AxialSolid, angle: float
) -> tuple[Any, Any]:
    """Both solids as they lie to each other at a base angle, rad.

    The one with fewer facets is rotated: the other's are sorted in space only once.
    """
    if moving.solid.num_tri() > still.solid.num_tri():
        return moving.solid, _rotated(measured, still, -angle)
    return _rotated(measured, moving, angle), still.solid


def _rotated(measured: MeasuredPrototype, one: AxialSolid, angle: float) -> Any:
    """A solid rotated about the base's axis by an angle, rad."""
    rotation = measured.context.base_rotation(np.array([angle])).as_matrix()[0]
    return one.solid.transform(np.hstack([rotation, np.zeros((3, 1))]))


def axial_solid(measured: MeasuredPrototype, name: str, solid: Any) -> AxialSolid:
    """A solid about the base's axis."""
    return AxialSolid(name, solid, measured.context.frame)


def _boxes_apart(one: AxialSolid, two: AxialSolid) -> bool:
    """Whether two solids are farther apart at any angle than points of them are searched for."""
    return bool(_box_distance(one.box, two.box) > SEARCH_MM + BETWEEN_MM)


def _facet_box_distance(one: AxialSolid, two: AxialSolid) -> float:
    """Lower bound of their distance at any angle, mm: of one's facets from the other's box."""
    from_two = _box_distance(one.facet_boxes, two.box[:, :, None]).min(initial=np.inf)
    from_one = _box_distance(two.facet_boxes, one.box[:, :, None]).min(initial=np.inf)
    return float(max(from_two, from_one))


def _box_distance(one: Floats, two: Floats) -> Any:
    """Distances of boxes as of `AxialSolid.box` or `facet_boxes`, mm."""
    return np.hypot(*np.maximum(one[0] - two[1], two[0] - one[1]).clip(min=0))


def _distance_at_any_angle(one: AxialSolid, two: AxialSolid) -> float:
    """Distance that two solids' surfaces keep at any angle about the axis, mm; by many points."""
    return one.points(GRAIN_MM).distance_at_any_angle(two.points(GRAIN_MM), SEARCH_MM)


def _bound_at_any_angle(one: AxialSolid, two: AxialSolid) -> tuple[float, bool]:
    """The same, or where it is `CLEAR_MM` or more a bound below it; and whether it is a bound.

    For most pairs that are far apart, boxes of facets show it without any points. Few points are
    within the grain of the many, and so mostly show on which side of `CLEAR_MM` the distance is.
    They are searched farther than `SEARCH_MM`: what they do not find, the many would not find.
    """
    off = 2 * OFF_SURFACE * GRAIN_MM
    apart = _facet_box_distance(one, two)
    if apart > SEARCH_MM + BETWEEN_MM:
        return np.inf, False
    if apart - off >= CLEAR_MM:
        return apart - off, True
    for grain in GRAINS_MM[:-1]:
        few = one.points(grain).distance_at_any_angle(two.points(grain), SEARCH_MM + BETWEEN_MM)
        if np.isinf(few):
            return np.inf, False
        if few - off >= CLEAR_MM:
            return few - off, True
        # The many are farther apart than these by `off` at most, which their distance is without.
        if few + 2 * OFF_SURFACE * grain < CLEAR_MM:
            return -np.inf, False
    return _distance_at_any_angle(one, two), False


def _solids(parts: list[MeasuredPart], *roles: str) -> NamedSolids:
    return [(part.part.name, part.solid) for part in of_roles(parts, *roles)]


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


def _clearance_text(nearest: PairSweep | None) -> str:
    if nearest is None:
        return "nothing is fixed beside the base"
    if nearest.gap >= SEARCH_MM:
        return "or more everywhere"
    return f"{' to '.join(nearest.names)} at {np.degrees(nearest.at):.1f} deg"


def _step_text(sweeps: list[PairSweep]) -> str:
    blind = [one for one in sweeps if one.blind > 0]
    if not blind:
        return "no step moves a point farther than the parts are apart"
    pairs = ", ".join(one.pair for one in blind[:NAMED])
    return f"steps of {np.degrees(MIN_STEP_RAD):g} deg where {pairs} are nearer than that allows"


def _parts_apart(name: CheckName, groups: list[NamedSolids]) -> Check:
    """Parts that are assembled overlap nowhere, at angle zero."""
    shared = [
        (float((a ^ b).volume()), f"{one} and {two}")
        for group in groups
        for (one, a), (two, b) in combinations(group, 2)
    ]
    worst = sorted((pair for pair in shared if pair[0] > CONTACT_MM3), reverse=True)
    texts = [f"{pair} {volume:.3g} mm^3" for volume, pair in worst]
    volume = max((volume for volume, _ in shared), default=0.0)
    return at_most(name, volume, CONTACT_MM3, f"share room: {short_list(texts)}")


def _balls_apart(name: CheckName, measured: MeasuredPrototype) -> Check:
    """Minimum distance between two balls, or caps' bodies."""
    radius = measured.body_radius
    one, two = np.triu_indices(radius.size, 1)
    gap = pdist(measured.body.T) - radius[one] - radius[two]
    texts = [f"balls {one[k] + 1} and {two[k] + 1} overlap" for k in np.flatnonzero(gap < 0)]
    return at_least(name, float(gap.min(initial=FAR_MM)), 0, short_list(texts))

"""The base rotates through its swing and touches nothing that is fixed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from tbcad_verify.prototype.measured_parts import MeasuredPart, manifold, of_roles
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
GRAIN_MM = 2.0  # of points on surfaces
CLEAR_MM = 1.0  # a distance about the axis for which one sample is enough
MIN_LEVER_MM = 1e-9
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
class AxialSolid:
    """A solid, and how it lies about the axis.

    Attributes:
        name: of the part.
        solid: at angle zero, as manifold3d has it.
        reach: maximum distance from the axis, mm.
        profile: (P, 2) position along the axis and distance from it of points all over the
            surface, mm.
    """

    name: str
    solid: Any
    reach: float
    profile: Floats

    @cached_property
    def tree(self) -> cKDTree:
        """The profile's points, to be searched."""
        return cKDTree(self.profile)


@dataclass(frozen=True)
class PairSweep:
    """The sweep of one rotating part past one fixed part.

    Attributes:
        names: of both.
        volume: maximum that they share, mm^3.
        gap: minimum distance, mm; at most `SEARCH_MM`.
        at: base angle of the worse of both, rad.
        samples: number of angles.
        blind: by how much a step exceeded what the distance allows, at most, rad; 0: never.
    """

    names: tuple[str, str]
    volume: float
    gap: float
    at: float
    samples: int
    blind: float

    @property
    def pair(self) -> str:
        """Both names."""
        return " and ".join(self.names)


def checks(
    names: list[CheckName],
    measured: MeasuredPrototype,
    parts: list[MeasuredPart],
    bought: NamedSolids,
) -> list[Check]:
    """Rotate the base from end to end of its swing, and test whether parts fit at angle zero.

    Args:
        names: of the checks.
        measured: the prototype.
        parts: printed.
        bought: purchased parts that are fixed.
    """
    swing, clearance, samples, apart, balls = names
    rotating, fixed = _solids(parts, "base", "cap"), _solids(parts, "stage", "frame")
    moving = [axial_solid(measured, *one) for one in [*rotating, *_ball_solids(measured)]]
    still = [axial_solid(measured, *one) for one in [*fixed, *bought]]
    sweeps = [sweep(measured, one, two) for one in moving for two in still]
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
    lever = max(min(moving.reach, still.reach), MIN_LEVER_MM)
    bound = _distance_at_any_angle(moving, still)
    names = (moving.name, still.name)
    if bound >= CLEAR_MM:
        one, two = _placed(measured, moving, still, low)
        return PairSweep(names, (one ^ two).volume(), min(SEARCH_MM, bound), low, 1, 0.0)
    at, samples, blind = low, 0, 0.0
    volume, worst, gap = 0.0, low, SEARCH_MM
    while True:
        one, two = _placed(measured, moving, still, at)
        distance = one.min_gap(two, SEARCH_MM)  # 0 where they share room, also one inside the other
        shared = 0.0 if distance > 0 else (one ^ two).volume()
        samples += 1
        if shared > volume or (volume == 0 and distance < gap):
            worst = at
        volume, gap = max(volume, shared), min(gap, distance)
        if at >= high:
            return PairSweep(names, volume, gap, worst, samples, blind)
        step = max(distance / lever, MIN_STEP_RAD)
        blind = max(blind, min(step, high - at) - distance / lever)
        at = min(at + step, high)


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
    """Measure a solid about the base's axis."""
    points = solid.refine_to_length(GRAIN_MM).to_mesh64().vert_properties[:, :3]
    along = points @ measured.context.frame[0]
    out = np.linalg.norm(np.cross(points, measured.context.frame[0]), axis=1)
    return AxialSolid(name, solid, float(out.max(initial=0)), np.stack([along, out], axis=1))


def _distance_at_any_angle(one: AxialSolid, two: AxialSolid) -> float:
    """Distance that two solids keep at any angle about the axis, mm; may be negative.

    It is infinite where it is more than `SEARCH_MM`. No point of a facet is farther from a corner
    than 1/sqrt(3) of its longest edge.
    """
    between = 2 * GRAIN_MM / float(np.sqrt(3))
    farthest = SEARCH_MM + between
    low, high = one.profile.min(axis=0) - farthest, one.profile.max(axis=0) + farthest
    near = two.profile[((two.profile >= low) & (two.profile <= high)).all(axis=1)]
    distance = one.tree.query(near, distance_upper_bound=farthest)[0]
    return float(np.min(distance, initial=np.inf)) - between


def _solids(parts: list[MeasuredPart], *roles: str) -> NamedSolids:
    return [
        (part.part.name, manifold(part.placed_mesh.points, part.placed_mesh.faces))
        for part in of_roles(parts, *roles)
    ]


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

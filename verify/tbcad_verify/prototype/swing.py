"""The base goes through its swing and touches nothing that stands still."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.prototype import axis
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype
from tbcad_verify.report.checks import Check, at_least, at_most, informative, short_list
from tbcad_verify.types import Floats

SEARCH_MM = 8.0  # clearances beyond this are not told apart
LEAST_RAD = np.radians(0.5)  # between two looks, however near things are
TOUCH_MM3 = 0.01
# Faces that lie on each other, as screwed parts do, overlap by what facets and float32 make of it.
CONTACT_MM3 = 1.0
CORNERS = 64  # round a ball
GRAIN_MM = 2.0  # of points on surfaces
CLEAR_MM = 1.0  # that keeps parts apart without a second look
CHECKS = {
    "swing": "mm^3",
    "swing clearance": "mm",
    "looks over the swing": "looks",
    "parts apart": "mm^3",
    "balls apart": "mm",
}


@dataclass(frozen=True)
class AxialSolid:
    """A solid, and how it lies about the axis.

    Attributes:
        name: of the part.
        solid: at angle zero.
        reach: largest distance from the axis, mm.
        profile: (P, 2) place along the axis and distance from it of points all over the surface.
    """

    name: str
    solid: Any
    reach: float
    profile: Floats


@dataclass(frozen=True)
class PairSweep:
    """What one pair of a turning and a standing part comes to.

    Attributes:
        names: of both.
        volume: largest they share, mm^3.
        gap: least distance, mm; at most `SEARCH_MM`.
        at: base angle of the worse of both, rad.
        looks: angles looked at.
        blind: largest turn between two looks beyond what their distance allows, rad; 0: none.
    """

    names: tuple[str, str]
    volume: float
    gap: float
    at: float
    looks: int
    blind: float


def checks(
    measured: MeasuredPrototype,
    bodies: list[MeasuredPart],
    bought: list[tuple[str, Any]],
    files: str,
) -> list[Check]:
    """Turn the base from end to end of its swing, and look whether parts fit at angle zero.

    Args:
        measured: the prototype.
        bodies: printed parts.
        bought: solids of purchased parts that stand still, by name.
        files: that all of this is from.
    """
    swing, clearance, looks, apart, balls = ((name, files, unit) for name, unit in CHECKS.items())
    turning = [(one.part.name, one.placed_mesh) for one in of_roles(bodies, "base", "cap")]
    standing = [(one.part.name, one.placed_mesh) for one in of_roles(bodies, "stage", "frame")]
    moving = [_mover(measured, name, solid_of(mesh)) for name, mesh in turning] + _balls(measured)
    solids = [(name, solid_of(mesh)) for name, mesh in standing]
    still = [_mover(measured, name, solid) for name, solid in [*solids, *bought]]
    found = [sweep(measured, one, two) for one in moving for two in still]
    volume = max((one.volume for one in found), default=0.0)
    least = min(found, key=lambda one: one.gap, default=None)
    hits = [
        f"{one.names[0]} and {one.names[1]} share {one.volume:.3g} mm^3 "
        f"at {np.degrees(one.at):.1f} deg"
        for one in sorted(found, key=lambda one: -one.volume)
        if one.volume > TOUCH_MM3
    ]
    return [
        at_most(swing, volume, TOUCH_MM3, short_list(hits)),
        informative(clearance, least.gap if least else SEARCH_MM, _nearest(least)),
        informative(looks, sum(one.looks for one in found), _how(found)),
        _apart(apart, [turning, standing]),
        _room(balls, measured),
    ]


def sweep(measured: MeasuredPrototype, moving: AxialSolid, still: AxialSolid) -> PairSweep:
    """Turn one solid past another, each step no larger than their distance allows.

    What comes to touch lies no farther from the axis than either of both: no point of it moves
    more than that distance times the step. No step is smaller than `LEAST_RAD`. Where even their
    distances from the axis and along it keep both apart, one look does.

    Args:
        measured: the prototype; its swing and its axis.
        moving: at angle zero.
        still: what stands.
    """
    low, high = np.radians(measured.context.prototype.swing)
    lever = max(min(moving.reach, still.reach), 1e-9)
    apart = _apart_anyhow(moving, still)
    at, looks, blind = float(low), 0, 0.0
    worst, where, gap = 0.0, float(low), min(SEARCH_MM, apart) if apart >= CLEAR_MM else SEARCH_MM
    while True:
        solid = moving.solid.transform(_turn(measured, at))
        shared = float((solid ^ still.solid).volume())
        looks += 1
        if apart >= CLEAR_MM:
            return PairSweep((moving.name, still.name), shared, gap, at, looks, 0.0)
        away = float(solid.min_gap(still.solid, SEARCH_MM))
        if shared > worst or (worst == 0 and away < gap):
            where = at
        worst, gap = max(worst, shared), min(gap, away)
        if at >= high:
            break
        step = max(away / lever, LEAST_RAD)
        blind = max(blind, min(step, high - at) - away / lever)
        at = min(at + step, float(high))
    return PairSweep((moving.name, still.name), worst, gap, where, looks, max(blind, 0.0))


def _mover(measured: MeasuredPrototype, name: str, solid: Any) -> AxialSolid:
    points = solid.refine_to_length(GRAIN_MM).to_mesh64().vert_properties[:, :3]
    along = points @ measured.context.frame[0]
    out = np.linalg.norm(np.cross(points, measured.context.frame[0]), axis=1)
    return AxialSolid(name, solid, float(out.max(initial=0)), np.stack([along, out], axis=1))


def _apart_anyhow(one: AxialSolid, two: AxialSolid) -> float:
    """Distance that two solids keep however they are turned about the axis, mm; may be negative.

    No point of a facet is farther from a corner than 1/sqrt(3) of its longest edge.
    """
    away = np.asarray(cKDTree(one.profile).query(two.profile)[0])
    return float(away.min()) - 2 * GRAIN_MM / float(np.sqrt(3))


def solid_of(mesh: Mesh) -> Any:
    """A mesh as manifold3d has it."""
    import manifold3d

    points = np.ascontiguousarray(mesh.points)
    return manifold3d.Manifold(manifold3d.Mesh64(points, mesh.faces.astype(np.uint64)))


def _balls(measured: MeasuredPrototype) -> list[AxialSolid]:
    """All bought balls as one body of polyhedra that hold them."""
    import manifold3d

    which = np.flatnonzero(~measured.context.prototype.balls.cap)
    if not which.size:
        return []
    grown = 1 / np.cos(np.pi / CORNERS) ** 2
    solids = [
        manifold3d.Manifold.sphere(grown * measured.body_radius[k], CORNERS).translate(
            measured.body[:, k]
        )
        for k in which.tolist()
    ]
    return [_mover(measured, "the balls", manifold3d.Manifold.compose(solids))]


def _turn(measured: MeasuredPrototype, angle: float) -> Floats:
    """(3, 4) the base's turn by an angle."""
    turned = axis.turned(np.eye(3), measured.context.frame[0][:, None], np.array(angle))
    return np.hstack([turned, np.zeros((3, 1))])


def _nearest(least: PairSweep | None) -> str:
    if least is None:
        return "nothing stands beside the base"
    if least.gap >= SEARCH_MM:
        return "or more everywhere"
    return f"{least.names[0]} to {least.names[1]} at {np.degrees(least.at):.1f} deg"


def _how(found: list[PairSweep]) -> str:
    blind = [one for one in found if one.blind > 0]
    if not blind:
        return "no step turns farther than the parts are apart"
    said = ", ".join(f"{one.names[0]} and {one.names[1]}" for one in blind[:3])
    return f"steps of {np.degrees(LEAST_RAD):g} deg where {said} are nearer than that allows"


def _apart(name: tuple[str, str, str], groups: list[list[tuple[str, Mesh]]]) -> Check:
    """Parts that are put together share no room, at angle zero."""
    shared = []
    for group in groups:
        solids = [(title, solid_of(mesh)) for title, mesh in group]
        for (one, a), (two, b) in combinations(solids, 2):
            shared.append(((a ^ b).volume(), f"{one} and {two}"))
    worst = sorted((pair for pair in shared if pair[0] > CONTACT_MM3), reverse=True)
    most = max((volume for volume, _ in shared), default=0.0)
    said = [f"{names} {volume:.3g} mm^3" for volume, names in worst]
    return at_most(name, most, CONTACT_MM3, f"share room: {short_list(said)}")


def _room(name: tuple[str, str, str], measured: MeasuredPrototype) -> Check:
    """Least distance between two balls, or caps' bodies."""
    k = np.arange(measured.body_radius.size)
    one, two = (index.ravel() for index in np.meshgrid(k, k, indexing="ij"))
    away = np.linalg.norm(measured.body[:, one] - measured.body[:, two], axis=0)
    away = np.where(one < two, away - measured.body_radius[one] - measured.body_radius[two], np.inf)
    worst = int(away.argmin())
    least = float(min(away[worst], 1e3))
    return at_least(name, least, 0, f"balls {one[worst] + 1} and {two[worst] + 1} overlap")

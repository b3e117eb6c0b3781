"""Where three pads put a ball: planes from the base's facets, and the sphere that touches them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.triangle_distances import Corners, distances, to_segments
from tbcad_verify.report.checks import (
    Check,
    Unknown,
    at_least,
    at_most,
    guarded,
    informative,
    worst_offenders,
)
from tbcad_verify.types import Floats, Ints

# A facet may be a pad's if it faces the ball to within this, near where the record has the pad.
FACING = np.cos(np.radians(5.0))
NEAR_MM = 1.0
# Facets of one plane: all their corners are this near to it.
FLAT_MM = 2e-3
# The ball touches a pad at least this share of the pad's radius inside its edge.
INSIDE = 0.5
SUNK_MM = 1e-3
ROOM_MM = 2.0  # beyond the ball, in which facets are looked at
CHECKS = {
    "ball centres": "um",
    "pads": "mm",
    "balls clear": "mm",
    "room round balls": "mm",
}


@dataclass(frozen=True)
class MeasuredSeats:
    """Where the pads put K balls.

    Attributes:
        centre: (K, 3) mm; NaN where no three pads were found.
        margin: (K,) least distance of a contact from the edge of its pad less what is wanted, mm.
        clear: (K,) least distance of the ball from all of the base but its pads, mm.
        reason: K texts, why a centre is not known.
    """

    centre: Floats
    margin: Floats
    clear: Floats
    reason: tuple[str, ...]


def measure_seats(context: PrototypeContext, base: Mesh) -> MeasuredSeats:
    """Recover the balls' centres from the mesh of all base parts, in the frame."""
    found = [_one(context, base, k) for k in range(len(context.prototype.balls))]
    return MeasuredSeats(
        np.array([one[0] for one in found]),
        np.array([one[1] for one in found]),
        np.array([one[2] for one in found]),
        tuple(one[3] for one in found),
    )


def checks(context: PrototypeContext, held: MeasuredSeats, files: str) -> list[Check]:
    """Centres against the record, contacts against the pads, balls against the base."""
    centre, pads, clear, room = ((name, files, unit) for name, unit in CHECKS.items())
    away = 1000 * norm(held.centre.T - context.prototype.balls.columns("bx", 3))
    lost = [f"ball {k + 1}: {why}" for k, why in enumerate(held.reason) if why]
    limit = context.prototype.pad_um
    return [
        at_most(
            centre,
            np.inf if lost else float(away.max()),
            limit,
            "; ".join(lost[:3]) or _worst(context, away, away > limit, "um"),
        ),
        at_least(pads, float(held.margin.min()), 0, _worst(context, -held.margin, held.margin < 0)),
        at_least(
            clear, float(held.clear.min()), -SUNK_MM, _worst(context, -held.clear, held.clear < 0)
        ),
        informative(room, float(held.clear.min())),
    ]


def _worst(
    context: PrototypeContext, values: Floats, bad: NDArray[np.bool_], unit_: str = "mm"
) -> str:
    order = np.argsort(-values, kind="stable")
    names = context.prototype.balls.names(np.arange(values.size))
    return worst_offenders(names, values, unit_, order[bad[order]], ".3g")


def _one(context: PrototypeContext, base: Mesh, k: int) -> tuple[Floats, float, float, str]:
    """Centre, margin and clearance of one ball; or why they are not known."""
    balls, seat = context.prototype.balls, context.prototype.seats[k]
    radius = float(balls.body_radius_mm[k])
    try:
        near = _around(base, balls.columns("bx", 3)[:, k], radius + ROOM_MM)
        pads = [_pad(base, near, seat.contacts[j], seat.normals[j], seat.pad / 2) for j in range(3)]
        centre = touching([pad[0] for pad in pads], [pad[1] for pad in pads], radius)
    except Unknown as error:
        return np.full(3, np.nan), -np.inf, -np.inf, str(error)
    wanted = INSIDE * seat.pad / 2
    margin = min(_margin(base, facets, normal, centre) for normal, _, facets in pads) - wanted
    others = np.setdiff1d(near, np.concatenate([facets for _, _, facets in pads]))
    clear = float(distances(centre, _corners(base, others)).min(initial=np.inf)) - radius
    return centre, margin, clear, ""


def touching(normals: list[Floats], offsets: list[float], radius: float) -> Floats:
    """(3,) centre of the sphere that lies on three planes n.x = d, on the sides n points to.

    Raises:
        Unknown: the planes do not meet in a point.
    """
    matrix = np.array(normals)
    if abs(float(np.linalg.det(matrix))) < 1e-3:
        raise Unknown("the pads' planes do not meet in a point")
    return np.asarray(np.linalg.solve(matrix, np.array(offsets) + radius))


def _around(mesh: Mesh, middle: Floats, reach: float) -> Ints:
    """Facets whose box comes nearer to a point than this."""
    corners = mesh.points[mesh.faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    gap = np.maximum(np.maximum(low - middle, middle - high), 0)
    return np.flatnonzero((gap**2).sum(axis=1) < reach**2)


def _pad(
    mesh: Mesh, near: Ints, contact: Floats, normal: Floats, radius: float
) -> tuple[Floats, float, Ints]:
    """Plane n.x = d of one pad as its facets have it, and these facets.

    The record says only where to begin: the largest facet there that faces the ball. All facets
    in its plane that hang together with it are the pad.

    Raises:
        Unknown: nothing there faces the ball.
    """
    own = unit(mesh.area[:, near])
    middle = mesh.points[mesh.faces[near]].mean(axis=1) - contact
    along = middle @ normal
    across = np.linalg.norm(middle - along[:, None] * normal, axis=1)
    facing = (dot(own, np.broadcast_to(normal[:, None], own.shape)) > FACING) & (across < radius)
    facing &= np.abs(along) < NEAR_MM
    if not facing.any():
        raise Unknown("no pad where the record has one")
    candidates = near[facing]
    size = norm(mesh.area[:, candidates])
    seed = candidates[int(size.argmax())]
    n = mesh.area[:, seed] / size.max()
    # A second round, with the plane of all facets instead of the first one's.
    for _ in range(2):
        level = (mesh.points[mesh.faces[near]] - mesh.points[mesh.faces[seed, 0]]) @ n
        flat = near[(np.abs(level) < FLAT_MM).all(axis=1) & (own.T @ n > 0)]
        facets = _linked(mesh, flat, seed)
        n = unit(mesh.area[:, facets].sum(axis=1)[:, None])[:, 0]
    points = mesh.points[np.unique(mesh.faces[facets])]
    return n, float((points @ n).mean()), facets


def _linked(mesh: Mesh, facets: Ints, seed: np.intp) -> Ints:
    """Those of some facets that hang together with one."""
    allowed = set(facets.tolist())
    found, todo = {int(seed)}, [int(seed)]
    while todo:
        here = todo.pop()
        for half in mesh.twin[3 * here : 3 * here + 3].tolist():
            other = half // 3
            if half >= 0 and other in allowed and other not in found:
                found.add(other)
                todo.append(other)
    return np.array(sorted(found), dtype=np.intp)


def _margin(mesh: Mesh, facets: Ints, normal: Floats, centre: Floats) -> float:
    """Distance of where a ball touches a pad from the pad's edge, mm; negative outside."""
    half = (3 * facets[:, None] + np.arange(3)).ravel()
    rim = half[~np.isin(mesh.twin[half] // 3, facets)]
    start = mesh.points[mesh.faces.ravel()[rim]].T
    end = mesh.points[np.roll(mesh.faces, -1, axis=1).ravel()[rim]].T
    level = float(start.T[0] @ normal)
    foot = centre + (level - float(centre @ normal)) * normal
    away = float(to_segments(np.broadcast_to(foot[:, None], start.shape), start, end).min())
    a, b = start - foot[:, None], end - foot[:, None]
    turn = np.arctan2(normal @ np.cross(a.T, b.T).T, dot(a, b)).sum() / (2 * np.pi)
    return away if abs(turn) > 0.5 else -away


def _corners(mesh: Mesh, facets: Ints) -> Corners:
    a, b, c = (mesh.points[mesh.faces[facets, k]].T for k in range(3))
    return a, b, c


def seat_checks(
    context: PrototypeContext, base: Mesh, files: str
) -> tuple[MeasuredSeats | None, list[Check]]:
    """Both, guarded."""
    found: list[MeasuredSeats] = []

    def work() -> list[Check]:
        found.append(measure_seats(context, base))
        return checks(context, found[0], files)

    made = guarded([(name, files, unit_) for name, unit_ in CHECKS.items()], work)
    return (found[0] if found else None), made

"""Where three pads put a ball: planes from the base's facets, and the sphere that touches them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tbcad_verify.mesh.mesh import Mesh, connected_groups
from tbcad_verify.mesh.segments import half_edge_vectors
from tbcad_verify.mesh.vectors import cross, distances_to_segments, dot, norm, rotation_angles, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_least,
    at_most,
    informative,
    worst_offenders,
)
from tbcad_verify.types import Floats, Ints

PAD_UM = 10.0  # largest error of a ball's centre that its pads may cause
# A facet may be a pad's if it faces the ball to within this, near where the record has the pad.
FACING_COS = np.cos(np.radians(5.0))
NEAR_MM = 1.0
# Facets of one plane: all their corners are this near to it.
FLAT_MM = 2e-3
# The ball must touch a pad at least this share of the pad's radius inside its edge.
INSIDE = 0.5
SUNK_MM = 1e-3
SEARCH_MM = 2.0  # beyond the ball, in which facets are searched
MIN_DETERMINANT = 1e-3  # of the pads' normals, for the planes to meet in a point
LISTED = 3  # balls without three pads
FILE = ("base",)
CHECKS = {"ball centres": "um", "pads": "mm", "balls clear": "mm", "ball clearance": "mm"}


Boxes = tuple[Floats, Floats]
"""Lower and upper corners (F, 3) of boxes, mm."""


@dataclass(frozen=True)
class MeasuredSeat:
    """Where the pads put one ball."""

    centre: Floats  # (3,) mm; NaN where no three pads were found
    # minimum distance of a contact from the edge of its pad less the required one, mm
    margin: float
    clear: float  # minimum distance of the ball from all of the base but its pads, mm
    reason: str = ""  # why the centre is not known; empty where it is


class Pad(NamedTuple):
    """A plane n.x = d, n toward the ball, and its facets."""

    normal: Floats
    offset: float
    facets: Ints


def measure_seats(context: PrototypeContext, base: Mesh) -> list[MeasuredSeat]:
    """Recover the balls' centres from the mesh of all base parts, in the frame of the shell.

    The spec moves pads off the balls by what a printer adds to them: as printed they touch.
    """
    a, b, c = (np.take(base.points, base.faces[:, k], axis=0) for k in range(3))
    boxes = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return [_seat(context, base, boxes, k) for k in range(len(context.prototype.balls))]


def centre_errors(context: PrototypeContext, seats: list[MeasuredSeat]) -> Floats:
    """(K,) distances of the balls' centres from the recorded ones, um; NaN where not known."""
    centre = np.array([seat.centre for seat in seats]).T
    return 1000 * norm(centre - context.prototype.balls.columns("bx", 3))


def checks(
    names: list[CheckName], context: PrototypeContext, seats: list[MeasuredSeat]
) -> list[Check]:
    """Centres against the record, contacts against the pads, balls against the base."""
    centre, pads, clear, clearance = names
    ids, error = context.prototype.balls.names(np.arange(len(seats))), centre_errors(context, seats)
    missing = [f"ball {k}: {seat.reason}" for k, seat in enumerate(seats, 1) if seat.reason]
    margin = np.array([seat.margin for seat in seats])
    gap = np.array([seat.clear for seat in seats])
    off = worst_offenders(ids, error, "um", error > PAD_UM, ".3g")
    aside, sunk = (worst_offenders(ids, -x, "mm", x < 0, ".3g") for x in (margin, gap))
    worst, said = np.inf if missing else float(error.max()), "; ".join(missing[:LISTED])
    return [
        at_most(centre, worst, PAD_UM, said or off),
        at_least(pads, float(margin.min()), 0, aside),
        at_least(clear, float(gap.min()), -SUNK_MM, sunk),
        informative(clearance, float(gap.min())),
    ]


def _seat(context: PrototypeContext, base: Mesh, boxes: Boxes, k: int) -> MeasuredSeat:
    balls, seat = context.prototype.balls, context.prototype.seats[k]
    radius, pad_radius = float(balls.body_radius_mm[k]), seat.pad / 2
    try:
        near = _facets_near(boxes, balls.columns("bx", 3)[:, k], radius + SEARCH_MM)
        pads = [
            _pad(base, near, contact, normal, pad_radius)
            for contact, normal in zip(seat.contacts, seat.normals, strict=True)
        ]
        off = radius + context.export.spec.prototype.base.pad_offset_mm
        centre = touching_sphere([p.normal for p in pads], [p.offset for p in pads], off)
    except Unknown as error:
        return MeasuredSeat(np.full(3, np.nan), -np.inf, -np.inf, str(error))
    margin = min(_margin(base, pad, centre) for pad in pads)
    others = np.setdiff1d(near, np.concatenate([pad.facets for pad in pads]))
    return MeasuredSeat(centre, margin, distance_to_facets(centre, base, others) - radius)


def touching_sphere(normals: list[Floats], offsets: list[float], radius: float) -> Floats:
    """(3,) centre of the sphere that lies on three planes n.x = d, on the sides n points to.

    Unknown: the planes do not meet in a point.
    """
    matrix = np.array(normals)
    if abs(float(np.linalg.det(matrix))) < MIN_DETERMINANT:
        raise Unknown("the pads' planes do not meet in a point")
    return np.asarray(np.linalg.solve(matrix, np.array(offsets) + radius))


def _facets_near(boxes: Boxes, point: Floats, distance: float) -> Ints:
    """Facets whose box is nearer to a point than a distance, mm."""
    low, high = boxes
    gap = np.maximum(np.maximum(low - point, point - high), 0)
    return np.flatnonzero((gap**2).sum(axis=1) < distance**2)


def _pad(mesh: Mesh, near: Ints, contact: Floats, normal: Floats, radius: float) -> Pad:
    """One pad as its facets have it.

    The record gives only the starting point: the largest facet there that faces the ball. All
    facets in its plane that are connected with it are the pad.

    Unknown: nothing there faces the ball.
    """
    normals = unit(mesh.area[:, near])
    offset = mesh.points[mesh.faces[near]].mean(axis=1) - contact
    height = offset @ normal
    aside = np.linalg.norm(offset - height[:, None] * normal, axis=1)
    facing = dot(normals, np.broadcast_to(normal[:, None], normals.shape)) > FACING_COS
    facing &= (aside < radius) & (np.abs(height) < NEAR_MM)
    if not facing.any():
        raise Unknown("no pad where the record has one")
    candidates = near[facing]
    size = norm(mesh.area[:, candidates])
    seed = candidates[int(size.argmax())]
    n = mesh.area[:, seed] / size.max()
    # A second round, with the plane of all facets instead of the first one's.
    for _ in range(2):
        level = (mesh.points[mesh.faces[near]] - mesh.points[mesh.faces[seed, 0]]) @ n
        flat = near[(np.abs(level) < FLAT_MM).all(axis=1) & (normals.T @ n > 0)]
        facets = _connected(mesh, flat, seed)
        n = unit(mesh.area[:, facets].sum(axis=1)[:, None])[:, 0]
    points = mesh.points[np.unique(mesh.faces[facets])]
    return Pad(n, float((points @ n).mean()), facets)


def _connected(mesh: Mesh, facets: Ints, seed: np.intp) -> Ints:
    """Those of some facets (F,) that are connected with one of them, ascending."""
    number = np.full(len(mesh.faces), -1)
    number[facets] = np.arange(facets.size)
    half, other = _sides(mesh, facets)
    inner = (other >= 0) & (number[other] >= 0)
    label = connected_groups(facets.size, number[half[inner] // 3], number[other[inner]])[1]
    return np.asarray(facets[label == label[number[seed]]])


def _sides(mesh: Mesh, facets: Ints) -> tuple[Ints, Ints]:
    """(3 F,) half-edges of some facets, and the facet beyond each; -1 for none."""
    half = (3 * facets[:, None] + np.arange(3)).ravel()
    return half, mesh.twin[half] // 3


def _margin(mesh: Mesh, pad: Pad, centre: Floats) -> float:
    """Distance of where a ball touches a pad from the pad's edge, mm, less the required one.

    Of the radius of a disc of the pad's area: the recorded one might be of any size.
    """
    radius = float(np.sqrt(norm(mesh.area[:, pad.facets]).sum() / 2 / np.pi))
    half, other = _sides(mesh, pad.facets)
    start, edge = half_edge_vectors(mesh, half[~np.isin(other, pad.facets)])
    contact = centre + (start.T[0] - centre) @ pad.normal * pad.normal
    x, normal = (np.broadcast_to(v[:, None], start.shape) for v in (contact, pad.normal))
    distance = float(distances_to_segments(x, start, start + edge).min())
    turns = rotation_angles(normal, start - x, start + edge - x).sum() / (2 * np.pi)
    return (distance if abs(turns) > 0.5 else -distance) - INSIDE * radius


def distance_to_facets(point: Floats, mesh: Mesh, facets: Ints) -> float:
    """Minimum distance of a point (3,) from some facets of a mesh, mm; infinite without any.

    Facets without area are left out: their edges are their neighbours' too.
    """
    solid = facets[norm(mesh.area[:, facets]) > 0]
    normal, corner = (
        unit(mesh.area[:, solid]),
        mesh.points[mesh.faces[solid]].T - point[:, None, None],
    )
    distance, above = np.full(solid.size, np.inf), np.ones(solid.size, dtype=np.bool_)
    for k in range(3):
        start, end = corner[:, k], corner[:, (k + 1) % 3]
        above &= dot(cross(normal, end - start), start) <= 0
        distance = np.minimum(distance, distances_to_segments(np.zeros((3, 1)), start, end))
    distance[above] = np.abs(dot(normal, corner[:, 0]))[above]
    return float(distance.min(initial=np.inf))

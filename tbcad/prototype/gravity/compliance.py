"""Compliances of parts: what forces, moments and their own weight move, in mm, N and radians."""

from dataclasses import dataclass

import numpy as np
from trimesh import Trimesh

from tbcad.common.reuse import kept
from tbcad.core.geometry.vectors import norm
from tbcad.prototype.drive.balance import GRAVITY
from tbcad.prototype.gravity.elastic import Cells, fill_cells, hold
from tbcad.types import Bools, Floats, Ints

N_PER_G = GRAVITY * 1e-3  # weight of a gram, newtons
CELL_MM = 5.0


@dataclass(frozen=True)
class Material:
    """Material of a printed part."""

    modulus: float  # of solid material, GPa
    density: float  # of solid material, g/cm^3
    infill: float  # share of the inside that is filled


@dataclass(frozen=True)
class Bodies:
    """Bodies that a part carries, k of them."""

    centre: Floats  # mm, (k, 3)
    reach: Floats  # radius of the part's material about each that moves with it, mm, (k,)
    mass: Floats  # grams, (k,)


@dataclass(frozen=True)
class Axle:
    """A cylinder that a part is held on."""

    start: Floats  # ends of its axis, mm, (3,)
    end: Floats
    radius: float  # mm


@kept("weight")
def sag_of_bodies(part: Trimesh, bodies: Bodies, axle: Axle, material: Material) -> Floats:
    """Displacements of bodies' centres, mm, then small turns of their seats, radians, (k, 6, 3).

    Under one g along each axis, which is the last; the part is held on the axle.
    """
    cells = fill_cells(part, CELL_MM, material.infill)
    elastic = hold(cells, _near_axle(cells, axle))
    weight = cells.nodal * material.density * 1e-3 * N_PER_G
    load = weight[:, None, None] * np.eye(3)
    seats = [_rigid_fit(cells, *seat) for seat in zip(bodies.centre, bodies.reach, strict=True)]
    for (nodes, fit), mass in zip(seats, bodies.mass, strict=True):
        load[nodes] += fit[:3].transpose(1, 2, 0) * mass * N_PER_G
    moved = elastic.solve(load) / (material.modulus * 1e3)
    return np.stack([np.einsum("anb,nbg->ag", fit, moved[nodes]) for nodes, fit in seats])


@kept("weight")
def compliance(
    part: Trimesh, at: Floats, held: list[Axle], loaded: list[Axle], material: Material
) -> Floats:
    """Motion of the material round some cylinders under unit forces and moments on it, (6, 6).

    Rows are a shift at the point `at` (3,) and a small turn, mm and radians; columns forces there
    (N) and moments (N mm). The part is held round other cylinders.
    """
    cells = fill_cells(part, CELL_MM, material.infill)
    elastic = hold(cells, np.any([_near_axle(cells, axle) for axle in held], axis=0))
    nodes = np.flatnonzero(np.any([_near_axle(cells, axle) for axle in loaded], axis=0))
    fit = _fit(cells, nodes, at)
    load = np.zeros((len(cells.node), 3, 6))
    load[nodes] = fit.transpose(1, 2, 0)
    moved = elastic.solve(load)[nodes] / (material.modulus * 1e3)
    return np.asarray(np.einsum("anb,nbg->ag", fit, moved))


def _near_axle(cells: Cells, axle: Axle) -> Bools:
    """Which nodes are no more than a cube out of a cylinder."""
    along = (axle.end - axle.start) / norm(axle.end - axle.start)
    from_start = cells.node - axle.start
    distance = from_start @ along
    out = norm(from_start - distance[:, None] * along)
    beyond = CELL_MM / 2
    inside = (distance > -beyond) & (distance < norm(axle.end - axle.start) + beyond)
    return np.asarray(inside & (out < axle.radius + CELL_MM))


def _rigid_fit(cells: Cells, centre: Floats, reach: float) -> tuple[Ints, Floats]:
    nodes = np.flatnonzero(norm(cells.node - centre) < reach + CELL_MM)
    return nodes, _fit(cells, nodes, centre)


def _fit(cells: Cells, nodes: Ints, centre: Floats) -> Floats:
    """The rigid motion about a centre that fits the motions of nodes (m,) best, (6, m, 3)."""
    share = np.sqrt(cells.nodal[nodes])
    motion = rigid_motion(cells.node[nodes] - centre)
    weighed = np.linalg.pinv((motion * share[:, None, None]).reshape(-1, 6))
    return np.asarray((weighed * np.repeat(share, 3)).reshape(6, len(nodes), 3))


def rigid_motion(arm: Floats) -> Floats:
    """Displacements of places (n, 3) by a unit shift and a small turn about a centre, (n, 3, 6)."""
    turn = np.cross(np.eye(3)[None], arm[:, None]).transpose(0, 2, 1)
    return np.concatenate([np.broadcast_to(np.eye(3), turn.shape), turn], axis=2)


def shaft_compliance(overhang: float, span: float, stiffness: float) -> Floats:
    """Motion of a shaft's overhanging end under forces and moments there, (6, 6).

    Simply supported at two bearings a span apart, mm; bending stiffness E I in N mm^2 (Roark's
    Formulas for Stress and Strain, table 8.1). The overhang is toward +x; stretch and twist are
    left out.
    """
    a, s = overhang, span
    shift, mixed = a**2 * (s + a) / 3, a * (2 * s + 3 * a) / 6
    turn = s / 3 + a
    found = np.zeros((6, 6))
    found[1, 1] = found[2, 2] = shift
    found[1, 5] = found[5, 1] = mixed
    found[2, 4] = found[4, 2] = -mixed
    found[4, 4] = found[5, 5] = turn
    return found / stiffness


def column_compliance(length: float, bending: float, twisting: float) -> Floats:
    """Motion of the top of a column along +z, held at its foot, (6, 6).

    Bending stiffness E I and twisting stiffness G J in N mm^2, the same both ways.
    """
    found = np.zeros((6, 6))
    found[0, 0] = found[1, 1] = length**3 / 3 / bending
    found[0, 4] = found[4, 0] = length**2 / 2 / bending
    found[1, 3] = found[3, 1] = -(length**2) / 2 / bending
    found[3, 3] = found[4, 4] = length / bending
    found[5, 5] = length / twisting
    return found


def best_motions(place: Floats, moved: Floats) -> Floats:
    """Shifts and small turns about the origin (n, 6) that fit displacements (n, k, 3) best, mm.

    Of places (k, 3).
    """
    motion = rigid_motion(place).reshape(-1, 6)
    return np.asarray(moved.reshape(len(moved), -1) @ np.linalg.pinv(motion).T)


def moved_to(compliance: Floats, arm: Floats) -> Floats:
    """The compliance (6, 6) of a place at an arm (3,) from the one it was of."""
    motion = np.eye(6)
    motion[:3] = rigid_motion(arm[None])[0]
    return np.asarray(motion @ compliance @ motion.T)


def turned_to(compliance: Floats, axes: Floats) -> Floats:
    """A compliance (6, 6) in another frame, whose axes are the rows of (3, 3)."""
    both = np.kron(np.eye(2), axes)
    return np.asarray(both @ compliance @ both.T)

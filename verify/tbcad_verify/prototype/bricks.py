"""Linear elasticity of a printed part on bricks of twenty nodes (serendipity, quadratic).

The part need not be meshed: bricks are integrated at the middles of small cubes, which are as stiff
as what the part has there, and without stiffness outside. Millimetres, newtons, MPa.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.ndimage import distance_transform_edt
from scipy.sparse.linalg import splu

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.rays import build_scene, distances_to_planes, first_hits
from tbcad_verify.types import Bools, Floats, Ints

BRICK_MM, ALONG = 10.0, 4  # edge of a brick, and small cubes along it
STEP_MM = BRICK_MM / ALONG
WALL_MM = 1.65  # of perimeters and top and bottom layers, which are solid: four widths of a line
POISSON = 0.37  # of PETG and PLA
OUTSIDE = 1e-3  # stiffness outside, as a share, so that no node is loose
LIFT_MM = 1e-4  # of a ray beyond a facet that it has met
GRIP = 1e4  # stiffness of what holds, N/mm per mm^3
ASIDE = np.array([[0.0123456789], [0.0234567891]])  # of a column, as a share of a step: off edges
HALVES = np.array([c for c in np.ndindex(3, 3, 3) if c.count(1) <= 1])  # nodes, in half edges
POWERS = np.array([c for c in np.ndindex(3, 3, 3) if c.count(2) <= 1])  # of the monomials


@dataclass(frozen=True)
class Bricks:
    """A part of modulus 1 MPa in c bricks of q small cubes."""

    share: Floats  # of material in each small cube, (c, q)
    place: Floats  # middles of the small cubes, mm, (c, q, 3)
    node: Ints  # numbers of each brick's nodes, (c, 20)

    def solve(self, held: Bools, load: Floats) -> Floats:
        """Displacements of nodes (n, 3, m) under loads (n, 3, m), N, with small cubes held."""
        size = 3 * len(load)
        stiffness = np.maximum(self.share**2, OUTSIDE) @ _stiffness().reshape(ALONG**3, -1)
        shape = shapes()
        grip = held @ np.einsum("qi,qj->qij", shape, shape).reshape(ALONG**3, -1)
        grip = grip.reshape(-1, 20, 20) * GRIP * STEP_MM**3
        stiffness = stiffness.reshape(-1, 60, 60)
        stiffness += np.einsum("cij,ab->ciajb", grip, np.eye(3)).reshape(-1, 60, 60)
        unknown = (3 * self.node[:, :, None] + np.arange(3)).reshape(-1, 60)
        rows, columns = np.repeat(unknown, 60, axis=1), np.tile(unknown, (1, 60))
        matrix = sparse.coo_matrix(
            (stiffness.ravel(), (rows.ravel(), columns.ravel())), (size, size)
        )
        order = {"SymmetricMode": True}
        factors = splu(matrix.tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=order)
        return np.asarray(factors.solve(load.reshape(size, -1)).reshape(load.shape))

    @cached_property
    def nodes(self) -> int:
        """Number of all nodes."""
        return int(self.node.max()) + 1

    def spread(self, weight: Floats) -> Floats:
        """Shares (n,) of nodes in what small cubes carry, (c, q)."""
        carried = np.zeros(self.nodes)
        np.add.at(carried, self.node, weight @ shapes())
        return carried


def fill_bricks(mesh: Mesh, infill: float) -> Bricks:
    """The bricks that a closed mesh is in; deeper than the printed walls there is infill only."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    count = np.ceil((high - low) / BRICK_MM).astype(int) + 1
    origin = (low + high - count * BRICK_MM) / 2
    inside = _inside(mesh, origin, count * ALONG)
    depth = distance_transform_edt(inside, STEP_MM)
    deep = np.clip((depth - WALL_MM) / STEP_MM, 0.0, 1.0)
    grid = np.repeat(count, 2)
    grid[1::2] = ALONG
    grid[::2] = count
    cells = (inside - (1 - infill) * deep).reshape(grid).transpose(0, 2, 4, 1, 3, 5)
    brick = np.argwhere(cells.any(axis=(3, 4, 5)))
    numbers = np.ravel_multi_index(
        tuple((2 * brick[:, None] + HALVES).reshape(-1, 3).T), tuple(2 * count + 1)
    )
    _, node = np.unique(numbers, return_inverse=True)
    share = cells[tuple(brick.T)].reshape(len(brick), -1)
    place = (brick[:, None] + _middles()) * BRICK_MM + origin
    return Bricks(share, place, node.reshape(-1, 20))


def shapes() -> Floats:
    """Shape functions at the middles of a brick's small cubes, (q, 20)."""
    return _monomials(_middles(), POWERS) @ _coefficients()


def _inside(mesh: Mesh, origin: Floats, shape: Ints) -> Bools:
    """Which small cubes' middles are inside: by what rays along z enter and leave."""
    scene, (x, y, z) = build_scene(mesh), shape
    column = np.stack(np.meshgrid(np.arange(x), np.arange(y), indexing="ij")).reshape(2, -1)
    start = np.vstack([(column + 0.5 + ASIDE) * STEP_MM + origin[:2, None], np.zeros(x * y)])
    start[2] = origin[2] - STEP_MM
    up, winding = np.zeros_like(start), np.zeros((x * y, z + 1), dtype=np.int16)
    up[2] = 1.0
    rays, before = np.arange(x * y), np.full(x * y, -1)
    while rays.size:
        facet = first_hits(scene, start[:, rays], up[:, rays])
        rays, facet = rays[facet >= 0], facet[facet >= 0]
        ahead = distances_to_planes(scene, facet, start[:, rays], up[:, rays])
        start[2, rays] += np.maximum(ahead, 0.0)
        level = np.ceil((start[2, rays] - origin[2]) / STEP_MM - 0.5).clip(0, z).astype(int)
        # A steep facet may be met again beyond it, for hits are found in single precision.
        sign = np.where(scene.planes[facet, 2] < 0, 1, -1) * (facet != before[rays])
        np.add.at(winding, (rays, level), sign)
        before[rays] = facet
        start[2, rays] += LIFT_MM
    return np.asarray(np.cumsum(winding, axis=1)[:, :-1].reshape(shape) > 0)


def _middles() -> Floats:
    """Of the small cubes, as shares of a brick's edge, (q, 3)."""
    return (np.array([*np.ndindex(ALONG, ALONG, ALONG)]) + 0.5) / ALONG


def _monomials(place: Floats, powers: Ints) -> Floats:
    return np.asarray(np.prod(place[:, None] ** powers, axis=2))


def _coefficients() -> Floats:
    return np.asarray(np.linalg.inv(_monomials(HALVES / 2, POWERS)))


def _stiffness() -> Floats:
    """Of each small cube of modulus 1 MPa by its brick's unknowns, (q, 60, 60)."""
    slopes = []
    for axis in range(3):
        lower = POWERS - np.eye(3, dtype=int)[axis]
        slope = POWERS[:, axis] * _monomials(_middles(), np.maximum(lower, 0))
        slopes.append(slope @ _coefficients() / BRICK_MM)
    by = np.stack(slopes, axis=2)
    lame, shear = POISSON / (1 + POISSON) / (1 - 2 * POISSON), 0.5 / (1 + POISSON)
    pairs = np.einsum("qia,qjb->qiajb", by, by)
    same = np.einsum("qicjc,ab->qiajb", pairs, np.eye(3))
    whole = lame * pairs + shear * (pairs.transpose(0, 1, 4, 3, 2) + same)
    return np.asarray(whole.reshape(-1, 60, 60) * STEP_MM**3)

"""Linear elasticity of a printed part on a grid of cubes, by the finite cell method.

The part need not be meshed: a cube that its surface cuts is stiff where it is inside and nearly
without stiffness outside, integrated over sub-cubes (Duester, Parvizian, Yang, Rank 2008, Comput.
Methods Appl. Mech. Eng. 197, 3768). A face is found to half a sub-cube, so large parts do better
than thin ones. Eight-node cubes lock in bending, so each has the quadratic modes of Wilson (Taylor,
Beresford, Wilson 1976, Int. J. Numer. Meth. Eng. 10, 1211), condensed. Millimetres, newtons, MPa.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import distance_transform_edt
from scipy.sparse.linalg import SuperLU, splu
from trimesh import Trimesh

from tbcad.types import Bools, Floats

SUB = 4  # sub-cubes along an edge of a cube
OUTSIDE = 1e-3  # stiffness of what is outside, as a share
WALL_MM = 1.65  # of solid material below a surface: four perimeters, as print times have it
EXPONENT = 2.0  # stiffness of infill goes as its density to this (Gibson and Ashby 1997, ch. 5)
POISSON = 0.37  # of printed plastics (PETG, PLA: 0.35 to 0.40)
_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
# The columns through the sub-cubes' middles are moved by a share of a sub-cube that no edge of a
# drawn part shares, so that none runs along an edge.
_ASIDE = np.array([0.0123456789, 0.0234567891])


@dataclass(frozen=True)
class Cells:
    """The cubes that a part fills, c of them, on n nodes."""

    size: float  # edge of a cube, mm
    density: Floats  # of the material in each sub-cube, as a share, 0 outside, (c, SUB**3)
    corner: NDArray[np.int64]  # nodes at the corners of each cube, (c, 8)
    node: Floats  # places of the nodes, mm, (n, 3)

    @property
    def nodal(self) -> Floats:
        """Volume of solid material that each node stands for, mm^3, (n,)."""
        eighth = self.density.mean(axis=1) * self.size**3 / 8
        return np.bincount(self.corner.ravel(), np.repeat(eighth, 8)).astype(float)


def fill_cells(mesh: Trimesh, size: float, infill: float = 1.0) -> Cells:
    """The cubes of an edge `size` (mm) that a closed mesh fills wholly or in part.

    Deeper than the printed walls there is a share `infill` of material.
    """
    low, high = mesh.bounds
    shape = np.ceil((high - low) / size).astype(int) + 1
    origin = (low + high - shape * size) / 2
    inside = _inside(mesh, origin, size / SUB, shape * SUB)
    density = inside - (1 - infill) * _deep(inside, size / SUB)
    grouped = density.reshape(shape[0], SUB, shape[1], SUB, shape[2], SUB)
    share = grouped.transpose(0, 2, 4, 1, 3, 5).reshape(*shape, SUB**3)
    cube = np.argwhere(share.any(axis=3))
    corners = (cube[:, None] + _CORNERS).reshape(-1, 3)
    index = np.ravel_multi_index(tuple(corners.T), tuple(shape + 1))
    used, corner = np.unique(index, return_inverse=True)
    node = np.column_stack(np.unravel_index(used, tuple(shape + 1))) * size + origin
    return Cells(size, share[tuple(cube.T)], corner.reshape(-1, 8), node)


def _inside(mesh: Trimesh, origin: Floats, step: float, shape: Floats) -> NDArray[np.bool_]:
    """Which middles of the small cubes are inside: the winding number along columns of z."""
    place = (mesh.triangles - origin) / step - 0.5
    place[:, :, :2] -= _ASIDE
    first = np.clip(np.ceil(place[:, :, :2].min(axis=1)), 0, None).astype(int)
    last = np.minimum(np.floor(place[:, :, :2].max(axis=1)), shape[:2] - 1).astype(int)
    wide = np.maximum(last - first + 1, 0)
    owner = np.repeat(np.arange(len(place)), wide.prod(axis=1))
    start = np.repeat(np.cumsum(wide.prod(axis=1)) - wide.prod(axis=1), wide.prod(axis=1))
    along = np.arange(len(owner)) - start
    column = first[owner] + np.column_stack(np.divmod(along, wide[owner, 1]))
    one, two, three = np.moveaxis(place[owner], 1, 0)
    area = _cross(two - one, three - one)
    upright = area == 0
    second, third = (
        _cross(*sides) / np.where(upright, 1.0, area)
        for sides in ((column - one[:, :2], three - one), (two - one, column - one[:, :2]))
    )
    hit = ~upright & (second >= 0) & (third >= 0) & (second + third <= 1)
    height = one[:, 2] + second * (two - one)[:, 2] + third * (three - one)[:, 2]
    level = np.clip(np.ceil(height[hit]), 0, shape[2]).astype(int)
    winding = np.zeros((shape[0], shape[1], shape[2] + 1), np.int16)
    np.add.at(winding, (*column[hit].T, level), -np.sign(area[hit]).astype(np.int16))
    return np.asarray(np.cumsum(winding, axis=2)[:, :, :-1] > 0)


def _deep(inside: Bools, step: float) -> Floats:
    """Share of each small cube that is deeper below the surface than the printed walls."""
    return np.asarray(np.clip((distance_transform_edt(inside, step) - WALL_MM) / step, 0.0, 1.0))


def _cross(one: Floats, two: Floats) -> Floats:
    return np.asarray(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])


def _sub_stiffness(poisson: float) -> Floats:
    """Stiffness of each sub-cube of a cube of edge 1 and modulus 1, (SUB**3, 33, 33).

    Unknowns are the displacements of the eight corners, then of the three quadratic modes.
    """
    lame = poisson / (1 + poisson) / (1 - 2 * poisson)
    elastic = np.diag([1 / (1 + poisson)] * 3 + [0.5 / (1 + poisson)] * 3)
    elastic[:3, :3] += lame
    middle = (np.arange(SUB) + 0.5) / SUB
    point = np.stack(np.meshgrid(middle, middle, middle, indexing="ij"), axis=-1).reshape(-1, 3)
    slope = np.zeros((len(point), 11, 3))
    shape = np.where(_CORNERS[None] == 1, point[:, None], 1 - point[:, None])
    sign = 2.0 * _CORNERS - 1
    for axis in range(3):
        others = [a for a in range(3) if a != axis]
        slope[:, :8, axis] = sign[:, axis] * shape[:, :, others].prod(axis=2)
        slope[:, 8 + axis, axis] = 4 - 8 * point[:, axis]
    strain = np.zeros((len(point), 6, 11, 3))
    for row, (one, two) in enumerate([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]):
        strain[:, row, :, one] += slope[:, :, two]
        if one != two:
            strain[:, row, :, two] += slope[:, :, one]
    rows = strain.reshape(len(point), 6, 33)
    return np.asarray(np.einsum("pai,ab,pbj->pij", rows, elastic, rows) / SUB**3)


@dataclass(frozen=True)
class Elastic:
    """A part of modulus 1 MPa, held at some nodes: its factorised stiffness."""

    factors: SuperLU
    free: NDArray[np.int64]  # unknowns that are free, (u,)

    def solve(self, load: Floats) -> Floats:
        """Displacements of all nodes under m loads (n, 3, m) in newtons: mm at 1 MPa, (n, 3, m)."""
        moved = np.zeros((load.shape[0] * 3, load.shape[2]))
        moved[self.free] = self.factors.solve(load.reshape(moved.shape)[self.free])
        return moved.reshape(load.shape)


def hold(cells: Cells, held: Bools, poisson: float = POISSON) -> Elastic:
    """The part with the nodes (n,) that are held."""
    stiffness = _condensed(cells, poisson) * cells.size
    unknown = (3 * cells.corner[:, :, None] + np.arange(3)).reshape(-1, 24)
    rows, columns = np.repeat(unknown, 24, axis=1), np.tile(unknown, (1, 24))
    size = 3 * len(cells.node)
    entries = (stiffness.ravel(), (rows.ravel(), columns.ravel()))
    free = np.flatnonzero(np.repeat(~held, 3))
    matrix = sparse.coo_matrix(entries, (size, size)).tocsr()[free][:, free].tocsc()
    # It is symmetric and positive: no pivots, and an order that keeps the factors small.
    symmetric = {"SymmetricMode": True}
    factors = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
    return Elastic(factors, free)


def _condensed(cells: Cells, poisson: float) -> Floats:
    """Stiffness of each cube of edge 1 without the modes inside, (c, 24, 24)."""
    share = np.maximum(cells.density**EXPONENT, OUTSIDE)
    whole = (share @ _sub_stiffness(poisson).reshape(SUB**3, -1)).reshape(-1, 33, 33)
    outer, mixed, inner = whole[:, :24, :24], whole[:, :24, 24:], whole[:, 24:, 24:]
    return np.asarray(outer - mixed @ np.linalg.solve(inner, mixed.transpose(0, 2, 1)))

"""Moments of spherical cells, by integrals along their arcs.

With n the unit normal and I the unit matrix, Stokes' theorem gives on the unit sphere, of a region
with its boundary counter-clockwise,
    integral of n = 1/2 integral of n x dn,
    integral of n n^T = (area I + integral of n (n x dn)^T) / 3,
where the integrals on the right are along the boundary. They are analytic along an arc: Gauss's
rule gives them to rounding.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.optics.cells import Arcs, Cells, cell_areas
from tbcad.types import Floats, Ints

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PARAMETER, STEP = (NODES + 1) / 2, WEIGHTS / 2  # from 0 to 1


@dataclass(frozen=True)
class CellMoments:
    """Integrals over m cells on spheres, with n the unit normal away from the sphere's centre."""

    centre: Floats  # of the sphere from the origin, mm, (m, 3)
    radius: Floats  # mm, (m,)
    area: Floats  # integral of 1, mm^2, (m,)
    first: Floats  # integral of n, mm^2, (m, 3)
    second: Floats  # integral of n n^T, mm^2, (m, 3, 3)

    @property
    def volume(self) -> float:
        """Between the origin and all cells, mm^3: a third of the integral of x.n."""
        return float((self._heights + self.radius * self.area).sum()) / 3

    @property
    def volume_moment(self) -> Floats:
        """Integral of x over that volume, mm^4, (3,): a quarter of the integral of x (x.n)."""
        radius = self.radius[:, None]
        around = np.einsum("mij,mj->mi", self.second, self.centre) + radius * self.first
        along = (self._heights + self.radius * self.area)[:, None] * self.centre
        return np.asarray((along + radius * around).sum(axis=0)) / 4

    @property
    def _heights(self) -> Floats:
        return np.asarray(np.einsum("mi,mi->m", self.centre, self.first))


def cell_moments(cells: Cells, origin: Floats) -> CellMoments:
    """Moments of the cells of mirrors that are all spherical, about an origin (3,), mm."""
    m = cells.mirrors
    mirrors, arcs = cells.mirror_surfaces, cells.arcs
    radius = mirrors.radius
    centre = mirrors.apex - radius[:, None] * mirrors.normal
    area, first, second = cell_areas(cells), np.zeros((m, 3)), np.zeros((m, 3, 3))
    # Arcs run counter-clockwise about the cell on their left seen from behind the mirrors.
    for face, sign in ((arcs.left, -1.0), (arcs.right, 1.0)):
        mine = np.flatnonzero(face < m)
        of = face[mine]
        n, turning = _along(arcs, mine, centre[of], radius[of])
        np.add.at(first, of, sign * turning.sum(axis=1) / 2)
        np.add.at(second, of, sign * np.einsum("eki,ekj->eij", n, turning))
    square = radius[:, None] ** 2
    second = (area[:, None, None] * np.eye(3) + square[:, None] * second) / 3
    return CellMoments(centre - origin, radius, area, square * first, second)


def _along(arcs: Arcs, arc: Ints, centre: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Unit normals (e, k, 3) at the nodes of arcs, and n x dn there, by the weights."""
    x, dx = _places(arcs, arc)
    n = (x - centre[:, None]) / radius[:, None, None]
    return n, np.cross(n, dx / radius[:, None, None]) * STEP[:, None]


def arc_steps(arcs: Arcs, arc: Ints) -> tuple[Floats, Floats]:
    """Points (e, k, 3) on arcs (e,), mm, and the steps along the arcs that each stands for."""
    x, dx = _places(arcs, arc)
    return x, dx * STEP[:, None]


def _places(arcs: Arcs, arc: Ints) -> tuple[Floats, Floats]:
    """Points (e, k, 3) at the nodes of arcs (e,), and their derivatives by the parameter."""
    t, weight = PARAMETER, arcs.weight[arc][:, None]
    points = arcs.points[arc]
    basis = np.stack(np.broadcast_arrays((1 - t) ** 2, 2 * t * (1 - t) * weight, t**2), axis=-1)
    slope = np.stack(np.broadcast_arrays(2 * t - 2, (2 - 4 * t) * weight, 2 * t), axis=-1)
    above, below = basis @ points, basis.sum(axis=-1)[..., None]
    x = above / below
    return x, (slope @ points - slope.sum(axis=-1)[..., None] * x) / below

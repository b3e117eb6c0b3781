"""Warp of a one-piece shell: a smooth random displacement, and what it does to each mirror.

Every point x of the shell is displaced by d(x), each component of which is a Gaussian random field
(tbcad.tolerancing.montecarlo.warp). Neighbouring mirrors move, turn and bend together. A
mirror becomes the sphere with astigmatism h that fits its displaced points best: with their normals
n, n . d = n . e + r' + h, where the displacement e of the centre, the growth r' of the radius and h
are sought. Shells that are moved, turned or scaled as a whole are followed exactly.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.vectors import dot, perpendicular_axes
from tbcad.core.optics.pedestals.cells import GrooveWalls
from tbcad.tolerancing.montecarlo.form import ASTIGMATISM, monomials, term_polynomials
from tbcad.types import Floats, Ints

MISSING_VARIANCE = 1e-6  # that a field may lack at any point: 0.1 % of its standard deviation
COMPARED_DIGITS = 9  # of variances, so that rounding does not choose among equal points
RING_POINTS = 6  # of a mirror that are followed on a circle, besides its apex
RING_SHARE = 0.8


@dataclass(frozen=True)
class SmoothField:
    """A field of unit variance, as a function of K standard normal numbers."""

    points: Floats  # X, mm, (K, 3)
    length: float  # correlation length L, mm
    factor: Floats  # F, lower triangular, (K, K)

    def __len__(self) -> int:
        return len(self.points)

    def basis(self, places: Floats) -> Floats:
        """What each random number adds to the field at places (p, 3), (p, K)."""
        kernel = covariance(places, self.points, self.length)
        solved = np.linalg.solve(self.factor, kernel.T).T
        return np.ascontiguousarray(solved, dtype=np.float64)


def smooth_field(points: Floats, length: float, chosen: Ints | None = None) -> SmoothField:
    """The field of a part by its chosen points, or by `pivots` of all; nearer than the length."""
    chosen = pivots(points, length) if chosen is None else chosen
    some = points[chosen]
    factor = np.asarray(np.linalg.cholesky(covariance(some, some, length)), dtype=np.float64)
    return SmoothField(some, length, factor)


def covariance(first: Floats, second: Floats, length: float) -> Floats:
    """Covariance of a field of unit variance between points (p, 3) and (q, 3), (p, q)."""
    square = sum((first[:, None, axis] - second[None, :, axis]) ** 2 for axis in range(3))
    result: Floats = np.exp(square / (-2 * length * length))
    return result


def pivots(points: Floats, length: float) -> Ints:
    """Numbers of the points (n, 3) from whose values the field follows at all others.

    Incomplete Cholesky factorisation with the largest remaining variance as the pivot, until the
    variance that is missing, of 1, is less at all points.
    """
    left, chosen = np.ones(len(points)), list[int]()
    columns = np.empty((len(points), len(points)))
    while left.max() > MISSING_VARIANCE:
        pivot = int(np.argmax(np.round(left, COMPARED_DIGITS)))
        known = columns[:, : len(chosen)]
        column = covariance(points, points[[pivot]], length)[:, 0] - known @ known[pivot]
        columns[:, len(chosen)] = column / np.sqrt(column[pivot])
        left = np.maximum(left - columns[:, len(chosen)] ** 2, 0.0)
        left[pivot] = 0.0
        chosen.append(pivot)
    return np.array(chosen, dtype=np.int64)


@dataclass(frozen=True)
class WarpMap:
    """What K random numbers for each axis do to the m mirrors of one half."""

    basis: Floats  # of the field at q points of each mirror, the apex first, (K, m q)
    fit: Floats  # sphere and astigmatism from displacements along the normals, (m, 6, q)
    normal: Floats  # there, (m, q, 3)
    foot_basis: Floats  # of the field where each mirror is nearest to the foot plane, (m, K)
    foot_normal: Floats  # unit normal of the foot plane, (3,)
    wall_basis: Floats  # of the field in the middle of the edge at each wall of a pedestal, (K, w)
    wall_normal: Floats  # unit normals of the walls, (w, 3)

    @property
    def modes(self) -> int:
        """Number of random numbers K for each axis."""
        return len(self.basis)

    def walls_moved(self, numbers: Floats) -> Floats:
        """Displacements of the walls of one build by numbers (K, 3), along their normals, (w,)."""
        return dot(field_values(self.wall_basis, numbers).T, self.wall_normal)

    def moved(self, numbers: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Displacements of the mirrors of one build by random numbers (K, 3), mm.

        Of the centres (m, 3), by which radii grow (m,), of the foot plane at each mirror along its
        normal (m,), and factors of the two terms of astigmatism (m, 2), mm.
        """
        points = field_values(self.basis, numbers).reshape(3, *self.normal.shape[:2])
        along = np.einsum("xmq,mqx->mq", points, self.normal)
        spheres = np.einsum("mkq,mq->mk", self.fit, along)
        foot = np.einsum("mk,k->m", self.foot_basis, dot(numbers, self.foot_normal))
        return spheres[:, :3], spheres[:, 3], foot, spheres[:, 4:]


WarpMaps: TypeAlias = tuple[WarpMap, WarpMap]


@compiled_loop
def field_values(basis: Floats, numbers: Floats) -> Floats:
    """Displacements (3, p) by random numbers (K, 3) and the field's basis (K, p).

    Not by BLAS, whose threads would get into the way of those that simulate builds, and not by
    einsum, which takes three times as long.
    """
    result = np.zeros((3, basis.shape[1]))
    for k in range(len(basis)):
        x, y, z = numbers[k, 0], numbers[k, 1], numbers[k, 2]
        for p in range(basis.shape[1]):
            result[0, p] += basis[k, p] * x
            result[1, p] += basis[k, p] * y
            result[2, p] += basis[k, p] * z
    return result


def warp_map(table: Floats, cell_radius: Floats, walls: GrooveWalls, field: SmoothField) -> WarpMap:
    """What a field does to a half: see `EdgeModel` for its table (m + 2, 7) and cell radii (m,)."""
    apex, foot = table[:-2, :3], table[-1]
    points, normal = mirror_points(table[:-2], RING_SHARE * cell_radius)
    x, y = RING_SHARE * np.vstack([np.zeros(2), _circle()]).T
    astigmatism = monomials(x, y) @ term_polynomials()[list(ASTIGMATISM)].T
    height = np.broadcast_to(astigmatism, (len(apex), RING_POINTS + 1, 2))
    unknowns = np.concatenate([normal, np.ones((*normal.shape[:2], 1)), height], axis=2)
    above = dot(apex - foot[:3], foot[3:6])
    return WarpMap(
        basis=np.ascontiguousarray(field.basis(points.reshape(-1, 3)).T),
        fit=np.linalg.pinv(unknowns),
        normal=normal,
        foot_basis=field.basis(apex - above[:, None] * foot[3:6]),
        foot_normal=foot[3:6],
        wall_basis=np.ascontiguousarray(field.basis(walls.point).T),
        wall_normal=walls.normal,
    )


def _circle() -> Floats:
    angle = 2 * np.pi * np.arange(RING_POINTS) / RING_POINTS
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def mirror_points(table: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Points of mirrors (m, 7), apex and ring (m,), and unit normals there, (m, q, 3) each."""
    apex, normal, curvature = table[:, :3], table[:, 3:6], table[:, 6]
    across = radius[:, None, None] * (_circle() @ perpendicular_axes(normal))
    depth = curvature * radius**2 / (1 + np.sqrt(1 - (curvature * radius) ** 2))
    ring = across - (depth[:, None] * normal)[:, None]
    offset = np.concatenate([np.zeros((len(table), 1, 3)), ring], axis=1)
    return apex[:, None] + offset, normal[:, None] + curvature[:, None, None] * offset

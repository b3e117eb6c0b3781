"""Every other mirror and wall as a circle on a flat map of each mirror.

A mirror is a sphere or plane with apex p, unit normal N there and curvature k = 1 / r. Its map is
the tangent plane at p; a point y of the map represents x = p + d with

    d = w (y - (k / 2) |y|^2 N),   w = 1 / (1 + k^2 |y|^2 / 4),

the stereographic projection from the point opposite p, and the identity when k = 0. The part of the
mirror that another ball or half-space does not cover is, on the map,

    alpha |y|^2 + beta . y + gamma >= 0:

the inside or outside of a circle, or one side of a line. So spheres, planes and walls are one case.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import dot, take, tangent_basis
from tbcad_verify.types import Bools, Floats, Ints

COINCIDENT = 1e-12
FAR = 1e4


@dataclass(frozen=True)
class SurfaceMaps:
    """Maps of M surfaces."""

    surfaces: Surfaces  # M of them; the apex is the map's origin
    right: Floats  # (3, M) unit, the map's first axis
    up: Floats  # (3, M) unit, its second; right, up and normal are right-handed
    reach: Floats  # (M,) radius of the map, mm: to the horizon of the front side

    def take(self, index: Ints) -> SurfaceMaps:
        """The maps with these numbers."""
        return take(self, index)


@dataclass(frozen=True)
class MapCircles:
    """Circles on the maps, K on each of M, scaled so that |beta|^2 - 4 alpha gamma = 1."""

    alpha: Floats  # (M, K) 1/mm; twice this is the circle's curvature
    beta: Floats  # (2, M, K)
    gamma: Floats  # (M, K) mm
    real: NDArray[np.bool_]  # (M, K) false where the other surface does not cut the mirror
    covers: NDArray[np.bool_]  # (M, K) true where it covers the whole mirror

    def take(self, column: Ints) -> MapCircles:
        """Some of each map's circles: (M, K') numbers of columns."""
        return self.rows((np.arange(len(column))[:, None], column))

    def rows(self, index: Ints | tuple[Ints, Ints]) -> MapCircles:
        """The circles of these maps, or with these numbers of maps and columns."""
        beta = self.beta[:, *index] if isinstance(index, tuple) else self.beta[:, index]
        return MapCircles(
            self.alpha[index], beta, self.gamma[index], self.real[index], self.covers[index]
        )

    @property
    def clearance(self) -> Floats:
        """(M, K) mm, from the apex to the covered region; negative inside it."""
        distance = 2 * self.gamma / (np.hypot(*self.beta) + 1)
        return np.where(self.real, distance, np.where(self.covers, -np.inf, np.inf))


def surface_maps(surfaces: Surfaces, spread: float) -> SurfaceMaps:
    """Maps of surfaces that lie `spread` mm apart at most, to the horizon, 90 degrees off the apex.

    A plane has no horizon: its map ends far outside of everything.
    """
    far = np.full(len(surfaces.curvature), FAR * spread)
    reach = np.divide(2, surfaces.curvature, out=far, where=surfaces.curvature > 0)
    return SurfaceMaps(surfaces, *tangent_basis(surfaces.normal), reach)


def map_circles(maps: SurfaceMaps, number: Ints, others: Surfaces, spread: float) -> MapCircles:
    """What T others, walls among them, and last the horizon, leave of M maps: (M, T + 1) circles.

    `number` (M,) says which of the others each map's own surface is. Of two equal surfaces the
    first keeps what both have.
    """
    alpha, beta, gamma = _forms(maps, others)
    same = (np.abs(alpha) * spread + np.abs(beta).sum(axis=0) + np.abs(gamma) / spread) < COINCIDENT
    same_cell = number[:, None] == np.arange(len(others.curvature))
    earlier = np.arange(len(others.curvature)) < number[:, None]
    size = beta[0] ** 2 + beta[1] ** 2
    square = size - 4 * alpha * gamma
    real = (square > COINCIDENT * (size + np.abs(alpha * gamma))) & ~same & ~same_cell
    covers = ~same_cell & np.where(same, earlier, ~real & (alpha * spread + gamma / spread < 0))
    return _with_horizon(maps.reach, (alpha, beta, gamma), square, real, covers)


def plane_circles(maps: SurfaceMaps, point: Floats, normal: Floats, real: Bools) -> MapCircles:
    """What planes of its own, and last the horizon, leave of each of M maps: (M, K + 1) circles.

    `point`: (M, K, 3) mm, on the planes.
    `normal`: (M, K, 3) unit, to the side that is kept.
    `real`: (M, K) false for places in the table without a plane.
    """
    mine = maps.surfaces
    gamma = np.einsum("mkx,mkx->mk", normal, mine.point.T[:, None] - point)
    along = [np.einsum("mkx,xm->mk", normal, a) for a in (maps.right, maps.up, mine.normal)]
    k = mine.curvature[:, None]
    alpha, beta = k**2 / 4 * gamma - k * along[2] / 2, np.stack(along[:2])
    square = beta[0] ** 2 + beta[1] ** 2 - 4 * alpha * gamma
    cuts = real & (square > COINCIDENT)
    return _with_horizon(maps.reach, (alpha, beta, gamma), square, cuts, real & ~cuts & (gamma < 0))


def _forms(maps: SurfaceMaps, others: Surfaces) -> tuple[Floats, Floats, Floats]:
    """Alpha (M, T), beta (2, M, T) and gamma (M, T), not yet scaled."""
    mine = maps.surfaces
    shape = (3, len(mine.curvature), len(others.curvature))
    offset = mine.point[:, :, None] - others.point[:, None]
    slope = others.normal[:, None] + others.curvature * offset
    flat = offset.reshape(3, -1)
    height = np.broadcast_to(others.normal[:, None], shape).reshape(3, -1)
    gamma = (dot(height, flat)).reshape(shape[1:])
    gamma = gamma + others.curvature / 2 * dot(flat, flat).reshape(shape[1:])
    along = [np.einsum("im,imt->mt", a, slope) for a in (maps.right, maps.up, mine.normal)]
    k = mine.curvature[:, None]
    alpha = k**2 / 4 * gamma + (others.curvature - k * along[2]) / 2
    return alpha, np.stack(along[:2]), gamma


def _with_horizon(
    reach: Floats, form: tuple[Floats, Floats, Floats], square: Floats, real: Bools, covers: Bools
) -> MapCircles:
    """Circles of alpha, beta and gamma, scaled, and a last column: 1 - |y|^2 / reach^2 >= 0.

    `square`: (M, K) |beta|^2 - 4 alpha gamma.
    """
    scale, edge = 1 / np.sqrt(np.where(real, square, 1)), reach[:, None]
    alpha, beta, gamma = (values * scale for values in form)
    no = np.zeros_like(edge, dtype=bool)
    return MapCircles(
        np.hstack([alpha, -1 / (2 * edge)]),
        np.concatenate([beta, np.zeros((2, *edge.shape))], axis=2),
        np.hstack([gamma, edge / 2]),
        np.hstack([real, ~no]),
        np.hstack([covers, no]),
    )

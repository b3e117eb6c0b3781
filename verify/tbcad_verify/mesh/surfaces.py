"""Spheres and planes in one form, and rays that meet them.

A surface is a point p on it, its unit normal n there (out of the solid, toward the light) and its
curvature k = 1 / radius, positive where it bulges toward the light:
    (x - p).n + k/2 |x - p|^2 = 0.
A plane has k = 0, and all formulas are continuous there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.vectors import dot, nearest_on_lines, norm, take
from tbcad_verify.types import Floats


@dataclass(frozen=True)
class Surfaces:
    """N surfaces."""

    point: Floats  # (3, N) mm, on the surface
    normal: Floats  # (3, N) unit
    curvature: Floats  # (N,) 1/mm

    def take(self, index: NDArray[np.integer]) -> Surfaces:
        """The surfaces with these numbers, in this order."""
        return take(self, index)

    def coated(self, thickness: float | Floats) -> Surfaces:
        """The surfaces at this distance above, mm; (N,) or one for all."""
        return Surfaces(
            self.point + thickness * self.normal,
            self.normal,
            self.curvature / (1 + self.curvature * thickness),
        )

    def centre(self) -> Floats:
        """(3, N) sphere centres; not finite for planes."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.point - self.normal / self.curvature

    def height(self, x: Floats) -> Floats:
        """(N,) signed distances of points (3, N) from the surfaces, mm."""
        a = x - self.point
        f = dot(a, self.normal) + self.curvature / 2 * dot(a, a)
        return np.asarray(2 * f / (1 + np.sqrt(np.maximum(1 + 2 * self.curvature * f, 0))))

    def gradient(self, x: Floats) -> Floats:
        """(3, N) normals at points (3, N); unit on the surface."""
        return self.normal + self.curvature * (x - self.point)


@dataclass(frozen=True)
class ReflectedRays:
    """Reflected rays: points on the mirrors, directions, and lengths before the mirror."""

    point: Floats  # (3, N) mm, where the ray meets the mirror; NaN where it misses
    toward: Floats  # (3, N) direction after reflection, as long as the one before
    reach: Floats  # (N,) how many lengths of the incoming direction lie before the point


@dataclass(frozen=True)
class PreparedSurfaces:
    """Surfaces seen from one point: what is the same for all rays is computed once."""

    origin: Floats  # (3,) mm, where all rays start
    # (K, 8) a row a surface: m (3), C, k, q (3); a ray meets the surface where k/2 |d|^2 t^2 + d.m
    # t + C = 0, and the normal at x is q + k x
    table: Floats


def prepare_for_rays(origin: Floats, surfaces: Surfaces) -> PreparedSurfaces:
    """Prepare surfaces for rays from one point, (3,) mm."""
    a = origin[:, None] - surfaces.point
    k = surfaces.curvature
    table = np.stack(
        [
            *(surfaces.normal + k * a),
            dot(a, surfaces.normal) + k / 2 * dot(a, a),
            k,
            *(surfaces.normal - k * surfaces.point),
        ]
    )
    return PreparedSurfaces(origin, np.ascontiguousarray(table.T))


def reflect(seen: PreparedSurfaces, index: NDArray[np.integer], d: Floats) -> ReflectedRays:
    """Reflect rays of directions d (3, N) on surfaces number index (N,)."""
    row = np.take(seen.table, index, axis=0).T
    k = row[4]
    b, c = dot(d, row[:3]), row[3]
    with np.errstate(invalid="ignore"):
        # The first root, in the form that keeps its digits when k goes to zero.
        reach = 2 * c / (np.sqrt(b * b - 2 * k * c * dot(d, d)) - b)
    point = seen.origin[:, None] + reach * d
    return ReflectedRays(point, reflect_directions(d, row[5:] + k * point), reach)


def reflect_directions(d: Floats, normal: Floats) -> Floats:
    """(3, N) directions d after reflection on unit normals."""
    return d - 2 * dot(d, normal) * normal


def nearest_to_origin(rays: ReflectedRays) -> Floats:
    """(3, N) the points nearest to the origin on the lines of reflected rays, mm."""
    return nearest_on_lines(rays.point, rays.toward)


def nearest_on_rays(rays: ReflectedRays) -> Floats:
    """(3, N) the points nearest to the origin on reflected rays, not before their mirrors, mm.

    A small ball deflects rays at its rim so far that they leave away from the object.
    """
    return nearest_on_lines(rays.point, rays.toward, first=0.0)


def distance_before_mirror(surfaces: PreparedSurfaces, d: Floats, reach: Floats) -> Floats:
    """(N,) minimum distances from the origin of rays d (3, N) up to where they meet the mirror.

    `reach`: (N,) how many lengths of d lie before the mirror.
    """
    return norm(nearest_on_lines(surfaces.origin[:, None], d, last=reach))

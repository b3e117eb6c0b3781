"""Least-squares spheres and planes through the vertices of every segment at once.

In a frame of the segment's own, with z along its mean normal, the surface is
    z = h + a x + b y - k/2 (x^2 + y^2 + z^2),
linear in (h, a, b, k): that is the start. A few Gauss-Newton steps on the true distances follow,
with the same normal equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mesh import Mesh, sorted_unique
from tbcad_verify.mesh.segments import Segmentation, rounding
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import chunks, dot, norm, tangent_basis, unit
from tbcad_verify.types import Floats

STEPS = 4
RIDGE = 1e-10


@dataclass(frozen=True)
class SurfaceFits:
    """Shape of each of K segments, measured on its vertices."""

    surfaces: Surfaces  # K best spheres or planes
    form: Floats  # (K,) root mean square of the vertices' distances, mm
    chord: Floats  # (K,) largest distance of a facet's middle from the surface, mm
    extent: Floats  # (K,) distance of the farthest vertex from the segment's middle, mm
    middle: Floats  # (3, K) mean of the facets' middles by area, mm
    normal: Floats  # (3, K) mean normal by area, unit
    area: Floats  # (K,) of the facets, mm^2
    count: NDArray[np.intp]  # (K,) vertices
    # (K,) how far float32 rounding of the vertices, taken as random, can have moved a sphere's
    # centre or changed its radius, six standard deviations, mm
    blur: Floats

    @property
    def sag(self) -> Floats:
        """(K,) how far each surface bulges over its extent, mm."""
        return np.asarray(self.surfaces.curvature * self.extent**2 / 2)


@dataclass(frozen=True)
class PatchVertices:
    """Every vertex of every segment once, ordered by segment."""

    segment: NDArray[np.int64]  # (P,) ascending
    vertex: NDArray[np.int64]  # (P,)
    first: NDArray[np.intp]  # (K,) where each segment starts


@dataclass(frozen=True)
class _Frames:
    # Points in their segment's own frame, in units of its extent: (P,) each, and basis (3, 3, K).
    x: Floats
    y: Floats
    z: Floats
    basis: Floats
    origin: Floats
    extent: Floats


def patch_vertices(mesh: Mesh, segments: Segmentation) -> PatchVertices:
    """The vertices of each segment; those on creases belong to several."""
    count = len(mesh.points)
    keys = sorted_unique(np.repeat(segments.label.astype(np.int64), 3) * count + mesh.faces.ravel())
    segment, vertex = np.divmod(keys, count)
    return PatchVertices(segment, vertex, np.searchsorted(segment, np.arange(segments.count)))


def fit_surfaces(mesh: Mesh, segments: Segmentation, points: PatchVertices) -> SurfaceFits:
    """Fit a sphere or plane to each segment's vertices."""
    middle, normal, area = _means(mesh, segments)
    frames = _frames(mesh, points, middle, normal)
    basis = np.stack([np.ones_like(frames.x), frames.x, frames.y, -_square(frames) / 2])
    matrix = _moments(points, basis)
    inverse = np.linalg.inv(
        matrix + RIDGE * np.trace(matrix, axis1=1, axis2=2)[:, None, None] * np.eye(4)
    )
    solution = _times(inverse, _sums(points, basis * frames.z))
    for _ in range(STEPS):
        gap, slope = _distances(frames, points, solution)
        solution = solution + _times(inverse, _sums(points, basis * (gap * slope)))
    gap, _ = _distances(frames, points, solution)
    gap = gap * frames.extent[points.segment]
    share = np.diff(np.append(points.first, points.segment.size))
    surfaces = _surfaces(frames, solution)
    return SurfaceFits(
        surfaces,
        np.sqrt(np.add.reduceat(gap**2, points.first) / share),
        _chords(mesh, segments, surfaces),
        frames.extent,
        middle,
        normal,
        area,
        share,
        6 / 3 * rounding(mesh) * _gain(surfaces, inverse, frames.extent),
    )


def _gain(surfaces: Surfaces, inverse: Floats, extent: Floats) -> Floats:
    """How much a vertex's random error grows in a sphere's centre or radius."""
    # The inverse normal matrix is the covariance of (h, a, b, k) for unit errors.
    with np.errstate(divide="ignore"):
        radius = np.abs(1 / surfaces.curvature)
    tilt = inverse[:, 1, 1] + inverse[:, 2, 2]
    bulge = np.maximum(inverse[:, 3, 3], 0) * (radius / extent) ** 2
    return np.asarray(radius / extent * np.sqrt(np.maximum(tilt, 0) + bulge))


def _chords(mesh: Mesh, segments: Segmentation, surfaces: Surfaces) -> Floats:
    deepest = np.zeros(segments.count)
    for part in chunks(segments.label.size):
        label = segments.label[part]
        height = surfaces.take(label).height(facet_centres(mesh, part))
        np.maximum.at(deepest, label, np.abs(height))
    return deepest


def facet_centres(mesh: Mesh, facets: slice | NDArray[np.intp] = slice(None)) -> Floats:
    """(3, N) the middles of some facets, or of all, mm."""
    corner = [np.take(mesh.points, mesh.faces[facets, k], axis=0).T for k in range(3)]
    return (corner[0] + corner[1] + corner[2]) / 3


def _means(mesh: Mesh, segments: Segmentation) -> tuple[Floats, Floats, Floats]:
    def total(values: Floats) -> Floats:
        return np.bincount(segments.label, values, segments.count).astype(np.float64)

    size = norm(mesh.area) / 2
    area = total(size)
    middle = np.stack([total(size * row) for row in facet_centres(mesh)])
    normal = unit(np.stack([total(row) for row in mesh.area]))
    normal[2, norm(normal) < 0.5] = 1.0  # a closed tube has no mean normal
    return middle / np.maximum(area, np.finfo(np.float64).tiny), normal, area


def _frames(mesh: Mesh, points: PatchVertices, middle: Floats, normal: Floats) -> _Frames:
    offset = mesh.points[points.vertex].T - np.take(middle, points.segment, axis=1)
    extent = np.sqrt(np.maximum.reduceat(dot(offset, offset), points.first))
    basis = np.stack([*tangent_basis(normal), normal])
    x, y, z = (
        dot(np.take(axis, points.segment, axis=1), offset) / extent[points.segment]
        for axis in basis
    )
    return _Frames(x, y, z, basis, middle, extent)


def _square(f: _Frames) -> Floats:
    return np.asarray(f.x**2 + f.y**2 + f.z**2)


def _sums(points: PatchVertices, values: Floats) -> Floats:
    return np.asarray(np.add.reduceat(values, points.first, axis=-1))


def _moments(points: PatchVertices, basis: Floats) -> Floats:
    """(K, 4, 4) sums of products of the (4, P) basis functions."""
    matrix = np.empty((points.first.size, 4, 4))
    for i in range(4):
        for j in range(i + 1):
            matrix[:, i, j] = matrix[:, j, i] = _sums(points, basis[i] * basis[j])
    return matrix


def _times(matrix: Floats, vector: Floats) -> Floats:
    return np.asarray(np.einsum("nij,jn->in", matrix, vector))


def _distances(f: _Frames, points: PatchVertices, solution: Floats) -> tuple[Floats, Floats]:
    h, a, b, k = np.take(solution, points.segment, axis=1)
    g = f.z - h - a * f.x - b * f.y + k / 2 * _square(f)
    slope = np.sqrt(np.maximum(1 + a**2 + b**2 + 2 * k * h, 1e-6))
    return 2 * g / (slope + np.sqrt(np.maximum(slope**2 + 2 * k * g, 0))), slope


def _surfaces(f: _Frames, solution: Floats) -> Surfaces:
    h, a, b, k = solution
    z = 2 * h / (1 + np.sqrt(np.maximum(1 + 2 * k * h, 0)))
    slope = np.sqrt(np.maximum(1 + a**2 + b**2 + 2 * k * h, 1e-6))
    local = np.stack([-a, -b, 1 + k * z])
    return Surfaces(
        f.origin + z * f.extent * f.basis[2],
        unit(np.einsum("jn,jin->in", local, f.basis)),
        k / slope / f.extent,
    )

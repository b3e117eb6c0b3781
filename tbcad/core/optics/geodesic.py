"""The geodesic polyhedron whose vertices are the directions of the virtual cameras.

Section 3.1 and figure 2(b) of the paper: the icosahedron is split by the prime factors of n.
"""

import numpy as np

from tbcad.core.geometry.vectors import norm, unit
from tbcad.types import Floats, Ints

ON_PLANE = 1e-12  # directions this close to a symmetry plane lie on it; splitting errs by 1e-16


def icosahedron() -> tuple[Floats, Ints]:
    """Vertices (12, 3) and outward faces (20, 3) with z as a two-fold axis (DESIGN.md 2)."""
    phi = (1 + 5**0.5) / 2
    rectangle = np.array([(0.0, s, t * phi) for s in (-1, 1) for t in (-1, 1)])
    vertices = np.concatenate([np.roll(rectangle, shift, axis=1) for shift in range(3)])
    adjacent = np.isclose(norm(vertices[:, None] - vertices[None]), 2.0)
    a, b, c = np.nonzero(adjacent[:, :, None] & adjacent[:, None, :] & adjacent[None, :, :])
    faces = np.stack([a, b, c], axis=1)[(a < b) & (b < c)]
    inward = np.linalg.det(vertices[faces]) < 0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    return unit(vertices), faces


def prime_factors(n: int) -> list[int]:
    """Prime factors of n in ascending order, with multiplicity."""
    factors, prime = [], 2
    while n > 1:
        while n % prime == 0:
            factors.append(prime)
            n //= prime
        prime += 1
    return factors


def triangle_grid(m: int) -> tuple[list[tuple[int, int]], Ints]:
    """Places (i, j) in a triangle whose sides have m parts, and its m^2 triangles, (m^2, 3, 2)."""
    grid = [(i, j) for i in range(m + 1) for j in range(m + 1 - i)]
    up = [((i, j), (i + 1, j), (i, j + 1)) for i, j in grid if i + j < m]
    down = [((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i, j in grid if i + j < m - 1]
    return grid, np.array(up + down)


def split(vertices: Floats, faces: Ints, m: int) -> tuple[Floats, Ints]:
    """Split each face (f, 3) into m x m faces and move the new vertices onto the unit sphere.

    Points on shared edges are made once, so that no tolerance decides which vertices are equal.
    """
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    edges, index = np.unique(np.sort(sides, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    steps = np.arange(1, m) / m
    on_edges = (
        vertices[edges[:, :1]] * (1 - steps)[:, None] + vertices[edges[:, 1:]] * steps[:, None]
    )
    grid, small = triangle_grid(m)
    inner = np.array([(i, j) for i, j in grid if i and j and i + j < m], dtype=np.int64)
    inner = inner.reshape(-1, 2)
    weights = np.column_stack([m - inner.sum(axis=1), inner]) / m
    in_faces = np.einsum("pk,fkx->fpx", weights, vertices[faces])
    points = np.concatenate([vertices, on_edges.reshape(-1, 3), in_faces.reshape(-1, 3)])

    edge_ids = len(vertices) + np.arange(len(edges) * (m - 1)).reshape(-1, m - 1)
    along = edge_ids[index.reshape(-1, 3)]
    backward = sides[:, :, 0] > sides[:, :, 1]
    along = np.where(backward[:, :, None], along[:, :, ::-1], along)
    inner_ids = len(vertices) + edge_ids.size + np.arange(len(faces) * len(inner))
    ids = np.empty((len(faces), m + 1, m + 1), dtype=np.int64)
    ids[:, 0, 0], ids[:, m, 0], ids[:, 0, m] = faces.T
    k = np.arange(1, m)
    ids[:, k, 0], ids[:, m - k, k], ids[:, 0, m - k] = along.transpose(1, 0, 2)
    ids[:, inner[:, 0], inner[:, 1]] = inner_ids.reshape(len(faces), -1)

    triangles = ids[:, small[..., 0], small[..., 1]].reshape(-1, 3)
    return unit(points), triangles


def geodesic(n: int) -> tuple[Floats, Ints]:
    """Geodesic polyhedron of frequency n, the paper's edge separation frequency.

    Unit vectors to the vertices (10 n^2 + 2, 3), and outward triangles over them (20 n^2, 3).
    """
    vertices, faces = icosahedron()
    for factor in prime_factors(n):
        vertices, faces = split(vertices, faces, factor)
    vertices[np.abs(vertices) < ON_PLANE] = 0.0
    return vertices, faces


def stretched(u: Floats, x: float, y: float) -> Floats:
    """Unit vectors (m, 3), stretched along x and y and brought back to the unit sphere.

    Both symmetry planes and the horizon stay where they are. Without a stretch the very same.
    """
    return u if x == y == 1 else unit(u * np.array([x, y, 1.0]))

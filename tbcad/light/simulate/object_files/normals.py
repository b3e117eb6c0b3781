"""Unit normals at the corners of a mesh, whichever way its facets are turned."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tbcad.core.geometry.vectors import dot, facet_vectors, norm, unit
from tbcad.types import Floats, Ints

SAME_PLACE = 1e-6  # of the size of an object
LEAST = 1e-6  # of the sum of normals about a corner, as a share of that of their weights


def first_of_each(faces: Ints) -> Ints:
    """Numbers of the facets that do not have the corners of an earlier one: it is their back."""
    return np.sort(np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1])


def is_closed(points: Floats, faces: Ints) -> bool:
    """Whether each edge joins two facets; corners in one place are one corner."""
    step = SAME_PLACE * max(float(np.ptp(points, axis=0).max()), np.finfo(np.float64).tiny)
    place = np.unique(np.rint(points / step).astype(np.int64), axis=0, return_inverse=True)[1]
    corners = place.reshape(-1)[faces]
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2))
    uses = np.unique(edges[:, 0] * len(points) + edges[:, 1], return_counts=True)[1]
    return bool((uses == 2).all())


def turned_alike(faces: Ints) -> NDArray[np.bool_]:
    """Which facets (f,) to turn so that neighbours are alike, as far as the surface allows it.

    Facets are joined by edges of two. In the graph of all facets as they are and turned, those
    that belong together are connected.
    """
    count = len(faces)
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    owner = np.repeat(np.arange(count), 3)
    key = edges.min(axis=1) * (faces.max() + 1) + edges.max(axis=1)
    _, which, uses = np.unique(key, return_inverse=True, return_counts=True)
    order = np.argsort(which, kind="stable")
    pairs = order[np.isin(which[order], np.flatnonzero(uses == 2))].reshape(-1, 2)
    against = edges[pairs[:, 0], 0] == edges[pairs[:, 1], 0]
    if not against.any():
        return np.zeros(count, dtype=bool)
    first, second = owner[pairs[:, 0]], owner[pairs[:, 1]]
    rows = np.concatenate([first, first + count])
    columns = np.concatenate([second + count * against, second + count * ~against])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    return np.asarray(label[:count] > label[count:])


def turned_outward(points: Floats, faces: Ints) -> NDArray[np.bool_]:
    """Which facets (f,) to turn so that all are alike and the volume in them is not negative."""
    turned = turned_alike(faces)
    alike = np.where(turned[:, None], faces[:, ::-1], faces)
    middle = points[alike].mean(axis=(0, 1))
    volume = dot(points[alike[:, 0]] - middle, facet_vectors(points[alike])).sum()
    return ~turned if volume < 0 else turned


def corner_normals(points: Floats, faces: Ints) -> Floats:
    """Normals of smooth surfaces at corners (v, 3): means by angle; zero where they cancel."""
    across, total = unit(facet_vectors(points[faces])), np.zeros_like(points)
    size = np.zeros(len(points))
    for k in range(3):
        here, after, before = (points[faces[:, (k + j) % 3]] for j in range(3))
        cosine = dot(unit(after - here), unit(before - here))
        angle = np.arccos(np.clip(cosine, -1, 1))
        np.add.at(total, faces[:, k], angle[:, None] * across)
        np.add.at(size, faces[:, k], angle)
    return unit(np.where((norm(total) > LEAST * size)[:, None], total, 0.0))


def usable(points: Floats, faces: Ints, normals: Floats) -> tuple[Floats, Ints, Floats]:
    """The mesh with a normal at each corner, on the side of its facets.

    Corners that have none get one for each facet: that of the facet.
    """
    across = facet_vectors(points[faces])
    normals = unit(np.where(np.isfinite(normals), normals, 0.0))
    side = np.zeros(len(points))
    for k in range(3):
        np.add.at(side, faces[:, k], dot(normals[faces[:, k]], across))
    normals = np.where((side < 0)[:, None], -normals, normals)
    facet, corner = np.nonzero((norm(normals) < 0.5)[faces])
    split = faces.copy()
    split[facet, corner] = len(points) + np.arange(len(facet))
    return (
        np.concatenate([points, points[faces[facet, corner]]]),
        split,
        np.concatenate([normals, unit(across)[facet]]),
    )

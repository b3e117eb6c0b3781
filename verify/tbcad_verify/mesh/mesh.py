"""Triangles that share vertices: whether they close into one solid, and its mass properties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.vectors import cross, norm
from tbcad_verify.types import Floats

Ints = NDArray[np.int32]
# Of each coordinate: the factor of its bits, and by how much those before it are mixed.
HASH = ((0x9E3779B97F4A7C15, 1), (0xC2B2AE3D27D4EB4F, 29), (0x165667B19E3779F9, 32))


@dataclass(frozen=True)
class Mesh:
    """An indexed triangle mesh. Half-edge 3 f + k leads from corner k to corner k + 1 of facet f.

    Attributes:
        points: (V, 3) float64 mm, exactly the float32 values of the file.
        faces: (F, 3) vertex indices.
        twin: (3 F,) the half-edge on the other side; -1 where there is not exactly one.
        area: (3, F) outward normals, as long as twice the facet's area.
    """

    points: Floats
    faces: Ints
    twin: Ints
    area: Floats


@dataclass(frozen=True)
class Topology:
    """Faults of a mesh; a good one has zeros, one component and a positive volume."""

    open_edges: int  # edges that belong to one facet only
    crowded_edges: int  # edges of more than two facets
    turned_edges: int  # edges along which both facets run in the same direction
    degenerate: int  # facets without area
    duplicate: int  # facets on the same three vertices as a neighbour
    stored_normals: int  # facets whose stored normal contradicts their corners' order
    components: int  # connected pieces
    volume: float  # signed, mm^3; negative when inside out
    status: str  # manifold3d's; "NoError" is good


def mesh_from_facets(facets: Facets) -> Mesh:
    """Merge corners that are equal as float32, and find every half-edge's twin."""
    corners = facets.corners.reshape(-1, 3)
    index, inverse = _unique_rows(corners)
    faces = inverse.reshape(-1, 3).astype(np.int32)
    return indexed_mesh(corners[index].astype(np.float64), faces)


def indexed_mesh(points: Floats, faces: Ints) -> Mesh:
    """A mesh from (V, 3) points and (F, 3) vertex indices."""
    a, b, c = (np.take(points, faces[:, k], axis=0).T for k in range(3))
    return Mesh(points, faces, _twins(faces, len(points)), cross(b - a, c - a))


def join_meshes(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one, in order, sharing nothing."""
    # As wide as indices are: wider sums of millions would be the most memory of a verification.
    vertices = np.cumsum([0, *(len(mesh.points) for mesh in meshes)], dtype=np.int32)
    edges = np.cumsum([0, *(mesh.twin.size for mesh in meshes)], dtype=np.int32)
    twins = [np.where(m.twin < 0, m.twin, m.twin + e) for m, e in zip(meshes, edges, strict=False)]
    return Mesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([m.faces + v for m, v in zip(meshes, vertices, strict=False)]),
        np.concatenate(twins),
        np.concatenate([mesh.area for mesh in meshes], axis=1),
    )


def examine_topology(mesh: Mesh, facets: Facets) -> Topology:
    """Count what keeps a mesh from being one closed solid."""
    lost = _edge_keys(mesh.faces, len(mesh.points))[mesh.twin < 0]
    counts = np.unique(lost, return_counts=True)[1]
    first, second = paired_half_edges(mesh)
    start, far = mesh.faces.ravel(), np.roll(mesh.faces, -2, axis=1).ravel()
    # Below 1e-12 of the longest side even float64 sees no height at all.
    flat = norm(mesh.area) <= 1e-12 * longest_sides(mesh) ** 2
    return Topology(
        open_edges=int((counts == 1).sum()),
        crowded_edges=int((counts > 2).sum()),
        turned_edges=int((start[first] == start[second]).sum()),
        degenerate=int(flat.sum()),
        duplicate=int((far[first] == far[second]).sum()),
        stored_normals=int((np.einsum("ni,in->n", facets.normals, mesh.area) < 0).sum()),
        components=connected_groups(len(mesh.faces), first // 3, second // 3)[0],
        volume=float(facet_volumes(mesh).sum()),
        status=manifold_status(mesh),
    )


def paired_half_edges(mesh: Mesh) -> tuple[NDArray[np.intp], Ints]:
    """The half-edges of every edge between two facets: (E,) the smaller number, (E,) its twin."""
    first = np.flatnonzero(mesh.twin > np.arange(mesh.twin.size))
    return first, mesh.twin[first]


def longest_sides(mesh: Mesh) -> Floats:
    """(F,) longest side of every facet, mm."""
    corner = [np.take(mesh.points, mesh.faces[:, k], axis=0).T for k in range(3)]
    return np.asarray(np.max([norm(corner[k] - corner[k - 1]) for k in range(3)], axis=0))


def facet_volumes(mesh: Mesh) -> Floats:
    """(F,) signed volumes between the facets and the vertices' mean, mm^3."""
    # About the middle, so that large terms do not cancel.
    corner = np.take(mesh.points - mesh.points.mean(axis=0), mesh.faces[:, 0], axis=0)
    return np.asarray(np.einsum("ni,in->n", corner, mesh.area) / 6)


def connected_groups(
    size: int, one: NDArray[np.integer], two: NDArray[np.integer]
) -> tuple[int, Ints]:
    """How many groups `size` things form that are linked one[k] - two[k], and each one's group."""
    links = coo_array((np.ones(one.size, dtype=np.int8), (one, two)), shape=(size, size))
    count, label = connected_components(links, directed=False)
    return int(count), np.asarray(label, dtype=np.int32)


def sorted_unique(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Sorted, each once; for millions of integers many times faster than np.unique."""
    keys = np.sort(keys)
    return keys[np.append(True, keys[1:] != keys[:-1])] if keys.size else keys


def _unique_rows(rows: NDArray[np.float32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    # Sorting one 64-bit hash is many times faster than sorting triples; a clash is checked for.
    # One column after the other, in place: the most memory of a verification is here.
    key = np.zeros(len(rows), dtype=np.uint64)
    for k, (factor, shift) in enumerate(HASH):
        bits = (rows[:, k] + np.float32(0)).view(np.uint32).astype(np.uint64)  # -0 becomes +0
        key ^= key >> np.uint64(shift)
        key += np.multiply(bits, np.uint64(factor), out=bits)
    first = _first_equal(key)
    if not np.array_equal(rows[first], rows):
        _, index, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        first = index[inverse.ravel()]
    # Numbered as they first occur, neighbours in the file stay neighbours in memory.
    is_first = first == np.arange(first.size)
    return np.flatnonzero(is_first), (np.cumsum(is_first) - 1)[first]


def _first_equal(keys: NDArray[np.uint64]) -> NDArray[np.intp]:
    """(N,) where each key occurs first; np.unique, whose sort is stable, takes twice as long."""
    order = np.argsort(keys)
    ordered = keys[order]
    start = np.append(True, ordered[1:] != ordered[:-1])
    first = np.empty_like(order)
    first[order] = np.minimum.reduceat(order, np.flatnonzero(start))[np.cumsum(start) - 1]
    return first


def _edge_keys(faces: Ints, count: int) -> NDArray[np.int64]:
    start = faces.ravel().astype(np.int64)
    end = np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    keys = np.minimum(start, end)
    keys *= count
    keys += np.maximum(start, end, out=end)
    return keys


def _twins(faces: Ints, count: int) -> Ints:
    keys = _edge_keys(faces, count)
    order = np.argsort(keys)
    ordered = keys[order]
    same = ordered[1:] == ordered[:-1]
    alone = same & ~np.append(same[1:], False) & ~np.insert(same[:-1], 0, False)
    first, second = order[:-1][alone], order[1:][alone]
    twin = np.full(keys.size, -1, dtype=np.int32)
    twin[first], twin[second] = second, first
    return twin


def manifold_status(mesh: Mesh) -> str:
    """Status by manifold3d; "NoError" passes."""
    import manifold3d

    shape = manifold3d.Manifold(
        manifold3d.Mesh(mesh.points.astype(np.float32), mesh.faces.astype(np.uint32))
    )
    return str(shape.status()).rsplit(".", 1)[-1]


@dataclass(frozen=True)
class MassProperties:
    """Volume, area, centroid and box, as plain numbers."""

    volume: float  # signed, mm^3
    area: float  # mm^2
    centroid: list[float]  # x, y, z of the volume's centroid, mm
    low: list[float]  # minimum x, y, z, mm
    high: list[float]  # maximum x, y, z, mm
    # largest growth of the area of an offset surface with its distance, mm^2 / mm: by Steiner, the
    # sum over edges of length times angle. None if it was not computed.
    bend: float | None = None


def mass_properties(mesh: Mesh) -> MassProperties:
    """Figures of a closed mesh, by the divergence theorem facet by facet."""
    middle, share = mesh.points.mean(axis=0), facet_volumes(mesh)
    volume = float(share.sum())
    corners = np.take(mesh.points - middle, mesh.faces, axis=0)
    moment = np.einsum("n,ni->i", share, corners.sum(axis=1) / 4)
    return MassProperties(
        volume,
        float(norm(mesh.area).sum() / 2),
        (middle + moment / (volume or np.nan)).tolist(),
        mesh.points.min(axis=0).tolist(),
        mesh.points.max(axis=0).tolist(),
    )

"""Corners and borders of planar mirrors, which pedestals start from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tbcad_verify.types import Bools, Floats, Ints

if TYPE_CHECKING:
    from tbcad_verify.step.sphere_union import CellEdges

SAME_MM = 1e-6  # ends of edges that are one corner


@dataclass(frozen=True)
class Mirrors:
    """M mirrors as they reflect, and the planes that bound them all.

    Attributes:
        point: (M, 3) mm, apices.
        normal: (M, 3) unit, toward the light.
        curvature: (M,) 1/mm.
        bounds: (2, 4) planes of the seam and the foot: kept is x . (first three) >= fourth.
        pinhole: (3,) mm.
        groove: width, mm.
    """

    point: Floats
    normal: Floats
    curvature: Floats
    bounds: Floats
    pinhole: Floats
    groove: float

    @property
    def pitch(self) -> float:
        """Median distance of an apex from the nearest other, mm."""
        distance, _ = cKDTree(self.point).query(self.point, k=[2])
        return float(np.median(distance))

    def drop(self, mirror: Ints, start: Floats, down: Floats) -> Floats:
        """(N,) mm along unit vectors (N, 3) from places (N, 3) to where they enter mirrors (N,)."""
        k, offset = self.curvature[mirror], start - self.point[mirror]
        height = (offset * self.normal[mirror]).sum(axis=1) + k / 2 * (offset**2).sum(axis=1)
        slope = ((self.normal[mirror] + k[:, None] * offset) * down).sum(axis=1)
        return np.asarray(2 * height / (np.sqrt(slope**2 - 2 * k * height) - slope))


@dataclass(frozen=True)
class Graph:
    """Borders of planar mirrors.

    Attributes:
        place: (C, 3) mm, corners.
        weight: (C,) number of mirrors and planes that meet there, less two.
        faces: (B, 2) the mirrors on both sides; M + w for bounding plane w.
        ends: (B, 2) corners; the first face lies to the left, seen from the light.
    """

    place: Floats
    weight: Floats
    faces: Ints
    ends: Ints

    @property
    def length(self) -> Floats:
        """(B,) mm, of the borders."""
        return np.asarray(np.linalg.norm(np.diff(self.place[self.ends], axis=1)[:, 0], axis=1))

    def groups(self, joined: Bools) -> Ints:
        """(C,) numbers of the corners when those of some borders (B,) are one."""
        return _components(len(self.place), self.ends[joined])[1]


def graph_of(flat: CellEdges, count: int) -> Graph:
    """Borders of M planar mirrors from their edges."""
    mirror, other, points = flat.mirror, flat.other, flat.points
    ends = np.concatenate([points[:, 0], points[:, 2]])
    pairs = cKDTree(ends).query_pairs(SAME_MM, output_type="ndarray")
    number, corner = _components(len(ends), pairs)
    place = means(corner, ends, np.ones(len(ends)))
    tied = (
        np.column_stack([corner, np.tile(mirror, 2)]),
        np.column_stack([corner, np.tile(other, 2)]),
    )
    meeting = np.unique(np.concatenate(tied), axis=0)
    once = (mirror < other) | (other >= count)
    both = corner.reshape(2, -1).T
    return Graph(
        place,
        np.asarray(np.bincount(meeting[:, 0], minlength=number), dtype=np.float64) - 2,
        np.column_stack([mirror, other])[once],
        both[once],
    )


def _components(count: int, pairs: Ints) -> tuple[int, Ints]:
    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return int(number), np.asarray(label)


def means(group: Ints, place: Floats, weight: Floats) -> Floats:
    """(G, 3) means of places (N, 3) with weights (N,) by groups (N,)."""
    total = np.zeros((int(group.max()) + 1, 4))
    np.add.at(total, group, weight[:, None] * np.column_stack([place, np.ones(len(place))]))
    return np.asarray(total[:, :3] / total[:, 3:])


def unit(v: Floats) -> Floats:
    """Vectors (..., 3) divided by their lengths; zero vectors stay zero."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.asarray(v / np.where(length > 0, length, 1))

"""Pairs of mirrors that may share an edge, and the faces that may cover it, for any errors."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy.sparse import coo_array, csr_array

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Floats, Ints

# Limit of an edge's length, in distances of its mirrors' farthest corners from their apices: the
# faces of a pair cover what lies between there and the cells.
REACH = 1.5


PairArrays: TypeAlias = tuple[Ints, Ints, Ints, Floats]


@dataclass(frozen=True)
class NeighbourPairs:
    """Pairs of faces that may share an edge, e of them, and the faces that may cut it short."""

    pair: Ints  # a mirror and another mirror or a plane, (e, 2)
    offset: Ints  # where the faces of each pair begin in `face`, (e + 1,)
    face: Ints  # mirrors and planes, in the order of their distance from both of the pair
    reach: Floats  # maximum distance of the edge's points from its middle, mm, (e,)
    # mirrors whose pairs have a foot plane of their own, (r,): faces m + 2 onwards. The walls of
    # pedestals come after them.
    footed: Ints

    @property
    def arrays(self) -> PairArrays:
        """All of them, for compiled code."""
        return self.pair, self.offset, self.face, self.reach


def neighbour_pairs(cells: Cells) -> NeighbourPairs:
    """All pairs that are neighbours or share a neighbour as designed.

    Errors move corners by far less than a cell is wide, so a mirror meets no other mirror. Seam and
    foot are the first faces of each pair: they are never covered.
    """
    if isinstance(cells, PedestalCells):
        return _pairs_with_walls(cells)
    m = cells.mirrors
    adjacency = _adjacency(cells)
    nearby = csr_array(adjacency + adjacency @ adjacency)
    first, second = coo_array(nearby).coords
    pair = np.column_stack([first, second])[(first < second) & (first < m)].astype(np.int64)
    offset, face = _cutting_faces(nearby, cells.surfaces, m, pair)
    reach_mm = REACH * np.append(cell_radii(cells), [0, 0])[pair].max(axis=1)
    return _with_own_feet(NeighbourPairs(pair, offset, face, reach_mm, np.arange(0)), m)


def _pairs_with_walls(cells: PedestalCells) -> NeighbourPairs:
    """A mirror on a pedestal and each plane that ends it; its other planes cut the edge there."""
    m, (offsets, sides) = cells.mirrors, cells.rings
    mirror, plane = cells.arcs.faces[sides // 2].T
    plane = np.where(plane < m + PLANES, plane, plane + np.count_nonzero(plane == m + 1))
    count = np.diff(offsets)[mirror]
    of_pair, place = rows_and_places(count)
    side = offsets[mirror][of_pair] + place
    others = side != of_pair
    offset = np.concatenate([[0], np.cumsum(count - 1)])
    reach_mm = REACH * cell_radii(cells)[mirror]
    pair, face = np.column_stack([mirror, plane]), plane[side[others]]
    return _with_own_feet(NeighbourPairs(pair, offset, face, reach_mm, np.arange(0)), m)


def rows_and_places(count: Ints) -> tuple[Ints, Ints]:
    """Row of each entry of a table with some entries a row (r,), and its place in the row."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)


def _with_own_feet(pairs: NeighbourPairs, m: int) -> NeighbourPairs:
    """The same with a foot plane for each mirror: a shell that warps takes its foot with it."""
    first, second = pairs.pair.T
    footed = np.unique(first[second == m + 1])
    number = np.full(m, m + 1)
    number[footed] = m + 2 + np.arange(len(footed))
    of_face = np.repeat(first, np.diff(pairs.offset))
    pair = np.column_stack([first, np.where(second == m + 1, number[first], second)])
    face = np.where(pairs.face == m + 1, number[of_face], pairs.face)
    return replace(pairs, pair=pair, face=face, footed=footed)


def cell_radii(cells: Cells) -> Floats:
    """Distance of each mirror's farthest corner from its apex, mm, (m,)."""
    mirror, corner = cells.triangles.ravel(), np.repeat(np.arange(len(cells.triangles)), 3)
    if isinstance(cells, PedestalCells):
        sides = cells.rings[1] // 2
        mirror, corner = cells.arcs.left[sides], cells.arcs.start[sides]
    mirror, corner = mirror[mirror < cells.mirrors], corner[mirror < cells.mirrors]
    radius = np.zeros(cells.mirrors)
    np.maximum.at(radius, mirror, norm(cells.corners[corner] - cells.surfaces.apex[mirror]))
    return radius


def _adjacency(cells: Cells) -> csr_array:
    """Which faces touch, (m + 2, m + 2); mirrors are not neighbours through a plane."""
    m, faces = cells.mirrors, cells.arcs.faces
    both = np.concatenate([faces, faces[:, ::-1]])
    both = both[both[:, 0] < m]
    size = (m + 2, m + 2)
    return csr_array(coo_array((np.ones(len(both), dtype=np.int64), both.T), shape=size))


def _cutting_faces(nearby: csr_array, surfaces: Surfaces, m: int, pair: Ints) -> tuple[Ints, Ints]:
    """Where the faces of each pair (e, 2) begin, (e + 1,), and the faces: see NeighbourPairs."""
    first, second = pair.T
    of_pair, place = rows_and_places(np.diff(nearby.indptr)[first])
    face = nearby.indices[nearby.indptr[first][of_pair] + place].astype(np.int64)
    other = (face != first[of_pair]) & (face != second[of_pair])
    of_pair, face = of_pair[other], face[other]
    ends = np.where(pair < m, pair, first[:, None])[of_pair]
    distance = norm(surfaces.apex[face][:, None] - surfaces.apex[ends]).sum(axis=1)
    order = np.lexsort((np.where(face < m, distance, 0.0), of_pair))
    offset = np.searchsorted(of_pair, np.arange(len(pair) + 1))
    return np.asarray(offset, dtype=np.int64), np.asarray(face[order])

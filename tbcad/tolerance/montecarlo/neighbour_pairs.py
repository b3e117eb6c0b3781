"""Which spheres may come to meet, and which may cover where they do, whatever the errors."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array

from tbcad.geometry.vectors import norm
from tbcad.optics.cells import Cells
from tbcad.optics.surfaces import Surfaces
from tbcad.types import Floats, Ints

# An edge goes no farther than this many times the distance of its mirrors' farthest corners from
# their apices: the spheres that are looked at cover what lies between there and the cells.
REACH = 1.5


@dataclass(frozen=True)
class Near:
    """Pairs of faces that may share an edge, e of them, and the faces that may cut it short.

    Attributes:
        pair: a mirror and another mirror or a plane, (e, 2).
        offset: where the faces of each pair begin in `face`, (e + 1,).
        face: mirrors and planes, those first that are nearest to both of the pair.
        reach: how far from its middle the pair's edge may go, mm, (e,).
    """

    pair: Ints
    offset: Ints
    face: Ints
    reach: Floats


def near(cells: Cells) -> Near:
    """All pairs that are neighbours or share a neighbour as designed.

    Errors move corners by far less than a cell is wide, so that a mirror meets no other. Seam and
    foot come first of what cuts an edge short: they are never covered.
    """
    m = cells.mirrors
    beside = _beside(cells)
    reach = csr_array(beside + beside @ beside)
    first, second = coo_array(reach).coords
    pair = np.column_stack([first, second])[(first < second) & (first < m)].astype(np.int64)
    rows = [_cutting(reach, cells.surfaces, m, *ends) for ends in pair.tolist()]
    offset = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    reach_mm = REACH * np.append(_widths(cells), [0, 0])[pair].max(axis=1)
    return Near(pair, offset.astype(np.int64), np.concatenate(rows), reach_mm)


def _widths(cells: Cells) -> Floats:
    """Distance of each mirror's farthest corner from its apex, mm, (m,)."""
    mirror, which = cells.triangles.ravel(), np.repeat(np.arange(len(cells.corners)), 3)
    mirror, which = mirror[mirror < cells.mirrors], which[mirror < cells.mirrors]
    width = np.zeros(cells.mirrors)
    away = norm(cells.corners[which] - cells.surfaces.apex[mirror])
    np.maximum.at(width, mirror, away)
    return width


def _beside(cells: Cells) -> csr_array:
    """Which faces touch, (m + 2, m + 2); the planes are no way from one mirror to another."""
    m, faces = cells.mirrors, cells.arcs.faces
    both = np.concatenate([faces, faces[:, ::-1]])
    both = both[both[:, 0] < m]
    size = (m + 2, m + 2)
    return csr_array(coo_array((np.ones(len(both), dtype=np.int64), both.T), shape=size))


def _cutting(reach: csr_array, surfaces: Surfaces, m: int, i: int, j: int) -> Ints:
    faces = reach.indices[reach.indptr[i] : reach.indptr[i + 1]].astype(np.int64)
    faces = faces[(faces != i) & (faces != j)]
    apart = surfaces.apex[faces][:, None] - surfaces.apex[[i, j if j < m else i]]
    distance = np.linalg.norm(apart, axis=2).sum(axis=1)
    result: Ints = faces[np.argsort(np.where(faces < m, distance, 0.0), kind="stable")]
    return result

"""The union of balls in closed form: every mirror's cell, from the record alone.

A cell is the part of a mirror's surface that no other ball, or half-space behind a planar mirror,
of the same camera covers, on the side that faces the light, cut by the seam x = 0 and the foot
plane. It does not depend on a STEP file, a mesh, a CAD kernel, or neighbours found elsewhere: it is
an independent reference for them.

By Gauss' theorem the column `volume`, summed over all faces of a closed solid, is its volume.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import dot
from tbcad_verify.record.export import Export
from tbcad_verify.step.cell_boundaries import (
    CellBoundaries,
    arc_loops,
    cell_boundaries,
    front_pieces,
)
from tbcad_verify.step.cell_moments import cell_moments
from tbcad_verify.step.map_arcs import free_arcs
from tbcad_verify.step.pedestals import Grooves
from tbcad_verify.step.stereographic import plane_circles, surface_maps
from tbcad_verify.types import Bools, Floats

SAME_CORNER = 1e-11  # of the spread


@dataclass(frozen=True)
class ClosedFormCells:
    """One cell a mirror, M of them, in the order given."""

    # (M,) mm^2; 0 where the mirror is covered completely, NaN where its cell does not end before
    # the horizon (for planes: before infinity)
    area: Floats
    first: Floats  # (M, 3) mm^3, the integral of x
    volume: Floats  # (M,) mm^3, the integral of x.n / 3, with the unit normal n out of the solid


def closed_form_cells(
    point: Floats, normal: Floats, curvature: Floats, walls: Floats
) -> ClosedFormCells:
    """Cells of balls and half-spaces, each without what the others cover.

    Of each ball it is the piece nearest to the point given, no farther than 90 degrees from it.

    Args:
        point: (M, 3) mm, on the surfaces.
        normal: (M, 3) unit, there, out of the solid.
        curvature: (M,) 1/mm, 1 / radius; 0 for planes, whose solid is a half-space.
        walls: (W, 4) planes: kept is what lies at x . (first three) >= fourth, mm.

    Source: Archimedes' projection and Stokes' theorem, see `cell_moments`.
    """
    wall = np.asarray(walls, dtype=np.float64).reshape(-1, 4)
    length = np.sqrt((wall[:, :3] ** 2).sum(axis=1))
    across = (wall[:, :3].T / length).copy()
    planes = Surfaces(across * (wall[:, 3] / length), across, np.zeros(len(wall)))
    mirrors = Surfaces(point.T.copy(), normal.T.copy(), curvature.astype(np.float64))
    return _measured(cell_boundaries(mirrors, planes), len(point) + len(wall))


def cells_within(mirrors: Surfaces, point: Floats, normal: Floats, real: Bools) -> ClosedFormCells:
    """Cells of M mirrors, each between planes of its own: see `plane_circles`."""
    spread = float(np.hypot.reduce(np.ptp(mirrors.point, axis=1)))
    maps = surface_maps(mirrors, spread)
    arcs = free_arcs(plane_circles(maps, point, normal, real), spread)
    return _measured(CellBoundaries(maps, arcs, spread), point.shape[1])


def cells_of_export(
    export: Export, camera: str, grooves: Grooves | None = None, *, coated: bool = False
) -> ClosedFormCells:
    """The cells of one camera's rows of mirrors.csv, in their order, as the solid has them.

    The recorded radius is that of the reflecting surface; the solid ends one coat below it, unless
    `coated`. A row without a radius is a plane. The walls are the seam x = 0, of which the camera
    has the side of its pinhole, and the foot plane. The recorded `cell_area_mm2` is the coated one.

    `grooves`: that end mirrors on pedestals; None where neighbouring spheres meet.
    """
    mine = np.flatnonzero(export.mirrors.camera == camera)
    side = float(np.copysign(1.0, export.cameras[camera].pinhole[0]))
    solid = export.mirrors.surfaces().take(mine).coated(0.0 if coated else -export.coating_mm)
    if grooves:
        point, normal, real = grooves.planes(len(mine), bounds(side, export.foot_z_mm))
        return cells_within(solid, point, normal, real)
    # Cameras whose mirrors are mirror images of each other share the cells of the half x > 0.
    flip = np.array([side, 1.0, 1.0])
    half = solid.point.T * flip, solid.normal.T * flip, solid.curvature
    walls = bounds(1.0, export.foot_z_mm)
    cells = _cells_of_half(*((array + 0.0).tobytes() for array in (*half, walls)))
    return replace(cells, first=cells.first * flip)


def bounds(side: float, foot: float) -> Floats:
    """(2, 4) planes of seam and foot; the seam keeps the side x > 0 or x < 0."""
    return np.array([[side, 0, 0, 0], [0, 0, 1, foot]])


@lru_cache(maxsize=2)
def _cells_of_half(point: bytes, normal: bytes, curvature: bytes, walls: bytes) -> ClosedFormCells:
    """The cells of mirrors within walls, given their arrays' bytes."""
    places, normals, planes = (np.frombuffer(array) for array in (point, normal, walls))
    return closed_form_cells(
        places.reshape(-1, 3),
        normals.reshape(-1, 3),
        np.frombuffer(curvature),
        planes.reshape(-1, 4),
    )


def _measured(boundaries: CellBoundaries, horizon: int) -> ClosedFormCells:
    """All figures of the cells; `horizon` is the number of the horizon."""
    # Shorter arcs are only rounding at corners of four cells or more.
    arcs, spread = boundaries.arcs, boundaries.spread
    arcs = front_pieces(arcs.take(arcs.length > SAME_CORNER * spread), spread)
    mine = boundaries.maps.surfaces
    p, n, k = mine.point, mine.normal, mine.curvature
    area, local = cell_moments(boundaries.maps, arcs)
    area[arcs.mirror[arc_loops(arcs, spread)[1] | (arcs.circle == horizon)]] = np.nan
    axes = np.stack([boundaries.maps.right, boundaries.maps.up, n])
    first = np.einsum("aim,am->im", axes, local)
    # On the surface x.n = p.n0 + d.e: linear in d = x - p, for n = n0 + k d and d.(2 n0 + k d) = 0.
    volume = dot(p, n) * area + dot(k * p - n, first)
    return ClosedFormCells(area, (p * area + first).T, volume / 3)

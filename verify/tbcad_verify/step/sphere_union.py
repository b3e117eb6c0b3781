"""The union of balls in closed form: every mirror's cell, from the record alone.

A cell is the part of a mirror's surface that no other ball, or half-space behind a planar mirror,
of the same camera covers, on the side that faces the light, cut by the seam x = 0 and the foot
plane. It does not depend on a STEP file, a mesh, a CAD kernel, or neighbours found elsewhere: it is
an independent reference for them.

By Gauss' theorem the column `volume`, summed over all faces of a closed solid, is its volume;
`vector_area` sums to zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import dot, unit
from tbcad_verify.record.export import Export
from tbcad_verify.step.arc_loops import arc_loops, front_pieces
from tbcad_verify.step.cell_boundaries import CellBoundaries, cell_boundaries
from tbcad_verify.step.cell_moments import cell_moments
from tbcad_verify.step.map_arcs import MapArcs, free_arcs
from tbcad_verify.step.pedestal_graph import Mirrors
from tbcad_verify.step.pedestals import PedestalWalls, pedestal_walls
from tbcad_verify.step.stereographic import plane_circles, surface_maps, to_surface
from tbcad_verify.types import Bools, Floats, Ints

SAME_CORNER = 1e-11  # of the spread


@dataclass(frozen=True)
class CellEdges:
    """E arcs or straight lines between corners, each as seen by one of the two cells it bounds.

    An arc that passes the point of its circle farthest from the mirror's apex is cut there in two.

    Attributes:
        mirror: (E,) number of the cell; it lies to the left, seen from the light.
        other: (E,) number of the mirror that ends it; M + w for wall w, M + W for the horizon.
        points: (E, 3, 3) mm: start, some point between, end.
    """

    mirror: Ints
    other: Ints
    points: Floats


@dataclass(frozen=True)
class ClosedFormCells:
    """One cell a mirror, M of them, in the order given.

    Attributes:
        area: (M,) mm^2.
        vector_area: (M, 3) mm^2, the integral of the unit normal n out of the solid.
        first: (M, 3) mm^3, the integral of x.
        volume: (M,) mm^3, the integral of x.n / 3.
        corners: (M,) number; where four cells meet within rounding, one corner.
        edges: (M,) number; a full circle is an edge without corners.
        empty: (M,) the mirror is covered completely.
        closed: (M,) every arc starts where another one ends, and the cell ends before the
            horizon (for planes: before infinity). Where it is false, the figures are meaningless.
        rim: the edges.
    """

    area: Floats
    vector_area: Floats
    first: Floats
    volume: Floats
    corners: Ints
    edges: Ints
    empty: Bools
    closed: Bools
    rim: CellEdges

    def __len__(self) -> int:
        """Number of mirrors."""
        return len(self.area)


def closed_form_cells(
    point: Floats, normal: Floats, curvature: Floats, walls: Floats, *, front: bool = True
) -> ClosedFormCells:
    """Cells of balls and half-spaces, each without what the others cover.

    Args:
        point: (M, 3) mm, on the surfaces.
        normal: (M, 3) unit, there, out of the solid.
        curvature: (M,) 1/mm, 1 / radius; 0 for planes, whose solid is a half-space.
        walls: (W, 4) planes: kept is what lies at x . (first three) >= fourth, mm.
        front: of each ball only the piece nearest to the point given, no farther than 90 degrees
            from it; else all of it.

    Returns:
        Their integrals and edges. Empty and open cells are marked, not refused.

    Source: Archimedes' projection and Stokes' theorem, see `moments`.
    """
    wall = np.asarray(walls, dtype=np.float64).reshape(-1, 4)
    length = np.sqrt((wall[:, :3] ** 2).sum(axis=1))
    across = (wall[:, :3].T / length).copy()
    planes = Surfaces(across * (wall[:, 3] / length), across, np.zeros(len(wall)))
    mirrors = Surfaces(point.T.copy(), normal.T.copy(), curvature.astype(np.float64))
    boundaries = cell_boundaries(mirrors, planes, front)
    # Shorter arcs are only rounding at corners of four cells or more.
    arcs = boundaries.arcs.take(boundaries.arcs.length > SAME_CORNER * boundaries.spread)
    arcs = front_pieces(arcs, boundaries.spread) if front else arcs
    return _measured(replace(boundaries, arcs=arcs), len(point) + len(wall))


def cells_of_balls(centre: Floats, radius: Floats, walls: Floats) -> ClosedFormCells:
    """The uncovered parts of balls (M, 3) mm, (M,) mm, front and back, inside the walls."""
    up = np.zeros_like(centre) + np.array([0.0, 0.0, 1.0])
    return closed_form_cells(centre + radius[:, None] * up, up, 1 / radius, walls, front=False)


def cells_within(mirrors: Surfaces, point: Floats, normal: Floats, real: Bools) -> ClosedFormCells:
    """Cells of M mirrors, each between planes of its own: see `plane_circles`."""
    spread = float(np.hypot.reduce(np.ptp(mirrors.point, axis=1)))
    maps = surface_maps(mirrors, True, spread)
    arcs = free_arcs(plane_circles(maps, point, normal, real), spread)
    arcs = arcs.take(arcs.length > SAME_CORNER * spread)
    whole = np.zeros(len(mirrors.curvature), dtype=np.bool_)
    boundaries = CellBoundaries(maps, front_pieces(arcs, spread), whole, spread)
    return _measured(boundaries, point.shape[1])


def cells_of_export(export: Export, camera: str, *, coated: bool = False) -> ClosedFormCells:
    """The cells of one camera's rows of mirrors.csv, in their order, as the solid has them.

    The recorded radius is that of the reflecting surface; the solid ends one coat below it, unless
    `coated`. A row without a radius is a plane. The walls are the seam x = 0, of which the camera
    has the side of its pinhole, and the foot plane. The recorded `cell_area_mm2` is the coated one.
    """
    light, walls = _mirrors_and_bounds(export, camera)
    solid = light.coated(0.0 if coated else -export.coating_mm)
    if planes := walls_of_export(export, camera):
        return cells_within(solid, planes.point, planes.normal, planes.real)
    # Cameras whose mirrors are mirror images of each other share the cells of the half x > 0.
    side = np.array([_side(export, camera), 1.0, 1.0])
    half = (solid.point.T * side, solid.normal.T * side, solid.curvature, walls * [*side, 1.0])
    return _reflected(_cells_of_half(*((array + 0.0).tobytes() for array in half)), side)


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


def _reflected(cells: ClosedFormCells, side: Floats) -> ClosedFormCells:
    """Cells with their coordinates times 1 or -1; of a mirror image the edges lead back."""
    points = cells.rim.points * side
    rim = replace(cells.rim, points=points if side[0] > 0 else points[:, ::-1])
    vector_area, first = cells.vector_area * side, cells.first * side
    return replace(cells, vector_area=vector_area, first=first, rim=rim)


def walls_of_export(export: Export, camera: str) -> PedestalWalls | None:
    """The planes that end the mirrors of one camera; None where neighbouring spheres meet."""
    if export.spec.shell.edges != "pedestal":
        return None
    light, walls = _mirrors_and_bounds(export, camera)
    point, normal, pinhole = light.point.T, light.normal.T, export.cameras[camera].pinhole
    # Planar mirrors that send the rays to their apices on to the origin.
    between = unit(unit(pinhole[:, None] - light.point) - unit(light.point)).T
    flat = closed_form_cells(point, between, np.zeros_like(light.curvature), walls)
    mirrors = Mirrors(point, normal, light.curvature, walls, pinhole, export.spec.shell.groove_mm)
    planar = replace(mirrors, normal=between, curvature=np.zeros_like(light.curvature))
    return pedestal_walls(mirrors, planar, flat.rim)


def _mirrors_and_bounds(export: Export, camera: str) -> tuple[Surfaces, Floats]:
    """One camera's mirrors as they reflect, and (2, 4) the planes of seam and foot."""
    rows = export.mirrors
    walls = np.array([[_side(export, camera), 0, 0, 0], [0, 0, 1, export.foot_z_mm]])
    return rows.surfaces().take(np.flatnonzero(rows.camera == camera)), walls


def _side(export: Export, camera: str) -> float:
    """Of the seam, on which a camera's pinhole is."""
    return float(np.copysign(1.0, export.cameras[camera].pinhole[0]))


def _measured(boundaries: CellBoundaries, horizon: int) -> ClosedFormCells:
    """All figures of the cells; `horizon` is the number of the horizon."""
    count, arcs = len(boundaries.whole), boundaries.arcs
    empty = ~boundaries.whole & (_count(arcs.mirror, count) == 0)
    area, vector_area, first, volume = _integrals(boundaries)
    passed, circles = _far_points(arcs)
    corners = _count(arcs.mirror, count) - _count(passed, count)
    _, loose = arc_loops(arcs, boundaries.spread)
    wrong = loose | (arcs.circle == horizon)
    return ClosedFormCells(
        area=area,
        vector_area=vector_area.T,
        first=first.T,
        volume=volume,
        corners=corners,
        edges=corners + _count(circles, count),
        empty=empty,
        closed=_count(arcs.mirror[wrong], count) == 0,
        rim=_edges(boundaries),
    )


def _count(mirror: Ints, count: int) -> Ints:
    return np.bincount(mirror, minlength=count)


def _edges(boundaries: CellBoundaries) -> CellEdges:
    arcs, maps = boundaries.arcs, boundaries.maps.take(boundaries.arcs.mirror)
    along = (arcs.s[0], arcs.s.mean(axis=0), arcs.s[1])
    points = np.stack([to_surface(maps, arcs.point(s)).T for s in along], axis=1)
    return CellEdges(arcs.mirror, arcs.circle, points)


def _integrals(boundaries: CellBoundaries) -> tuple[Floats, Floats, Floats, Floats]:
    """Area (M,), vector area and first moment (3, M), volume (M,)."""
    mine = boundaries.maps.surfaces
    p, n, k = mine.point, mine.normal, mine.curvature
    area, local = cell_moments(boundaries.maps, boundaries.arcs, boundaries.whole)
    axes = np.stack([boundaries.maps.right, boundaries.maps.up, n])
    first = np.einsum("aim,am->im", axes, local)
    # On the surface x.n = p.n0 + d.e: linear in d = x - p, for n = n0 + k d and d.(2 n0 + k d) = 0.
    height, e = dot(p, n), k * p - n
    volume = height * area + dot(e, first)
    return area, n * area + k * first, p * area + first, volume / 3


def _far_points(arcs: MapArcs) -> tuple[Ints, Ints]:
    """Mirrors of circles whose farthest point lies inside an edge; and of full circles.

    A mirror is repeated for each such circle.
    """
    begin, end = arcs.t[0] == -np.inf, arcs.t[1] == np.inf
    circle = arcs.mirror * (arcs.circle.max(initial=0) + 1) + arcs.circle
    start = np.flatnonzero(begin)
    return arcs.mirror[start[np.isin(circle[start], circle[end])]], arcs.mirror[begin & end]

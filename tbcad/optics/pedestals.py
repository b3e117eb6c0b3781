"""Cells of mirrors that stand on pedestals: no edge depends on a neighbour's sphere.

Each cell is cut from its sphere by planes, so its sides are circular arcs; below them planar walls
with straight edges reach down to the bottoms of the grooves, which are straight lines (see
`pedestal_borders`). All of it has a closed form.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tbcad.geometry.vectors import FLIP_X, dot, norm, unit
from tbcad.optics.cells import Arcs, Cells, cells_of, plane_sections, rings_of
from tbcad.optics.pedestal_borders import PedestalLayout, cell_pairs, pedestal_layout
from tbcad.optics.power_diagram import PLANES, NotRegularError
from tbcad.optics.surfaces import Surfaces, planes
from tbcad.types import Bools, Floats, Ints

# Borders that are too short are joined to a corner of four cells or more; each round joins some.
MAX_ROUNDS = 20
MIN_SIDES = 3


@dataclass(frozen=True)
class PedestalCells(Cells):
    """Cells of one camera's mirrors on pedestals, and the walls below them.

    Faces are the m mirrors, the seam, the foot plane, then w walls. Corners are those of the
    mirrors in the order of `rings`, then those of the grooves' bottoms.

    Attributes:
        layout: where the pedestals stand.
        edges: see `arcs`.
        outlines: see `rings`.
        walls: for each wall the mirror above it and the one across its groove, (w, 2).
        wall_rings: sides of each wall, counter-clockwise from outside, (w, 4).
    """

    layout: PedestalLayout
    edges: Arcs
    outlines: tuple[Ints, Ints]
    walls: Ints
    wall_rings: Ints

    @property
    def mirrors(self) -> int:
        """Number of mirrors m."""
        return len(self.surfaces) - PLANES - len(self.walls)

    @cached_property
    def arcs(self) -> Arcs:
        """Arcs along the mirrors, then the straight edges of the walls."""
        return self.edges

    @cached_property
    def rings(self) -> tuple[Ints, Ints]:
        """Sides of each mirror's cell, as `Cells.rings` has them."""
        return self.outlines

    def mirrored(self) -> "PedestalCells":
        """The other camera's cells: mirror image in the plane x = 0."""
        layout = self.layout
        other = pedestal_cells(
            layout.flat.mirrored(),
            layout.mirrors.mirrored(),
            layout.pinhole * FLIP_X,
            layout.groove,
        )
        return other.with_mirrors(self.mirror_surfaces.mirrored())

    def with_mirrors(self, mirrors: Surfaces) -> "PedestalCells":
        """Other mirrors (m of them) on the same pedestals: borders and grooves stay.

        Raises:
            NotRegularError: a mirror lies below the bottom of its grooves.
        """
        bounding = self.surfaces.subset(slice(self.mirrors, self.mirrors + PLANES))
        return _standing(self.layout, mirrors.joined(bounding))


def pedestal_cells(flat: Cells, mirrors: Surfaces, pinhole: Floats, groove: float) -> PedestalCells:
    """Cells of mirrors on pedestals.

    Args:
        flat: cells of planar mirrors with the same apices (`flattened`).
        mirrors: m of them.
        pinhole: of the camera, mm, (3,).
        groove: width at the mirrors' corners, mm, above 0.

    Raises:
        NotRegularError: the grooves leave no outline of a mirror.
    """
    pairs, surfaces = (
        cell_pairs(flat),
        mirrors.joined(flat.surfaces.subset(slice(flat.mirrors, None))),
    )
    start, end = pairs.triangles.T
    short = norm(flat.corners[start] - flat.corners[end]) < groove
    for _ in range(MAX_ROUNDS):
        corner = _joined_corners(len(flat.triangles), start[short], end[short])
        kept = pairs.faces[corner[start] != corner[end]]
        if np.bincount(kept.ravel(), minlength=flat.mirrors)[: flat.mirrors].min() < MIN_SIDES:
            break
        layout = pedestal_layout(flat, mirrors, pairs, corner, pinhole, groove)
        sides = _outline_sides(layout, surfaces)
        added = layout.borders.pair[sides.border[sides.length < groove]]
        if not len(added):
            return _Assembly(layout, surfaces, sides).cells()
        short[added] = True
    raise NotRegularError(f"grooves of {groove:g} mm leave no outline of a mirror")


def flattened(surfaces: Surfaces, triangles: Ints, pinhole: Floats) -> Cells:
    """Cells of planar mirrors that send the rays to their apices on to the origin.

    Args:
        surfaces: the m mirrors, then the two bounding planes.
        triangles: a dual triangulation that is right or nearly so, (t, 3).
        pinhole: of the camera, mm, (3,).

    Raises:
        NotRegularError: when the planes bound no proper cells.
    """
    m = len(surfaces) - PLANES
    apex, normal = surfaces.apex, surfaces.normal.copy()
    normal[:m] = unit(unit(pinhole - apex[:m]) - unit(apex[:m]))
    return cells_of(Surfaces(apex, normal, np.zeros(len(surfaces))), triangles)


def _standing(layout: PedestalLayout, surfaces: Surfaces) -> PedestalCells:
    """Mirrors, followed by the two bounding planes, on pedestals."""
    return _Assembly(layout, surfaces, _outline_sides(layout, surfaces)).cells()


def _joined_corners(triangles: int, start: Ints, end: Ints) -> Ints:
    """Numbers of corners, one for each triangle (t,), when pairs of triangles share theirs."""
    graph = coo_array((np.ones(len(start)), (start, end)), shape=(triangles, triangles))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


@dataclass(frozen=True)
class _Sides:
    """Sides of all cells, one cell after another, counter-clockwise from outside, q of them.

    Attributes:
        offsets: where each cell's sides start, (m + 1,).
        cell: (q,).
        border: (q,).
        back: whether the cell follows the border from end to start, (q,).
        following: next side of the cell, (q,).
        corner: at which each side starts, (q,).
        normal: of the plane that ends the cell, into the cell, (q, 3).
        point: where the side starts on the mirror, mm, (q, 3).
        length: along the border, mm, (q,).
    """

    offsets: Ints
    cell: Ints
    border: Ints
    back: Ints
    following: Ints
    corner: Ints
    normal: Floats
    point: Floats
    length: Floats


def _outline_sides(layout: PedestalLayout, surfaces: Surfaces) -> _Sides:
    """Sides of the cells of mirrors, which are followed by the two bounding planes."""
    cells, corners, borders = layout.flat, layout.corners, layout.borders
    side = np.full(3 * len(cells.triangles), -1)
    side[layout.pairs.half_edges[borders.pair]] = np.arange(2 * len(borders.pair)).reshape(-1, 2)
    offsets, sides = rings_of(cells.triangles, cells.mirrors, side)
    border, back = sides // 2, sides % 2
    cell = np.repeat(np.arange(cells.mirrors), np.diff(offsets))
    following = np.arange(len(sides)) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    corner, normal = borders.ends[border, back], borders.normal[border, back]
    before = np.empty_like(normal)
    before[following] = normal
    point = _above(surfaces, cell, corners.bottom[corner], np.cross(before, normal))
    height = np.where(_grooved(layout)[corner], -surfaces.value(cell, corners.bottom[corner]), 1)
    if not height.min() > 0:
        raise NotRegularError(f"a groove ends {-height.min():.3g} mm above a mirror")
    along = unit(corners.flat[corner[following]] - corners.flat[corner])
    length = dot(point[following] - point, along)
    return _Sides(offsets, cell, border, back, following, corner, normal, point, length)


def _grooved(layout: PedestalLayout) -> Bools:
    """At which corners (c,) a groove ends."""
    inner = layout.borders.between_mirrors(layout.flat.mirrors)
    return np.isin(np.arange(len(layout.corners.top)), layout.borders.ends[inner])


def _above(surfaces: Surfaces, mirror: Ints, bottom: Floats, line: Floats) -> Floats:
    """Where lines (q, 3) through points (q, 3) below surfaces (q,), or near them, leave them."""
    line, value = unit(line), surfaces.value(mirror, bottom)
    slope = dot(line, surfaces.gradient(mirror, bottom))
    line *= np.where(slope < 0, -1.0, 1.0)[:, None]
    root = np.abs(slope) + np.sqrt(slope**2 - 2 * surfaces.curvature[mirror] * value)
    return np.asarray(bottom - (2 * value / root)[:, None] * line)


@dataclass(frozen=True)
class _Assembly:
    """What the faces, edges and corners of pedestals are numbered from."""

    layout: PedestalLayout
    surfaces: Surfaces
    sides: _Sides

    def cells(self) -> PedestalCells:
        """All faces and edges."""
        sides, across = self.sides, self._across
        has_wall = across < len(self.surfaces) - PLANES
        wall = np.flatnonzero(has_wall)
        start = self.layout.corners.bottom[sides.corner[wall]]
        surfaces = self.surfaces.joined(planes(start, -sides.normal[wall]))
        beyond = across.copy()
        beyond[wall] = len(self.surfaces) + np.arange(len(wall))
        arcs, wall_rings = self._edges(surfaces, beyond, has_wall)
        return PedestalCells(
            surfaces,
            self.layout.flat.triangles,
            np.concatenate([sides.point, self.layout.corners.bottom]),
            self.layout,
            arcs,
            (sides.offsets, 2 * np.arange(len(sides.cell))),
            np.column_stack([sides.cell, across])[wall],
            wall_rings[wall],
        )

    @property
    def _across(self) -> Ints:
        """The face across each side, (q,)."""
        return np.asarray(self.layout.borders.faces[self.sides.border, 1 - self.sides.back])

    def _edges(self, surfaces: Surfaces, beyond: Ints, has_wall: Bools) -> tuple[Arcs, Ints]:
        """All edges, and four sides for each side of a cell: those of its wall, if it has one.

        First come the sides themselves, then the walls' upright edges, then the grooves' bottoms.

        Args:
            surfaces: with the walls.
            beyond: face across each side: its wall or a bounding plane, (q,).
            has_wall: which sides have one, (q,).
        """
        sides, q = self.sides, len(self.sides.cell)
        before = np.empty(q, dtype=np.int64)
        before[sides.following] = np.arange(q)
        upright = np.flatnonzero(has_wall | has_wall[before])
        forward, backward = self._both_sides(has_wall)
        bottom = q + sides.corner
        left = np.concatenate([sides.cell, beyond[upright], beyond[forward]])
        right = np.concatenate([beyond, beyond[before[upright]], beyond[backward]])
        start = np.concatenate([np.arange(q), upright, bottom[forward]])
        end = np.concatenate([sides.following, bottom[upright], bottom[backward]])
        points, weight = self._curves(surfaces, start, end)
        arcs = Arcs(left, right, start, end, points, weight, np.zeros(0, dtype=np.int64))
        down, along = np.full((2, q), -1)
        down[upright] = q + np.arange(len(upright))
        along[forward] = 2 * (q + len(upright) + np.arange(len(forward)))
        along[backward] = along[forward] + 1
        rings = [2 * np.arange(q) + 1, 2 * down, along, 2 * down[sides.following] + 1]
        return arcs, np.column_stack(rings)

    def _both_sides(self, has_wall: Bools) -> tuple[Ints, Ints]:
        """The sides on the two walls of each groove, the one that follows its border first."""
        back, border = self.sides.back[has_wall], self.sides.border[has_wall]
        side, order = np.flatnonzero(has_wall), np.lexsort((back, border))
        return side[order][0::2], side[order][1::2]

    def _curves(self, surfaces: Surfaces, start: Ints, end: Ints) -> tuple[Floats, Floats]:
        """Control polygons and weights: arcs on the mirrors first, the others straight."""
        sides, q = self.sides, len(self.sides.cell)
        every = np.concatenate([sides.point, self.layout.corners.bottom])
        a, b = every[start], every[end]
        points, weight = np.stack([a, (a + b) / 2, b], axis=1), np.ones(len(start))
        points[:q], weight[:q] = plane_sections(surfaces, sides.cell, sides.normal, a[:q], b[:q])
        return points, weight

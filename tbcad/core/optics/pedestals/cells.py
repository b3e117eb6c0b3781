"""Cells of mirrors that stand on pedestals: no edge depends on a neighbour's sphere.

Each cell is cut from its sphere by planes, so its sides are circular arcs; below them planar walls
with straight edges reach down to the bottoms of the grooves, which are straight lines (see
`borders`). All of it has a closed form.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tbcad.core.geometry.vectors import FLIP_X, dot
from tbcad.core.optics.cells import Arcs, Cells, FaceIntegrals, arc_steps, plane_sections
from tbcad.core.optics.pedestals.borders import ON_PLANE_MM, PedestalLayout, Sides, outline_sides
from tbcad.core.optics.pedestals.plan import PedestalPlan, planned
from tbcad.core.optics.power_diagram import PLANES, NotRegularError
from tbcad.core.optics.surfaces import Surfaces, planes
from tbcad.types import Bools, Floats, Ints

MIDDLE = 0.5


@dataclass(frozen=True)
class PedestalCells(Cells):
    """Cells of one camera's mirrors on pedestals, and the walls below them.

    Faces are the m mirrors, the seam, the foot plane, then w walls. Corners are those of the
    mirrors in the order of `rings`, then those of the grooves' bottoms.
    """

    layout: PedestalLayout  # where the pedestals stand
    edges: Arcs  # see `arcs`
    outlines: tuple[Ints, Ints]  # see `rings`
    walls: Ints  # for each wall the mirror above it and the one across its groove, (w, 2)
    wall_rings: Ints  # sides of each wall, counter-clockwise from outside, (w, 4)

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
        plan = planned(layout.flat.mirrored(), layout.pinhole * FLIP_X, layout.groove)
        other = pedestal_cells(plan, layout.mirrors.mirrored())
        return replace(other.with_mirrors(self.mirror_surfaces.mirrored()), coat=self.coat)

    def with_mirrors(self, mirrors: Surfaces) -> "PedestalCells":
        """Other mirrors (m of them) on the same pedestals: borders and grooves stay.

        NotRegularError if a mirror lies below the bottom of its grooves.
        """
        bounding = self.surfaces.subset(slice(self.mirrors, self.mirrors + PLANES))
        return _cells(self.layout, mirrors.joined(bounding))


def pedestal_cells(plan: PedestalPlan, mirrors: Surfaces) -> PedestalCells:
    """Cells of m mirrors on pedestals, by the plan for mirrors with these apices.

    NotRegularError if the grooves leave no outline of a mirror, or a pedestal sticks out beyond a
    bounding plane.
    """
    layout = plan.layout_for(mirrors)
    cells = _cells(layout, layout.with_planes(mirrors))
    planes = np.arange(cells.mirrors, cells.mirrors + PLANES)
    lowest = cells.surfaces.value(planes, cells.corners[:, None]).min()
    if lowest < -ON_PLANE_MM:
        beyond = f"{-lowest:.3g} mm beyond the seam or the foot"
        raise NotRegularError(f"grooves of {layout.groove:g} mm reach {beyond}")
    return cells


def _cells(layout: PedestalLayout, surfaces: Surfaces) -> PedestalCells:
    """Cells of mirrors, followed by the two bounding planes, on pedestals."""
    return _Assembly(layout, surfaces, outline_sides(layout, surfaces)).cells()


@dataclass(frozen=True)
class _Assembly:
    """What the faces, edges and corners of pedestals are numbered from."""

    layout: PedestalLayout
    surfaces: Surfaces
    sides: Sides

    def cells(self) -> PedestalCells:
        """All faces and edges."""
        sides = self.sides
        across = self.layout.borders.faces[sides.border, 1 - sides.back]
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

    def _edges(self, surfaces: Surfaces, beyond: Ints, has_wall: Bools) -> tuple[Arcs, Ints]:
        """All edges, and four sides for each side of a cell: those of its wall, if it has one.

        First come the sides themselves, then the walls' upright edges, then the grooves' bottoms.
        Beyond each side lies its wall or a bounding plane, (q,).
        """
        sides, q = self.sides, len(self.sides.cell)
        before = np.empty(q, dtype=np.int64)
        before[sides.following] = np.arange(q)
        upright = np.flatnonzero(has_wall | has_wall[before])
        # The sides on the two walls of each groove, the one that follows its border first.
        order = np.lexsort((sides.back[has_wall], sides.border[has_wall]))
        forward, backward = np.flatnonzero(has_wall)[order].reshape(-1, 2).T
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

    def _curves(self, surfaces: Surfaces, start: Ints, end: Ints) -> tuple[Floats, Floats]:
        """Control polygons and weights: arcs on the mirrors first, the others straight."""
        sides, q = self.sides, len(self.sides.cell)
        every = np.concatenate([sides.point, self.layout.corners.bottom])
        a, b = every[start], every[end]
        points, weight = np.stack([a, (a + b) / 2, b], axis=1), np.ones(len(start))
        points[:q], weight[:q] = plane_sections(surfaces, sides.cell, sides.normal, a[:q], b[:q])
        return points, weight


@dataclass(frozen=True)
class GrooveWalls:
    """Walls of one half, w of them, mirror after mirror; none where neighbouring spheres meet."""

    mirror: Ints  # that each ends, (w,)
    table: Floats  # middle of that mirror's edge, normal into its cell, curvature 0, (w, 7)

    @classmethod
    def of_planes(cls, mirror: Ints, point: Floats, normal: Floats) -> "GrooveWalls":
        """Walls that end mirrors (w,) at planes through points, with normals, (w, 3) each."""
        return cls(mirror, np.column_stack([point, normal, np.zeros(len(mirror))]))

    @classmethod
    def none(cls) -> "GrooveWalls":
        """No walls: mirrors end where neighbouring spheres meet."""
        return cls.of_planes(np.arange(0), np.empty((0, 3)), np.empty((0, 3)))

    def __len__(self) -> int:
        return len(self.mirror)

    @property
    def point(self) -> Floats:
        """Middle of the mirror's edge at each wall, mm, (w, 3)."""
        return self.table[:, :3]

    @property
    def normal(self) -> Floats:
        """Unit normals into the mirrors' cells, (w, 3)."""
        return self.table[:, 3:6]

    def first_of_mirrors(self, mirrors: int) -> Ints:
        """Where the walls of each of m mirrors begin, and where those of the last end, (m + 1,)."""
        return np.searchsorted(self.mirror, np.arange(mirrors + 1))

    def of_mirrors(self, mirrors: int) -> tuple[Ints, Floats]:
        """For loops: where the walls of m mirrors begin, (m + 1,), points and normals, (w, 6)."""
        return self.first_of_mirrors(mirrors), np.ascontiguousarray(self.table[:, :6])

    def joined(self, other: "GrooveWalls") -> "GrooveWalls":
        """These walls and others, mirror after mirror."""
        mirror = np.concatenate([self.mirror, other.mirror])
        order = np.argsort(mirror, kind="stable")
        return GrooveWalls(mirror[order], np.concatenate([self.table, other.table])[order])

    def flipped(self, signs: Floats) -> "GrooveWalls":
        """These walls with points and normals times -1 or 1 along the axes, (3,)."""
        return GrooveWalls.of_planes(self.mirror, self.point * signs, self.normal * signs)


NO_WALLS = GrooveWalls.none()


def groove_walls(cells: Cells) -> GrooveWalls:
    """The walls of a camera's cells, in the order of `PedestalCells.walls`."""
    if not isinstance(cells, PedestalCells):
        return NO_WALLS
    first = len(cells.surfaces) - len(cells.walls)
    edge = cells.wall_rings[:, 0] // 2
    point = cells.arcs.at(edge, np.full(len(edge), MIDDLE))
    return GrooveWalls.of_planes(cells.walls[:, 0], point, -cells.surfaces.normal[first:])


def wall_integrals(cells: PedestalCells, origin: Floats) -> FaceIntegrals:
    """Integrals over the walls, with an origin (3,), mm.

    A wall is taken as triangles with one corner at an end of the groove's bottom. Those along the
    arc are infinitely thin: Gauss's rule adds them up to rounding.
    """
    normal = cells.surfaces.normal[cells.mirrors + PLANES :]
    near, far = _bottoms(cells, origin)
    arc = cells.wall_rings[:, 0] // 2
    x, step = arc_steps(cells.arcs, arc)
    x = np.concatenate([x - origin, ((cells.arcs.points[arc, 2] - origin + far) / 2)[:, None]], 1)
    step = np.concatenate([step, (far - cells.arcs.points[arc, 2] + origin)[:, None]], axis=1)
    # Arcs turn counter-clockwise about their walls seen from the light.
    area = dot(np.cross(x - near[:, None], step), normal[:, None]) / 2
    middle = near[:, None] + (x - near[:, None]) * 2 / 3
    first, areas = np.einsum("wk,wkx->wx", area, middle), area.sum(axis=1)
    cones = dot(first, normal)  # x.n is the same all over a wall
    moment = ((cones / areas)[:, None] * first).sum(axis=0) / 4
    return FaceIntegrals(origin, float(cones.sum()) / 3, moment, float(areas.sum()))


def _bottoms(cells: PedestalCells, origin: Floats) -> tuple[Floats, Floats]:
    """Ends of the groove's bottom below the start and the end of each wall's arc, two (w, 3)."""
    bottom = cells.wall_rings[:, 2]
    ends: Ints = np.stack([cells.arcs.start, cells.arcs.end])[:, bottom // 2]
    near, far = np.where(bottom % 2 == 0, ends, ends[::-1])
    return cells.corners[near] - origin, cells.corners[far] - origin

"""Walls of the grooves between mirrors on pedestals: planes that end one mirror each."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import dot
from tbcad.core.optics.cell_moments import arc_steps
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.types import Floats, Ints

MIDDLE = 0.5


@dataclass(frozen=True)
class GrooveWalls:
    """Walls of one half, w of them, mirror after mirror; none where neighbouring spheres meet."""

    mirror: Ints  # that each ends, (w,)
    # the middle of that mirror's edge at the wall, the unit normal into the mirror's cell, and a
    # curvature of 0, (w, 7)
    table: Floats

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
        """Where the walls of each of m mirrors begin, (m + 1,), and all points and normals, (w, 6).

        As compiled loops take them.
        """
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


@dataclass(frozen=True)
class WallMoments:
    """Integrals over w walls."""

    area: Floats  # mm^2, (w,)
    first: Floats  # integral of the place, from the origin, mm^3, (w, 3)
    normal: Floats  # out of the solid, (w, 3)

    @property
    def volume(self) -> float:
        """Between the origin and all walls, mm^3: a third of the integral of x.n."""
        return float(dot(self.first, self.normal).sum()) / 3

    @property
    def volume_moment(self) -> Floats:
        """Integral of x over that volume, mm^4, (3,): x.n is the same all over a wall."""
        height = dot(self.first, self.normal) / self.area
        return np.asarray((height[:, None] * self.first).sum(axis=0)) / 4


def wall_moments(cells: PedestalCells, origin: Floats) -> WallMoments:
    """Moments of the walls about an origin (3,), mm.

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
    return WallMoments(area.sum(axis=1), np.einsum("wk,wkx->wx", area, middle), normal)


def _bottoms(cells: PedestalCells, origin: Floats) -> tuple[Floats, Floats]:
    """Ends of the groove's bottom below the start and the end of each wall's arc, two (w, 3)."""
    bottom = cells.wall_rings[:, 2]
    ends: Ints = np.stack([cells.arcs.start, cells.arcs.end])[:, bottom // 2]
    near, far = np.where(bottom % 2 == 0, ends, ends[::-1])
    return cells.corners[near] - origin, cells.corners[far] - origin

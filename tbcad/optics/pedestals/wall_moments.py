"""Integrals over the walls of pedestals: planes between straight lines and one arc."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import dot
from tbcad.optics.cell_moments import arc_steps
from tbcad.optics.pedestals.cells import PedestalCells
from tbcad.optics.power_diagram import PLANES
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class WallMoments:
    """Integrals over w walls.

    Attributes:
        area: mm^2, (w,).
        first: integral of the place, from the origin, mm^3, (w, 3).
        normal: out of the solid, (w, 3).
    """

    area: Floats
    first: Floats
    normal: Floats

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

"""Sides of the mirrors on pedestals: where the walls cut the spheres."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.cells import rings_of
from tbcad.core.optics.pedestals.borders import PedestalLayout
from tbcad.core.optics.power_diagram import NotRegularError
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Bools, Floats, Ints


@dataclass(frozen=True)
class Sides:
    """Sides of all mirrors on pedestals, one cell after another, q of them.

    They run counter-clockwise, seen from outside.
    """

    offsets: Ints  # where each cell's sides start, (m + 1,)
    cell: Ints  # (q,)
    border: Ints  # (q,)
    back: Ints  # whether the cell follows the border from end to start, (q,)
    following: Ints  # next side of the cell, (q,)
    corner: Ints  # at which each side starts, (q,)
    normal: Floats  # of the plane that ends the cell, into the cell, (q, 3)
    point: Floats  # where the side starts on the mirror, mm, (q, 3)
    # along the border, mm, on the mirror or between the bottoms of the grooves at its ends,
    # whichever is shorter, (q,)
    length: Floats


def outline_sides(layout: PedestalLayout, surfaces: Surfaces) -> Sides:
    """Sides of the cells of mirrors on pedestals; surfaces are m mirrors, then the two planes.

    NotRegularError if a mirror lies below the end of a groove.
    """
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
    bottom = corners.bottom[corner]
    point = _above(surfaces, cell, bottom, np.cross(before, normal))
    height = np.where(_grooved(layout)[corner], -surfaces.value(cell, bottom), 1)
    if not height.min() > 0:
        raise NotRegularError(f"a groove ends {-height.min():.3g} mm above a mirror")
    along = unit(corners.flat[corner[following]] - corners.flat[corner])
    length = np.minimum(*(dot(line[following] - line, along) for line in (point, bottom)))
    return Sides(offsets, cell, border, back, following, corner, normal, point, length)


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

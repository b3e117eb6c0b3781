"""What each mirror covers, by exact rays: camera -> edge of the cell -> past the object."""

from collections.abc import Callable

import numpy as np

from tbcad.optics.cells import Cells
from tbcad.optics.side_rays import misses_of_mirrors
from tbcad.types import Floats, Ints

# Samples of each arc: first over all of it, then between the neighbours of the smallest one.
SAMPLES = 9
# After three rounds the samples are a 128th of the arc apart; a parabola does the rest.
ROUNDS = 3


def cell_sides(cells: Cells) -> tuple[Ints, Ints]:
    """Mirror (e,) and arc (e,) of each side of a cell."""
    arc, which = np.nonzero(cells.arcs.faces < cells.mirrors)
    return cells.arcs.faces[arc, which], arc


def limiting_sides(cells: Cells) -> tuple[Ints, Ints]:
    """Mirror (e,) and arc (e,) of each side of a cell that limits what its mirror covers.

    The cut of a halved mirror does not: its other half belongs to the other camera and shares its
    virtual camera, so the cut itself does not limit the two together.
    """
    mirror, arc = cell_sides(cells)
    cut = (cells.arcs.faces[arc] == cells.seam).any(axis=1)
    limiting = ~(cells.halved[mirror] & cut)
    return mirror[limiting], arc[limiting]


def coverage_diameters(cells: Cells, pinhole: Floats) -> Floats:
    """Coverage diameter of each mirror by exact rays, mm, (m,).

    It is twice the smallest distance from the origin of all rays camera -> edge of the cell ->
    reflected. The virtual camera sees the whole capture sphere of the paper's section 3 when its
    coverage diameter is at least that of the sphere.

    Args:
        cells: of one camera's m mirrors.
        pinhole: of the camera, mm, (3,).
    """
    mirror, arc = limiting_sides(cells)

    surfaces, points, weight = cells.surfaces, cells.arcs.points[arc], cells.arcs.weight[arc]
    mirrors = np.column_stack([surfaces.apex, surfaces.normal, surfaces.curvature])

    def miss(t: Floats) -> Floats:
        return misses_of_mirrors(points, weight, mirror, mirrors, pinhole, t)

    smallest = parabola_minima(samples_about_minima(miss, len(arc), ROUNDS))
    return 2 * minima_by_mirror(mirror, smallest, cells.mirrors)


def samples_about_minima(function: Callable[[Floats], Floats], curves: int, rounds: int) -> Floats:
    """Values (k, SAMPLES) about the minimum on [0, 1] of each of k curves.

    Args:
        function: takes parameters (k, SAMPLES), one row a curve, and returns the values there.
        curves: number of curves, k.
        rounds: each samples evenly between the neighbours of the last round's smallest sample.
    """
    low, high = np.zeros(curves), np.ones(curves)
    row = np.arange(curves)
    for _ in range(rounds):
        t = np.linspace(low, high, SAMPLES, axis=1)
        values = function(t)
        best = np.argmin(values, axis=1)
        low, high = t[row, np.maximum(best - 1, 0)], t[row, np.minimum(best + 1, SAMPLES - 1)]
    return values


def parabola_minima(values: Floats) -> Floats:
    """Minimum (k,) of each row (k, s) of even samples, on the parabola through its neighbours.

    For samples a, b, c with the smallest in the middle the parabola's vertex lies
    (c - a)^2 / (8 (a - 2 b + c)) below b. Where the smallest is at an end, it is the minimum.
    """
    row, best = np.arange(len(values)), np.argmin(values, axis=1)
    middle = np.clip(best, 1, values.shape[1] - 2)
    before, centre, after = (values[row, middle + k] for k in (-1, 0, 1))
    bend, slope = before - 2 * centre + after, after - before
    inside = (best == middle) & (bend > 0)
    result: Floats = values[row, best]
    result[inside] -= (slope**2)[inside] / (8 * bend)[inside]
    return result


def minima_by_mirror(mirror: Ints, values: Floats, mirrors: int) -> Floats:
    """Smallest of the values (e,) of each mirror's sides, (mirrors,); infinite without sides."""
    smallest = np.full(mirrors, np.inf)
    np.minimum.at(smallest, mirror, values)
    return smallest

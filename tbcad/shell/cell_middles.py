"""A point of each cell from which its whole outline is in sight: facets fan out from it."""

import numpy as np
from scipy.optimize import linprog

from tbcad.geometry.vectors import dot, perpendicular_axes, unit
from tbcad.optics.surfaces import Surfaces
from tbcad.shell.cell_outlines import CellOutlines
from tbcad.spec.errors import SpecError
from tbcad.types import Floats, Ints

# The search is in a plane, so what it finds on a sphere is looked for again from there.
ROUNDS = 3


def means(points: Floats, cell: Ints) -> Floats:
    """Mean of the points of each cell, (m, 3)."""
    counts = np.bincount(cell)[:, None]
    return np.column_stack([np.bincount(cell, weights=points[:, k]) for k in range(3)]) / counts


def middles(outlines: CellOutlines, mirrors: Surfaces) -> Floats:
    """Middle of each cell on its sphere, mm, (m, 3).

    It is that of the outline's points, or, where these do not all see it, the point that is
    farthest inside all lines along the outline: a cell may have a side that bends inward, at the
    foot.

    Raises:
        SpecError: when no point of a cell sees its whole outline.
    """
    every, cell, edge = np.arange(len(mirrors)), outlines.cell, outlines.points
    middle = mirrors.projected(every, means(edge, cell))
    outside = -mirrors.gradient(cell, edge)
    inward = unit(np.cross(outside, edge[outlines.following] - edge))
    for _ in range(ROUNDS):
        hidden = np.unique(cell[dot(inward, middle[cell] - edge) <= 0])
        if not len(hidden):
            return middle
        normal = mirrors.gradient(hidden, middle[hidden])
        for k, axes in zip(hidden, perpendicular_axes(normal), strict=True):
            lines = edge[cell == k], inward[cell == k]
            middle[k] += _deepest_step(middle[k], axes, *lines)
        middle = mirrors.projected(every, middle)
    raise SpecError(
        f"a side of mirror a{hidden[0] + 1:04d} bends so far inward that no point of the mirror "
        "sees its whole outline: make optics.semi_minor_mm larger or increase optics.n"
    )


def _deepest_step(start: Floats, axes: Floats, point: Floats, inward: Floats) -> Floats:
    """Step (3,) along axes (2, 3) to where the smallest distance inside all lines is largest.

    Args:
        start: mm, (3,).
        axes: of the plane, unit vectors (2, 3).
        point: on each line, mm, (b, 3).
        inward: unit vectors across the lines, (b, 3).
    """
    # Unknowns: both steps and the smallest distance, which is to be largest.
    table = np.column_stack([-inward @ axes.T, np.ones(len(point))])
    solution = linprog([0, 0, -1], A_ub=table, b_ub=dot(inward, start - point), bounds=(None, None))
    step: Floats = np.asarray(solution.x)[:2] @ axes
    return step

"""Walls of pedestals below the mirrors, as facets."""

import numpy as np

from tbcad.optics.pedestals.cells import PedestalCells
from tbcad.shell.cell_outlines import CellOutlines, rows_and_columns
from tbcad.types import Ints


def wall_facets(cells: PedestalCells, outlines: CellOutlines) -> Ints:
    """Triangles (t, 3) over the outlines' vertices, counter-clockwise seen from the light.

    Below the first half of its arc a wall fans out from the near end of the groove's bottom, below
    the second half from the far end.
    """
    arc, bottom = cells.wall_rings[:, 0] // 2, cells.wall_rings[:, 2]
    forward = bottom % 2 == 0
    ends = outlines.start[bottom // 2], outlines.end[bottom // 2]
    near, far = np.where(forward, ends, ends[::-1])
    half = outlines.segments[arc] // 2
    wall, k = rows_and_columns(outlines.segments[arc])
    tip = np.where(k < half[wall], near[wall], far[wall])
    here, after = (outlines.at(arc[wall], step) for step in (k, k + 1))
    middle = outlines.at(arc, half)
    fans = np.column_stack([here, after, tip])
    return np.concatenate([fans, np.column_stack([middle, far, near])])

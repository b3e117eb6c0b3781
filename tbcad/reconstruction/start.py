"""Where a fit starts that goes on from the field of the frame before."""

import numpy as np

from tbcad.reconstruction.adam import Moments
from tbcad.reconstruction.field import Field
from tbcad.reconstruction.fit import (
    BORDER,
    FIRST_COLOUR,
    FIRST_NUMBER,
    Settings,
    State,
    first_state,
)
from tbcad.reconstruction.grid import Grid, resampled
from tbcad.reconstruction.marching import GLOSSY, MATT
from tbcad.types import Bools

SKIPPED = 1  # coarse grids that are left out
KNOWN = 0.05  # share of a node that must lie in the last field


def start(inside: Bools, last: Field | None, capture_mm: float, settings: Settings) -> State:
    """An even fog in a hull (k, k, k), or what the last field has there on a finer grid.

    Args:
        inside: where the object may be now.
        last: field of the frame before.
        capture_mm: diameter of the capture sphere.
        settings: of the fit.
    """
    if last is None or len(settings.levels) <= SKIPPED:
        return first_state(inside, capture_mm, settings)
    nodes = settings.levels[SKIPPED].nodes
    grid = Grid.about(resampled(inside.astype(np.float32), nodes) > BORDER, capture_mm)
    columns = GLOSSY if settings.order else MATT
    values = np.zeros((len(grid), columns), dtype=np.float32)
    values[:, 0], values[:, 1:MATT] = FIRST_NUMBER, FIRST_COLOUR
    known = grid.sampled(last.grid.dense(np.ones(len(last.grid), dtype=np.float32)))
    there = known > KNOWN
    for k in range(min(columns, last.values.shape[1])):
        sampled = grid.sampled(last.grid.dense(last.values[:, k]))
        values[there, k] = sampled[there] / known[there]
    return State(SKIPPED, 0, grid, values, Moments(np.zeros_like(values), np.zeros_like(values)))

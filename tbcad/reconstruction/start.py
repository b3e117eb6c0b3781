"""Where a fit starts that goes on from the field of the frame before."""

import numpy as np

from tbcad.reconstruction.field import Field
from tbcad.reconstruction.fit import Settings, State, first_state
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
    state = first_state(inside, capture_mm, settings, SKIPPED)
    grid, values = state.grid, state.values
    known = grid.sampled(last.grid.dense(np.ones(len(last.grid), dtype=np.float32)))
    there = known > KNOWN
    for k in range(min(values.shape[1], last.values.shape[1])):
        sampled = grid.sampled(last.grid.dense(last.values[:, k]))
        values[there, k] = sampled[there] / known[there]
    return state

"""The slow way to the coverage of mirrors: every face cuts every edge, every part is refined."""

import numpy as np
from numba import njit

from tbcad.tolerancing.montecarlo.cell_edges import (
    AREA,
    CROSSINGS,
    MISS_SQUARED,
    ROUNDS,
    _reflect,
    _sample,
)
from tbcad.tolerancing.montecarlo.draws import ShellDraws
from tbcad.tolerancing.montecarlo.edge_model import (
    CURVATURE,
    EdgeModel,
    form_tables,
    surface_tables,
    view_tables,
)
from tbcad.tolerancing.montecarlo.edge_samples import (
    PLACES,
    SAMPLES,
    least_sample,
    parabola_minimum,
    picture_area,
    screen_crossings,
)
from tbcad.tolerancing.montecarlo.visible_edges import (
    EDGE_COLUMNS,
    INTERVALS,
    _cut,
    _end_parameter,
    _value_along,
    find_edge,
)


def every_edge(half: EdgeModel, draws: ShellDraws) -> np.ndarray:
    """What `trace_cell_edges` finds in s builds, (s, m, 3)."""
    return np.array(
        [
            _trace(surfaces, forms, half.pairs.arrays, half.halved, view, half.screen)
            for surfaces, forms, view in zip(
                surface_tables(half, draws),
                form_tables(half, draws),
                view_tables(half, draws),
                strict=True,
            )
        ]
    )


@njit
def _trace(surfaces, forms, pairs, halved, view, screen):  # type: ignore[no-untyped-def]
    pair, offset, face, reach = pairs
    result, samples = np.zeros((len(halved), 3)), np.empty(PLACES)
    result[:, MISS_SQUARED] = np.inf
    edge, spans, spare = np.empty(EDGE_COLUMNS), np.empty((INTERVALS, 2)), np.empty((INTERVALS, 2))
    for e in range(len(pair)):
        p, q = pair[e]
        if surfaces[q, CURVATURE] > surfaces[p, CURVATURE]:
            p, q = q, p
        if not find_edge(surfaces[p], surfaces[q], edge):
            continue
        end, count = _end_parameter(reach[e], edge[-1]), 1
        spans[0, 0], spans[0, 1] = -end, end
        for k in face[offset[e] : offset[e + 1]]:
            a, b, c = _value_along(surfaces[k], edge)
            count = _cut(a, b, c, spans, spare, count)
        for i, other, sign in ((p, q, 1), (q, p, -1)):
            if i < len(result):
                for s in range(count):
                    low, high = spans[s]
                    _sample(edge, (low, high), view, surfaces, forms, (p, q), samples)
                    result[i, AREA] += sign * picture_area(view, samples)
                    if halved[i] and other == len(result):
                        continue
                    _reflect(surfaces, forms, i, view, samples)
                    result[i, CROSSINGS] += screen_crossings(screen[i], samples)
                    for _ in range(ROUNDS - 1):
                        best, step = least_sample(samples), (high - low) / (SAMPLES - 1)
                        low, high = (
                            max(low, low + (best - 1) * step),
                            min(high, low + (best + 1) * step),
                        )
                        _sample(edge, (low, high), view, surfaces, forms, (i, other), samples)
                        _reflect(surfaces, forms, i, view, samples)
                    result[i, MISS_SQUARED] = min(
                        result[i, MISS_SQUARED], parabola_minimum(samples)
                    )
    return result

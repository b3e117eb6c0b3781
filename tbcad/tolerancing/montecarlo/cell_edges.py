"""Coverage of every mirror of one half from the edges of its cell: compiled.

The parts of the edges that can be seen are sampled once; where that leaves open which part holds
the minimum of a mirror, they are sampled about their minima ever more closely.
"""

from math import inf

import numpy as np

from tbcad.compiled import compiled_loop
from tbcad.tolerancing.montecarlo.edge_samples import (
    DISTANCE,
    PLACES,
    SAMPLES,
    least_sample,
    lower_bound,
    parabola_minimum,
    picture_area,
    reflect_samples,
    sample_points,
    screen_crossings,
)
from tbcad.tolerancing.montecarlo.form_samples import displace_samples, reflect_formed_samples
from tbcad.tolerancing.montecarlo.neighbour_pairs import PairArrays
from tbcad.tolerancing.montecarlo.visible_edges import (
    CURVATURE,
    EDGE_COLUMNS,
    INTERVALS,
    find_edge,
    visible_spans,
)
from tbcad.types import Bools, Floats

# Samplings of a part of an edge, over all of it and then about the minimum; a parabola refines
# the last.
ROUNDS = 4

# Columns of the result.
MISS_SQUARED, CROSSINGS, AREA = 0, 1, 2
# Columns of a part of an edge: the edge, its mirror, the other face, the parameters between which
# the minimum is, the minimum sample, and what the minimum is not below.
EDGE, MIRROR, OTHER, LOW, HIGH, LEAST, BOUND, COLUMNS = 0, 10, 11, 12, 13, 14, 15, 16


@compiled_loop
def trace_cell_edges(
    surfaces: Floats,
    forms: Floats,
    pairs: PairArrays,
    halved: Bools,
    view: Floats,
    screen: Floats,
    worst_only: bool,
) -> Floats:
    """Coverage of every mirror of one half, from the edges of its cell.

    Args:
        surfaces: apex, normal, curvature of the m mirrors, the seam, the foot, and the foot at
            the mirrors near it, (f, 7).
        forms: waviness of the surfaces, see tbcad.tolerancing.montecarlo.form_samples, (f, ...);
            of none where no mirror has any.
        pairs: see tbcad.tolerancing.montecarlo.neighbour_pairs.
        halved: mirrors whose seam edge does not limit their coverage, (m,).
        view: pinhole, object's centre, scale, and the camera's axes right, down, forward, in the
            frame of the shell, (6, 3).
        screen: for each mirror two axes and the normal of a plane through the object, (m, 3, 3).
        worst_only: of the minima only that of all mirrors is exact, the others are not below
            theirs; and no areas.

    Returns:
        For each mirror (m, 3): the minimum distance squared of its rays from the object's centre,
        inf without an edge; how often the outline's image crosses the first axis of its screen;
        and the area of the cell's picture at unit distance.
    """
    pair, offset, face, reach = pairs
    formed = len(forms) > 0
    result = np.zeros((len(halved), 3))
    parts, count, samples = np.empty((len(pair), COLUMNS)), 0, np.empty(PLACES)
    edge, spans, spare = np.empty(EDGE_COLUMNS), np.empty((INTERVALS, 2)), np.empty((INTERVALS, 2))
    for e in range(len(pair)):
        p, q = pair[e, 0], pair[e, 1]
        if surfaces[q, CURVATURE] > surfaces[p, CURVATURE]:
            p, q = q, p
        if not find_edge(surfaces[p], surfaces[q], edge):
            continue
        faces = face[offset[e] : offset[e + 1]]
        for s in range(visible_spans(surfaces, faces, edge, reach[e], spans, spare)):
            low, high = spans[s]
            sample_points(edge, low, high, view, samples)
            area = 0.0 if worst_only else picture_area(view, samples)
            if formed:
                _count_crossings(surfaces, halved, view, screen, p, q, samples, result)
                displace_samples(view, surfaces, forms, (p, q), samples)
            for i, other, sign in ((p, q, 1), (q, p, -1)):
                if i >= len(result):
                    continue
                result[i, AREA] += sign * area
                if halved[i] and other == len(result):
                    continue
                _reflect(surfaces, forms, i, view, samples)
                if not formed:
                    result[i, CROSSINGS] += screen_crossings(screen[i], samples)
                if count == len(parts):
                    parts = np.concatenate((parts, np.empty_like(parts)))
                _put_part(parts[count], i, other, edge, low, high, samples)
                count += 1
    result[:, MISS_SQUARED] = _minima(
        surfaces, forms, view, parts[:count], len(result), worst_only, samples
    )
    return result


@compiled_loop
def _count_crossings(
    surfaces: Floats,
    halved: Bools,
    view: Floats,
    screen: Floats,
    p: int,
    q: int,
    samples: Floats,
    result: Floats,
) -> None:
    """Add the crossings of an edge's images off the spheres of both its faces.

    Edges that waviness displaces end beside each other, so that a line may slip through.
    """
    for i, other in ((p, q), (q, p)):
        if i < len(result) and not (halved[i] and other == len(result)):
            reflect_samples(surfaces[i], view, samples)
            result[i, CROSSINGS] += screen_crossings(screen[i], samples)


@compiled_loop
def _sample(
    edge: Floats,
    span: tuple[float, float],
    view: Floats,
    surfaces: Floats,
    forms: Floats,
    faces: tuple[int, int],
    samples: Floats,
) -> None:
    """Fill in points of the edge of two faces, and rays to them."""
    sample_points(edge, span[0], span[1], view, samples)
    if len(forms) > 0:
        displace_samples(view, surfaces, forms, faces, samples)


@compiled_loop
def _reflect(surfaces: Floats, forms: Floats, mirror: int, view: Floats, samples: Floats) -> None:
    if len(forms) == 0:
        reflect_samples(surfaces[mirror], view, samples)
    else:
        reflect_formed_samples(surfaces[mirror], forms[mirror], view, samples)


@compiled_loop
def _put_part(
    part: Floats, mirror: int, other: int, edge: Floats, low: float, high: float, samples: Floats
) -> None:
    least, step = least_sample(samples), (high - low) / (SAMPLES - 1)
    part[MIRROR], part[OTHER] = mirror, other
    for k in range(EDGE_COLUMNS):
        part[EDGE + k] = edge[k]
    part[LOW], part[HIGH] = max(low, low + (least - 1) * step), min(high, low + (least + 1) * step)
    part[LEAST], part[BOUND] = samples[DISTANCE + least], lower_bound(samples, least)


@compiled_loop
def _minima(
    surfaces: Floats,
    forms: Floats,
    view: Floats,
    parts: Floats,
    m: int,
    worst_only: bool,
    samples: Floats,
) -> Floats:
    """Minimum distance squared of each mirror's rays, (m,); see `trace_cell_edges`."""
    sampled, refined = np.full(m, inf), np.full(m, inf)
    for part in parts:
        i = int(part[MIRROR])
        sampled[i] = min(sampled[i], part[LEAST])
    limit = np.full(1, sampled.min()) if worst_only else sampled.copy()
    for part in parts:
        i = int(part[MIRROR])
        place = 0 if worst_only else i
        if not part[BOUND] > limit[place]:  # NaN too
            least = _refined(surfaces, forms, view, part, limit[place], samples)
            refined[i], limit[place] = min(refined[i], least), min(limit[place], least)
    return np.where(np.isinf(refined), sampled, refined)


@compiled_loop
def _refined(
    surfaces: Floats, forms: Floats, view: Floats, part: Floats, limit: float, samples: Floats
) -> float:
    """Minimum distance squared of the rays at a part of an edge.

    Where it cannot be below the limit, the minimum sample of the first round that shows it.
    """
    edge, low, high = part[EDGE:], part[LOW], part[HIGH]
    mirror, other = int(part[MIRROR]), int(part[OTHER])
    for r in range(ROUNDS - 1):
        if r > 0:
            least, step = least_sample(samples), (high - low) / (SAMPLES - 1)
            if lower_bound(samples, least) > limit:
                return float(samples[DISTANCE + least])
            low, high = max(low, low + (least - 1) * step), min(high, low + (least + 1) * step)
        _sample(edge, (low, high), view, surfaces, forms, (mirror, other), samples)
        _reflect(surfaces, forms, mirror, view, samples)
    return parabola_minimum(samples)

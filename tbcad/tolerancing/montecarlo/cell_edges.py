"""Coverage of every mirror of one half from the edges of its cell: compiled.

The parts of the edges that can be seen are sampled once; where that leaves open which part holds
the minimum of a mirror, they are sampled about their minima ever more closely.

A cutter that is a ball, or a polisher that rounds a mandrel's ridges, leaves a fillet in each
valley. It touches a mirror where a ball of its radius lies on the mirror and on its neighbour; its
centre is then on the edge of both surfaces moved out by the radius, which are spheres and planes
again. So a mirror's outline is that of its cell among the moved surfaces, taken back along the
normals, exactly. Seam and foot are no valleys: there the outline stays in the plane, and so the
centres lie in another plane for each mirror (`_plane_of_centres`).
"""

from math import inf

import numpy as np

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.core.geometry.loop_vectors import dot, minus, plus_scaled, vector
from tbcad.tolerancing.montecarlo.edge_model import PairArrays
from tbcad.tolerancing.montecarlo.edge_samples import (
    DISTANCE,
    PLACES,
    SAMPLES,
    VALLEY,
    least_sample,
    lower_bound,
    parabola_minimum,
    reflect_samples,
    sample_points,
    screen_crossings,
    touch_samples,
)
from tbcad.tolerancing.montecarlo.form import displace_samples, reflect_formed_samples
from tbcad.tolerancing.montecarlo.visible_edges import (
    APEX,
    CURVATURE,
    EDGE_COLUMNS,
    INTERVALS,
    NORMAL,
    find_edge,
    visible_spans,
)
from tbcad.types import Bools, Floats, Ints

# Samplings of a part of an edge, over all of it and then about the minimum; a parabola refines
# the last.
ROUNDS = 4
# Instead of the number of the mirror that an edge is of: of both.
BOTH = -1

# Columns of the result.
MISS_SQUARED, CROSSINGS = 0, 1
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
            the mirrors near it, (f, 7); with fillets in the valleys, mirrors moved out by their
            radius.
        forms: waviness of the surfaces, see tbcad.tolerancing.montecarlo.form, (f, ...);
            of none where no mirror has any.
        pairs: see tbcad.tolerancing.montecarlo.edge_model.
        halved: mirrors whose seam edge does not limit their coverage, (m,).
        view: pinhole, object's centre, scale, in the frame of the shell, and the radius of the
            valleys' fillets, (4, 3).
        screen: for each mirror two axes and the normal of a plane through the object, (m, 3, 3).
        worst_only: of the minima only that of all mirrors is exact, the others are not below
            theirs.

    Returns:
        For each mirror (m, 2): the minimum distance squared of its rays from the object's centre,
        inf without an edge, and how often the outline's image crosses the first axis of its screen.
    """
    pair, offset, face, reach = pairs
    formed, rounded = len(forms) > 0, view[VALLEY, 0] > 0
    centres = surfaces.copy() if rounded else surfaces
    result = np.zeros((len(halved), 2))
    parts, count, samples = np.empty((len(pair), COLUMNS)), 0, np.empty(PLACES)
    edge, spans, spare = np.empty(EDGE_COLUMNS), np.empty((INTERVALS, 2)), np.empty((INTERVALS, 2))
    for e in range(len(pair)):
        p, q = pair[e, 0], pair[e, 1]
        if surfaces[q, CURVATURE] > surfaces[p, CURVATURE]:
            p, q = q, p
        faces = face[offset[e] : offset[e + 1]]
        # Both mirrors share an edge of their surfaces; an edge of centres is of one of them.
        for own in (p, q) if rounded else (BOTH, len(result)):
            if own >= len(result):
                continue
            others = (p + q - own, len(result))
            _put_planes_of_centres(surfaces, own, others, faces, view[VALLEY, 0], centres)
            if not find_edge(centres[p], centres[q], edge):
                continue
            for s in range(visible_spans(centres, faces, edge, reach[e], spans, spare)):
                low, high = spans[s]
                sample_points(edge, low, high, view, samples)
                _touch(surfaces, own, view, samples)
                if formed:
                    _count_crossings(surfaces, halved, view, screen, (p, q), own, samples, result)
                    displace_samples(view, surfaces, forms, (p, q), samples)
                    _touch(surfaces, own, view, samples)
                for i, other in ((p, q), (q, p)):
                    if not _limits_coverage(i, other, own, halved):
                        continue
                    _reflect(surfaces, forms, i, view, samples)
                    if not formed:
                        result[i, CROSSINGS] += screen_crossings(screen[i], samples)
                    parts = _with_room(parts, count)
                    _put_part(parts[count], i, other, edge, low, high, samples)
                    count += 1
    _put_minima(surfaces, forms, view, parts[:count], worst_only, samples, result)
    return result


@compiled_part
def _count_crossings(
    surfaces: Floats,
    halved: Bools,
    view: Floats,
    screen: Floats,
    faces: tuple[int, int],
    own: int,
    samples: Floats,
    result: Floats,
) -> None:
    """Add the crossings of an edge's images off the spheres of its own face, or of both.

    Edges that waviness displaces end beside each other, so that a line may slip through.
    """
    for k in range(2):
        i = faces[k]
        if _limits_coverage(i, faces[1 - k], own, halved):
            reflect_samples(surfaces[i], view, samples)
            result[i, CROSSINGS] += screen_crossings(screen[i], samples)


@compiled_part
def _limits_coverage(i: int, other: int, own: int, halved: Bools) -> bool:
    """Whether an edge of a face and another, of its own face or both, limits what it covers."""
    m = len(halved)
    return i < m and own in (BOTH, i) and not (halved[i] and other == m)


@compiled_part
def _with_room(parts: Floats, count: int) -> Floats:
    """The same parts with at least one place more."""
    if count < len(parts):
        return parts
    more = np.empty((2 * len(parts), COLUMNS))
    for k in range(count):
        for column in range(COLUMNS):
            more[k, column] = parts[k, column]
    return more


@compiled_part
def _touch(surfaces: Floats, own: int, view: Floats, samples: Floats) -> None:
    """Take points of centres to where their balls touch a mirror, where valleys have fillets."""
    if view[VALLEY, 0] > 0:
        touch_samples(surfaces[own], view, samples)


@compiled_part
def _put_planes_of_centres(
    surfaces: Floats,
    mirror: int,
    others: tuple[int, int],
    faces: Ints,
    radius: float,
    centres: Floats,
) -> None:
    """Fill in where centres of balls of a radius are that touch a mirror in a plane's points.

    A point x of the mirror and its centre are x and x + radius n(x), which is linear in x; so each
    plane (of the faces, and the first of `others`; the second is the number of mirrors) becomes a
    parallel plane.
    """
    if radius == 0:
        return
    normal, apex = vector(surfaces[mirror], NORMAL), vector(surfaces[mirror], APEX)
    bend = radius * surfaces[mirror, CURVATURE]
    for place in range(-1, len(faces)):
        k = others[0] if place < 0 else faces[place]
        if k < others[1]:
            continue
        plane, across = vector(surfaces[k], APEX), vector(surfaces[k], NORMAL)
        value = bend * dot(minus(plane, apex), across) + radius * dot(normal, across)
        moved = plus_scaled(plane, value / (1 - bend), across)
        centres[k, APEX], centres[k, APEX + 1], centres[k, APEX + 2] = moved


@compiled_part
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
    _touch(surfaces, faces[0], view, samples)


@compiled_part
def _reflect(surfaces: Floats, forms: Floats, mirror: int, view: Floats, samples: Floats) -> None:
    if len(forms) == 0:
        reflect_samples(surfaces[mirror], view, samples)
    else:
        reflect_formed_samples(surfaces[mirror], forms[mirror], view, samples)


@compiled_part
def _put_part(
    part: Floats, mirror: int, other: int, edge: Floats, low: float, high: float, samples: Floats
) -> None:
    least, step = least_sample(samples), (high - low) / (SAMPLES - 1)
    part[MIRROR], part[OTHER] = mirror, other
    for k in range(EDGE_COLUMNS):
        part[EDGE + k] = edge[k]
    part[LOW], part[HIGH] = max(low, low + (least - 1) * step), min(high, low + (least + 1) * step)
    part[LEAST], part[BOUND] = samples[DISTANCE + least], lower_bound(samples, least)


@compiled_part
def _put_minima(
    surfaces: Floats,
    forms: Floats,
    view: Floats,
    parts: Floats,
    worst_only: bool,
    samples: Floats,
    result: Floats,
) -> None:
    """Fill in the minimum distance squared of each mirror's rays; see `trace_cell_edges`."""
    m, worst = len(result), inf
    sampled, refined, limit = np.full(m, inf), np.full(m, inf), np.full(m, inf)
    for part in parts:
        i = int(part[MIRROR])
        sampled[i] = min(sampled[i], part[LEAST])
        worst = min(worst, sampled[i])
    for i in range(m):
        limit[i] = worst if worst_only else sampled[i]
    for part in parts:
        i = int(part[MIRROR])
        place = 0 if worst_only else i
        if not part[BOUND] > limit[place]:  # NaN too
            least = _refined(surfaces, forms, view, part, limit[place], samples)
            refined[i], limit[place] = min(refined[i], least), min(limit[place], least)
    for i in range(m):
        result[i, MISS_SQUARED] = sampled[i] if refined[i] == inf else refined[i]


@compiled_part
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

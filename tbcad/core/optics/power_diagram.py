"""The power diagram of the mirrors' spheres, by edge flips on its dual triangulation.

A triangle of the dual triangulation is three mirrors whose cells meet at a corner. It starts as the
geodesic polyhedron and is changed only by edge flips, so it is a proper triangulation at every
step. Where four cells meet in one point either diagonal will do: the two corners then coincide. No
tolerance decides the topology, only when the flips stop.
"""

import numpy as np

from tbcad.core.geometry.vectors import dot
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Bools, Floats, Ints

PLANES = 2  # the seam and the foot plane bound the array; they follow the mirrors
# An edge is flipped when a corner lies deeper than this inside the mirror across it. It only keeps
# rounding from flipping an edge to and fro; arcs this short are merged later.
FLIP_DEPTH_MM = 1e-9
MAX_ROUNDS = 200  # flips end within some ten rounds; a search that runs on is going in circles
MAX_STEPS = 64
ROUNDING_MM = 1e-7  # rounding in the test of all corners against all mirrors
MAX_PAIRS = 4_000_000  # pairs of point and surface that are tested at a time: bounds the memory


class NotRegularError(ArithmeticError):
    """No dual triangulation was found whose corners all lie outside the other mirrors."""


def bounded_triangulation(triangles: Ints, u: Floats, kept: Bools) -> Ints:
    """A triangulation of m kept directions, closed by a seam (m) and a foot (m + 1).

    Triangles (t, 3) are outward, over directions u (k, 3), of which some are kept, (k,); new
    indices count these in order.
    """
    new = np.cumsum(kept) - 1
    inner = new[triangles[kept[triangles].all(axis=1)]]
    m = int(kept.sum())
    half = np.concatenate([inner[:, [0, 1]], inner[:, [1, 2]], inner[:, [2, 0]]])
    key = half[:, 0] * m + half[:, 1]
    rim = half[~np.isin(key, half[:, 1] * m + half[:, 0])]
    middle = u[kept][rim].sum(axis=1)
    plane = np.where(middle[:, 0] < middle[:, 2], m, m + 1)
    closing = np.column_stack([rim[:, 1], rim[:, 0], plane])
    return np.concatenate([inner, closing, _plane_ends(rim, plane)])


def _plane_ends(rim: Ints, plane: Ints) -> Ints:
    """Triangles (mirror, seam, foot) where the rim goes from one plane to the other."""
    plane_after = np.empty(rim.max() + 1, dtype=np.int64)
    plane_after[rim[:, 0]] = plane
    after = plane_after[rim[:, 1]]
    change = after != plane
    return np.column_stack([rim[change, 1], plane[change], after[change]])


def half_edges(triangles: Ints) -> tuple[Ints, Ints]:
    """Directed edges (3 t, 2), 3 t + k from corner k of triangle t, and their twins (3 t,)."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = ends.min(axis=1), ends.max(axis=1)
    order = np.lexsort((high, low))
    twin = np.empty(len(ends), dtype=np.int64)
    twin[order[0::2]], twin[order[1::2]] = order[1::2], order[0::2]
    return ends, twin


def corners(surfaces: Surfaces, triangles: Ints) -> Floats:
    """Points where three surfaces (t, 3) meet on the light's side, in closed form, mm, or NaN.

    Two planes of equal power (radical planes) meet in a line, and the line meets the sphere of the
    largest curvature: the corner is the intersection nearer to the mirrors' apices. The two
    bounding planes follow the mirrors.
    """
    pivot = np.argmax(surfaces.curvature[triangles], axis=1)
    row = np.arange(len(triangles))
    p, q, s = (triangles[row, (pivot + k) % 3] for k in range(3))
    gq, hq = radical_planes(surfaces, p, q)
    gs, hs = radical_planes(surfaces, p, s)
    line = np.cross(gq, gs)
    length = np.linalg.norm(line, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = -(hq[:, None] * np.cross(gs, line) + hs[:, None] * np.cross(line, gq)) / length**2
        line = line / length
        mirror = (triangles < len(surfaces) - PLANES)[:, :, None]
        mean_apex = np.mean(surfaces.apex[triangles], axis=1, where=mirror)
        point += dot(line, mean_apex)[:, None] * line
        gradient = surfaces.gradient(p, point)
        slope = dot(line, gradient)
        value = surfaces.value(p, point)
        root = np.copysign(np.sqrt(slope**2 - 2 * surfaces.curvature[p] * value), slope)
        result: Floats = point - (2 * value / (slope + root))[:, None] * line
    return result


def radical_planes(surfaces: Surfaces, p: Ints, q: Ints) -> tuple[Floats, Floats]:
    """Planes g . x + h = 0 of equal power of p and q (k,), p's curvature no less than q's."""
    kp, kq = surfaces.curvature[p], surfaces.curvature[q]
    ratio = np.divide(kq, kp, out=np.zeros_like(kp), where=kp > 0)
    g, h = surfaces.gradient_at_origin, surfaces.value_at_origin
    return g[q] - ratio[:, None] * g[p], h[q] - ratio * h[p]


def flip_until_regular(surfaces: Surfaces, triangles: Ints) -> tuple[Ints, Floats]:
    """Flip edges until no corner is covered by the mirror across an edge.

    From triangles (t, 3), over mirrors followed by the two bounding planes, between which no edge
    is added, to triangles and their corners (t, 3). NotRegularError if no sequence of flips was
    found.
    """
    steps = 1
    while steps <= MAX_STEPS:
        try:
            return _flip_in_steps(surfaces, triangles, steps)
        except NotRegularError:
            steps *= 4
    raise NotRegularError(f"no regular cells were found in {MAX_STEPS} steps from flat mirrors")


def _flip_in_steps(surfaces: Surfaces, start: Ints, steps: int) -> tuple[Ints, Floats]:
    """Flip edges directly, or while the mirrors curve from flat to their radii in some steps.

    Tangent planes of an ellipsoid always bound proper cells; in small steps of curvature each
    flip is then between corners that nearly coincide, where it is sure to be right.
    """
    triangles = start.copy()
    for share in np.linspace(0, 1, steps + 1) if steps > 1 else [1.0]:
        scaled = surfaces.with_curvature(share * surfaces.curvature)
        points = _flip_in_rounds(scaled, triangles)
    return triangles, points


def _flip_in_rounds(surfaces: Surfaces, triangles: Ints) -> Floats:
    """Flip edges of the triangles in place until none is left to flip; return the corners."""
    points = corners(surfaces, triangles)
    for _ in range(MAX_ROUNDS):
        edge, twin = _flips(surfaces, triangles, points)
        if not len(edge):
            break
        changed = flip_edges(triangles, edge, twin)
        points[changed] = corners(surfaces, triangles[changed])
    lowest = lowest_value(surfaces, points)
    if not lowest > -ROUNDING_MM:
        raise NotRegularError(f"a corner lies {-lowest:.3g} mm inside another mirror")
    return points


def lowest_value(surfaces: Surfaces, points: Floats) -> float:
    """Smallest value of any f_j at points (t, 3), mm: below zero a surface covers a point.

    All pairs are tested, so this verifies what the flips found by testing neighbours.
    """
    terms = np.column_stack(
        [surfaces.gradient_at_origin, surfaces.curvature / 2, surfaces.value_at_origin]
    )
    squared = dot(points, points)
    lifted = np.column_stack([points, squared, np.ones(len(points))])
    rows = max(1, MAX_PAIRS // len(surfaces))
    lowest = [np.min(lifted[k : k + rows] @ terms.T) for k in range(0, len(points), rows)]
    return float(np.min(lowest))


def _flips(surfaces: Surfaces, triangles: Ints, points: Floats) -> tuple[Ints, Ints]:
    """Directed edges to flip, at most one in any triangle, and their twins; deepest first."""
    ends, twin = half_edges(triangles)
    edge = np.flatnonzero(np.arange(len(ends)) < twin)
    twin = twin[edge]
    one, other = opposite(triangles, edge), opposite(triangles, twin)
    value = np.minimum(
        surfaces.value(other, points[edge // 3]), surfaces.value(one, points[twin // 3])
    )
    low, high = np.minimum(one, other), np.maximum(one, other)
    new_edge = low * len(surfaces) + high
    present = ends.min(axis=1) * len(surfaces) + ends.max(axis=1)
    possible = (low < len(surfaces) - PLANES) & (low != high)
    flippable = (np.nan_to_num(value, nan=0.0) < -FLIP_DEPTH_MM) & possible
    flippable[flippable] = ~np.isin(new_edge[flippable], present)
    candidates = np.flatnonzero(flippable)
    candidates = candidates[np.argsort(value[candidates], kind="stable")]
    candidates = candidates[_first_in_both(edge[candidates] // 3, twin[candidates] // 3)]
    # Flips of neighbouring triangles could make the same new edge twice.
    _, first = np.unique(new_edge[candidates], return_index=True)
    candidates = candidates[np.sort(first)]
    return edge[candidates], twin[candidates]


def _first_in_both(one: Ints, other: Ints) -> Bools:
    """Which pairs of triangles (k,) are the first in the list to name either of the two."""
    order = np.arange(len(one))
    rank = np.full(max(one.max(initial=0), other.max(initial=0)) + 1, len(one))
    np.minimum.at(rank, one, order)
    np.minimum.at(rank, other, order)
    return np.asarray((rank[one] == order) & (rank[other] == order))


def opposite(triangles: Ints, edge: Ints) -> Ints:
    """The face opposite each directed edge in its triangle, (e,)."""
    return np.asarray(triangles[edge // 3, (edge + 2) % 3])


def flip_edges(triangles: Ints, edge: Ints, twin: Ints) -> Ints:
    """Replace triangles (i, j, k) and (j, i, l) by (k, i, l) and (l, j, k), in place.

    Edges (e,) run from i to j, at most one in any triangle, their twins from j to i. Returned are
    the triangles that changed: those with i, then those with j, (2 e,).
    """
    t, s = edge // 3, twin // 3
    i, j = triangles[t, edge % 3], triangles[t, (edge + 1) % 3]
    k, far = opposite(triangles, edge), opposite(triangles, twin)
    triangles[t] = np.column_stack([k, i, far])
    triangles[s] = np.column_stack([far, j, k])
    return np.concatenate([t, s])

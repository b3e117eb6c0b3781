"""Where ribs and rings are left out, so that the numbers on the bosses' ends can be read.

Each is left out in its whole width, between plane ends: what a round window would leave of it could
be as thin as a knife. What is left between two gaps is left out too when it is short.
"""

import numpy as np

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import outward
from tbcad.prototype.base.seats import Seats
from tbcad.types import Bools, Floats

STEP_MM = 0.25
ROOM_MM = 1.0  # round the end of a boss
SHORTEST_MM = 8.0  # of what is left between gaps
BEYOND_MM = 5.0  # by which a gap's section stands out of the rib


def ring_arcs(base: BaseLayout, ring: Floats, low: float, high: float) -> list[tuple[float, float]]:
    """Azimuths between which a ring (4, 2) of (z, r) is there, within two azimuths, radians."""
    reach = float(ring[:, 1].max())
    azimuth = np.linspace(low, high, int(np.ceil((high - low) * reach / STEP_MM)) + 1)
    z, r = _filled(ring).T
    points = np.stack(
        [
            np.outer(np.cos(azimuth), r),
            np.outer(np.sin(azimuth), r),
            np.ones_like(azimuth)[:, None] * z,
        ],
        axis=-1,
    )
    return _runs(azimuth, _free(base.own_seats, points), SHORTEST_MM / reach)


def rib_gaps(base: BaseLayout, azimuth: float, side: float) -> list[Floats]:
    """Polygons (n, 2) of (z, r) over which a rib at an azimuth is left out.

    Args:
        base: with its seats about z.
        azimuth: of the rib, radians.
        side: of its width, which lies to this side and beyond, of its thickness.
    """
    keys, line = base.keys, base.outline
    place, normal = _along(line)
    deep = keys.rib_height_mm + keys.thickness_mm
    section = np.stack([place - share * deep * normal for share in (0.0, 0.25, 0.5)], axis=1)
    out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    across = np.array([-out[1], out[0], 0.0])
    widths = (side + np.linspace(0, 1, 5)) * keys.rib_mm
    points = section[..., 1, None] * out + section[..., 0, None] * np.array([0.0, 0.0, 1.0])
    points = (points[:, :, None] + widths[:, None] * across).reshape(len(place), -1, 3)
    length = np.arange(len(place), dtype=np.float64) * STEP_MM
    kept = _runs(length, _free(base.own_seats, points), SHORTEST_MM)
    return [_section(place, normal, deep, first, last) for first, last in _between(length, kept)]


def _filled(ring: Floats) -> Floats:
    """Points all over a quadrilateral (4, 2), (25, 2)."""
    s, t = (grid.ravel()[:, None] for grid in np.meshgrid(*[np.linspace(0, 1, 5)] * 2))
    a, b, c, d = ring
    result: Floats = (1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * d + t * c)
    return result


def _free(seats: Seats, points: Floats) -> Bools:
    """Whether none of points (n, s, 3) lies behind the end of a boss, (n,)."""
    away = points[..., None, :] - (seats.centre + seats.back[:, None] * seats.axis)
    along = dot(away, seats.axis)
    beside = norm(away - along[..., None] * seats.axis)
    over = (along > -ROOM_MM) & (beside < seats.boss + ROOM_MM)
    return np.asarray(~over.any(axis=(1, 2)))


def _along(line: Floats) -> tuple[Floats, Floats]:
    """Points of a line (n, 2) at even steps, and unit normals that turn evenly at its corners."""
    part = norm(np.diff(line, axis=0))
    length = np.concatenate([[0.0], np.cumsum(part)])
    at = np.arange(0.0, length[-1], STEP_MM)
    faces = outward(line)
    corner = unit(np.vstack([faces[:1], faces[:-1] + faces[1:], faces[-1:]]))
    place = np.stack([np.interp(at, length, line[:, k]) for k in (0, 1)], axis=1)
    normal = unit(np.stack([np.interp(at, length, corner[:, k]) for k in (0, 1)], axis=1))
    return place, normal


def _spans(mask: Bools) -> list[tuple[int, int]]:
    """First and last of each run of places (n,) where it is so."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True))


def _runs(at: Floats, free: Bools, shortest: float) -> list[tuple[float, float]]:
    """Intervals of places (n,) that are free, without the short ones."""
    pairs = [(float(at[first]), float(at[last])) for first, last in _spans(free)]
    return [(low, high) for low, high in pairs if high - low >= shortest]


def _between(length: Floats, kept: list[tuple[float, float]]) -> list[tuple[int, int]]:
    """First and last step of what is not kept."""
    keep = np.zeros(len(length), dtype=np.bool_)
    for low, high in kept:
        keep |= (length >= low) & (length <= high)
    return _spans(~keep)


def _section(place: Floats, normal: Floats, deep: float, first: int, last: int) -> Floats:
    """Polygon over some steps of a rib's outline, from the wall's middle to beyond the rib."""
    some = np.unique(np.linspace(first, last, 8).round().astype(int))
    outer = place[some] + BEYOND_MM * normal[some]
    inner = place[some] - (deep + BEYOND_MM) * normal[some]
    return np.vstack([outer, inner[::-1]])

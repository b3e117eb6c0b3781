"""Gaps of the carrier's ribs and rings, where they would hide a number on a boss's end.

They are left out in their whole width, between plane ends: a round window could leave remains as
thin as a knife. What remains between two gaps is left out too when it is short.
"""

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import at_azimuths, meridian, outward
from tbcad.prototype.base.seats import Seats
from tbcad.types import Bools, Floats

UP = np.array([0.0, 0.0, 1.0])
STEP_MM, END_STEPS = 0.25, 4
ROOM_MM = 1.0  # round the end of a boss
MIN_PART_MM = 8.0  # of a rib or ring between gaps
BEYOND_MM = 5.0  # by which a gap's section extends beyond the rib
DEPTHS = (0.0, 0.25, 0.5)  # of a rib, as shares of it, where gaps are looked for
WIDTH_POINTS = 5  # across a rib's or ring's section, where gaps are looked for
GAP_POINTS = 8  # of a gap's section along the rib


def ring_arcs(base: BaseLayout, ring: Floats, low: float, high: float) -> list[tuple[float, float]]:
    """Azimuths between which a ring (4, 2) of (z, r) is present, within two azimuths, radians."""
    radius = float(ring[:, 1].max())
    azimuth = np.linspace(low, high, int(np.ceil((high - low) * radius / STEP_MM)) + 1)
    points = at_azimuths(_points_of_section(ring), azimuth)
    return _runs(azimuth, _free(base.local_seats, points), MIN_PART_MM / radius)


def rib_gaps(base: BaseLayout, azimuth: float, side: float) -> list[Floats]:
    """Polygons (n, 2) of (z, r) over which a rib at an azimuth (radians) is left out.

    The rib begins at a side of the azimuth, in its thicknesses.
    """
    spec = base.spec
    place, normal = _points_along(base.outline)
    height = spec.rib_height_mm + spec.thickness_mm
    section = np.stack([place - share * height * normal for share in DEPTHS], axis=1)
    out, across = meridian(azimuth)
    widths = (side + np.linspace(0, 1, WIDTH_POINTS)) * spec.rib_mm
    points = section[..., 1, None] * out + section[..., 0, None] * UP
    points = (points[:, :, None] + widths[:, None] * across).reshape(len(place), -1, 3)
    length, keep = np.arange(len(place), dtype=np.float64) * STEP_MM, np.zeros(len(place), bool)
    for low, high in _runs(length, _free(base.local_seats, points), MIN_PART_MM):
        keep |= (length >= low) & (length <= high)
    gaps = []
    for first, last in _spans(~keep):
        steps = np.unique(np.linspace(first, last, GAP_POINTS).round().astype(int))
        middle = place[steps]
        # A gap at the rib's end goes beyond it: what is left of a step would be a fin.
        if first == 0:
            middle[0] -= END_STEPS * (place[1] - place[0])
        if last == len(place) - 1:
            middle[-1] += END_STEPS * (place[-1] - place[-2])
        outer = middle + BEYOND_MM * normal[steps]
        inner = middle - (height + BEYOND_MM) * normal[steps]
        gaps.append(np.vstack([outer, inner[::-1]]))
    return gaps


def _points_of_section(ring: Floats) -> Floats:
    """Points all over a quadrilateral (4, 2), (WIDTH_POINTS**2, 2)."""
    shares = np.linspace(0, 1, WIDTH_POINTS)
    s, t = (grid.ravel()[:, None] for grid in np.meshgrid(shares, shares))
    a, b, c, d = ring
    return np.asarray((1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * d + t * c))


def _free(seats: Seats, points: Floats) -> Bools:
    """Whether none of points (n, s, 3) is behind the end of a boss, (n,)."""
    from_end = points[..., None, :] - seats.at_depth(seats.back)
    along = dot(from_end, seats.axis)
    beside = norm(from_end - along[..., None] * seats.axis)
    behind = (along > -ROOM_MM) & (beside < seats.boss + ROOM_MM)
    return np.asarray(~behind.any(axis=(1, 2)))


def _points_along(line: Floats) -> tuple[Floats, Floats]:
    """Points of a line (n, 2) at even steps, and unit normals that turn evenly at its corners."""
    length = np.concatenate([[0.0], np.cumsum(norm(np.diff(line, axis=0)))])
    at = np.arange(0.0, length[-1], STEP_MM)
    faces = outward(line)
    corner = unit(np.vstack([faces[:1], faces[:-1] + faces[1:], faces[-1:]]))
    place, normal = (
        np.stack([np.interp(at, length, values[:, k]) for k in (0, 1)], axis=1)
        for values in (line, corner)
    )
    return place, unit(normal)


def _spans(flags: Bools) -> list[tuple[int, int]]:
    """First and last place of each run of set flags (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True))


def _runs(at: Floats, free: Bools, shortest: float) -> list[tuple[float, float]]:
    """Intervals of places (n,) that are free, without the short ones."""
    pairs = [(float(at[first]), float(at[last])) for first, last in _spans(free)]
    return [(low, high) for low, high in pairs if high - low >= shortest]

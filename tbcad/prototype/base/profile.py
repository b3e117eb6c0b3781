"""The carrier's cross-section in the half-plane of the axis: convex lines (z along the axis, r).

Points (n, 2) run from the hub toward the camera, z rising. A convex outline has no dents, so a
wall outside of its corners is outside of all that the outline encloses.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.types import Floats

# Corners of the polygon round the ellipse of light: few, so that the wall has few cones.
OUTLINE_PARTS = 24
ROUNDING_MM = 1e-9
MIN_CORNERS = 4  # of a line that is thinned


@dataclass(frozen=True)
class LightSpheroid:
    """A spheroid that contains all light of all balls: |X| + |X - pinhole| is at most a level.

    The sum of distances to two points is convex. So if it is at most the level on the two spheres
    of a round cone, it is so in the whole cone: a spheroid with the same foci as the mirrors'
    ellipsoid contains all light.
    """

    pinhole: float  # distance along the axis, mm
    level: float  # maximum of the sum, mm

    def excess(self, points: Floats) -> Floats:
        """By how much the sum of distances of points (..., 2 or 3) exceeds the level, mm, (...).

        Axis first. A point is at least half as far from all light.
        """
        return norm(points) + norm(self._from_pinhole(points)) - self.level

    def slope(self, points: Floats) -> Floats:
        """Gradient of the sum of distances at points (..., 2 or 3), (..., 2 or 3)."""
        return unit(points) + unit(self._from_pinhole(points))

    def _from_pinhole(self, points: Floats) -> Floats:
        return np.asarray(points - np.eye(points.shape[-1])[0] * self.pinhole)

    def min_excess(self, corners: Floats) -> Floats:
        """Lower bound (m,) of the excess on each line or facet with corners (m, c, 2 or 3), mm.

        A convex function is above its tangent plane, here the one at the middle.
        """
        middle = corners.mean(axis=1)
        rise = dot(self.slope(middle)[:, None], corners - middle[:, None])
        return np.asarray(self.excess(middle) + rise.min(axis=1))

    def outline(self) -> Floats:
        """Corners of a polygon round the spheroid's half, (OUTLINE_PARTS + 1, 2)."""
        focal, major = self.pinhole / 2, self.level / 2
        minor = np.sqrt(major**2 - focal**2)
        angle = np.pi * (1 - np.arange(OUTLINE_PARTS + 1) / OUTLINE_PARTS)
        circumscribed = 1 / np.cos(np.pi / (2 * OUTLINE_PARTS))
        points = [major, minor] * unit_circle(angle) * circumscribed
        return np.asarray(points + np.array([focal, 0.0]))


def half_plane(points: Floats) -> Floats:
    """Points (..., 3) about z as (z, r), (..., 2)."""
    return np.stack([points[..., 2], norm(points[..., :2])], axis=-1)


def at_azimuths(line: Floats, azimuth: Floats) -> Floats:
    """Points (a, n, 3) about z of a line (n, 2) of (z, r) at azimuths (a,)."""
    z, r = line.T
    x, y = (np.outer(one, r) for one in unit_circle(azimuth).T)
    return np.stack([x, y, np.broadcast_to(z, x.shape)], axis=-1)


def meridian(azimuth: float) -> tuple[Floats, Floats]:
    """Unit vectors (3,) away from the z axis at an azimuth, and toward rising azimuth."""
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    return np.array([cosine, sine, 0.0]), np.array([-sine, cosine, 0.0])


def hull(points: Floats) -> Floats:
    """Upper hull of points (n, 2): corners with rising z, (c, 2)."""
    kept: list[Floats] = []
    for point in points[np.lexsort((points[:, 1], points[:, 0]))]:
        while kept and not _turns_down(kept, point):
            kept.pop()
        kept.append(point)
    return np.array(kept)


def _turns_down(kept: list[Floats], point: Floats) -> bool:
    if len(kept) == 1:
        return bool(point[0] > kept[0][0] + ROUNDING_MM)
    a, b = kept[-1] - kept[-2], point - kept[-1]
    return bool(a[0] * b[1] - a[1] * b[0] < -ROUNDING_MM)


def trimmed(line: Floats, end: float) -> Floats:
    """A line (n, 2) with rising z up to z = end, its last part extended where it is short."""
    last = max(int((line[:, 0] < end - ROUNDING_MM).sum()), 2)
    line = line[: last + 1] if last < len(line) else line
    a, b = line[-2], line[-1]
    return np.vstack([line[:-1], a + (b - a) * (end - a[0]) / (b[0] - a[0])])


def shortened(line: Floats, by: float) -> Floats:
    """A line (n, 2) that ends a distance (mm) earlier; its last part must be longer."""
    return np.vstack([line[:-1], line[-1] - by * unit(line[-1] - line[-2])])


def outward(line: Floats) -> Floats:
    """Unit normals of a line's parts, away from the axis, (n - 1, 2)."""
    along = unit(np.diff(line, axis=0))
    return np.stack([-along[:, 1], along[:, 0]], axis=1)


def offset(line: Floats, by: float) -> Floats:
    """A line moved outward by a distance (mm), mitred at its corners, (n, 2)."""
    normal = outward(line)
    before, after = np.vstack([normal[:1], normal]), np.vstack([normal, normal[-1:]])
    mitre = (before + after) / (1 + dot(before, after))[:, None]
    return line + by * mitre


def thinned(line: Floats, shortest: float) -> Floats:
    """A line round a convex one that has no inner parts shorter than this (mm).

    A short part is removed by extending its neighbours until they meet.
    """
    while len(line) > MIN_CORNERS:
        inner = norm(np.diff(line, axis=0))[1:-1]
        part = int(inner.argmin()) + 1
        if inner.min() >= shortest:
            break
        start, a, end, b = line[part - 1], line[part], line[part + 1], line[part + 2]
        a, b = a - start, b - end
        share = np.linalg.solve(np.stack([a, -b], axis=1), end - start)
        line = np.vstack([line[:part], start + share[0] * a, line[part + 2 :]])
    return line


def distance_outside(line: Floats, points: Floats) -> Floats:
    """Lower bound (...) of the distance of points (..., 2) from a convex line; < 0 inside."""
    return np.asarray(dot(points[..., None, :] - line[:-1], outward(line)).max(axis=-1))

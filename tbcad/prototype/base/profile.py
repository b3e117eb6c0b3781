"""The carrier's cross-section in the half-plane of the axis: convex lines (z along the axis, r).

Points (n, 2) run from the hub toward the camera, z rising. A convex outline has no dents, and
what lies inside of it is proved to be clear of the wall by its corners alone.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.types import Floats

# Corners of the polygon round the ellipse of light: few, so that the wall has few cones.
CORNERS = 24


@dataclass(frozen=True)
class LightSpheroid:
    """All light of all balls: |X| + |X - pinhole| is at most a level.

    The sum of distances to two points is convex. So if it is at most the level on the spheres that
    a round cone is the hull of, it is so in the whole cone: a spheroid with the same foci as the
    mirrors' ellipsoid holds all light.

    Attributes:
        pinhole: distance along the axis, mm.
        level: the sum that no light goes beyond, mm.
    """

    pinhole: float
    level: float

    def beyond(self, points: Floats) -> Floats:
        """How far the sum of distances of points (..., 2 or 3) is beyond the level, mm, (...).

        Axis first. A point is at least half as far from all light.
        """
        away = points - np.eye(points.shape[-1])[0] * self.pinhole
        result: Floats = norm(points) + norm(away) - self.level
        return result

    def slope(self, points: Floats) -> Floats:
        """Gradient of the sum of distances at points (..., 2 or 3), (..., 2 or 3)."""
        away = points - np.eye(points.shape[-1])[0] * self.pinhole
        result: Floats = unit(points) + unit(away)
        return result

    def least_beyond(self, corners: Floats) -> Floats:
        """Lower bound of `beyond` on all of a line or facet with these corners (m, c, 2 or 3).

        A convex function lies above its tangent plane, here the one at the middle.
        """
        middle = corners.mean(axis=1)
        rise = dot(self.slope(middle)[:, None], corners - middle[:, None])
        result: Floats = self.beyond(middle) + rise.min(axis=1)
        return result

    def outline(self) -> Floats:
        """Corners of a polygon round the spheroid's half, (CORNERS + 1, 2)."""
        focal, major = self.pinhole / 2, self.level / 2
        minor = np.sqrt(major**2 - focal**2)
        turn = np.pi * (1 - np.arange(CORNERS + 1) / CORNERS)
        wide = 1 / np.cos(np.pi / (2 * CORNERS))
        points = np.stack([major * np.cos(turn), minor * np.sin(turn)], axis=1) * wide
        result: Floats = points + np.array([focal, 0.0])
        return result


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
        return bool(point[0] > kept[0][0] + 1e-9)
    a, b = kept[-1] - kept[-2], point - kept[-1]
    return bool(a[0] * b[1] - a[1] * b[0] < -1e-9)


def trimmed(line: Floats, end: float) -> Floats:
    """A line (n, 2) with rising z up to z = end, its last part prolonged where it is short."""
    last = max(int((line[:, 0] < end - 1e-9).sum()), 2)
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
    """A convex line without parts shorter than this, as a line that goes round it.

    A short part goes by prolonging its neighbours until they meet.
    """
    while len(line) > 4:
        length = norm(np.diff(line, axis=0))
        inner = length[1:-1]
        part = int(inner.argmin()) + 1
        if inner.min() >= shortest:
            break
        meet = _meeting(line[part - 1 : part + 3])
        line = np.vstack([line[:part], meet, line[part + 2 :]])
    return line


def _meeting(four: Floats) -> Floats:
    """Where the lines through the first two and the last two of four points meet, (2,)."""
    a, b = four[1] - four[0], four[3] - four[2]
    share = np.linalg.solve(np.stack([a, -b], axis=1), four[2] - four[0])
    result: Floats = four[0] + share[0] * a
    return result


def distance_outside(line: Floats, points: Floats) -> Floats:
    """Least distance, never too large, of points (..., 2) beyond a convex line; < 0 inside."""
    normal = outward(line)
    away = points[..., None, :] - line[:-1]
    result: Floats = dot(away, normal).max(axis=-1)
    return result

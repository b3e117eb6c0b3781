"""Points nearest to lines and segments, and angles about an axis, in columns (3, N)."""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.vectors import dot, norm, tangent_basis, unit
from tbcad_verify.types import Floats


def nearest_on_lines(
    point: Floats,
    direction: Floats,
    first: float | Floats = -np.inf,
    last: float | Floats = np.inf,
) -> Floats:
    """(3, N) the points of lines point + t direction that are nearest to the origin.

    Args:
        point: (3, N) or (3, 1).
        direction: (3, N) of any length.
        first: smallest t, (N,) or one for all.
        last: largest t.
    """
    t = -dot(point, direction) / dot(direction, direction)
    return np.asarray(point + np.clip(t, first, last) * direction)


def crossings(point: Floats, direction: Floats, normal: Floats) -> Floats:
    """(3, N) the points where lines cross the planes through the origin with these normals."""
    return np.asarray(point - dot(point, normal) / dot(direction, normal) * direction)


def distances_to_segments(x: Floats, start: Floats, end: Floats) -> Floats:
    """(N,) distances of points x from segments start - end, (3, N) each."""
    edge = end - start
    t = dot(x - start, edge) / np.maximum(dot(edge, edge), np.finfo(np.float64).tiny)
    return norm(x - start - np.clip(t, 0, 1) * edge)


def rotation_angles(axis: Floats, start: Floats, end: Floats) -> Floats:
    """(N,) angles by which `end` is rotated from `start` about unit axes, -pi ... pi.

    Over a closed path about the axis they add up to 2 pi times its winding number.
    """
    first, second = tangent_basis(axis)
    before, after = (np.arctan2(dot(x, second), dot(x, first)) for x in (start, end))
    return wrapped(after - before)


def wrapped(angle: Floats) -> Floats:
    """Angles in -pi ... pi."""
    return np.asarray(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


def axis_frame(pinhole: Floats) -> Floats:
    """(3, 3) rows: unit axis from the origin to the pinhole, azimuth zero (the zenith's), third."""
    axis = pinhole / np.sqrt((pinhole**2).sum())
    up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    up /= np.sqrt((up**2).sum())
    return np.stack([axis, up, np.cross(axis, up)])


def polar_and_azimuth(frame: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Polar angles and azimuths (N,) of directions d (3, N), radians."""
    along, zero, third = (dot(np.broadcast_to(row[:, None], d.shape), d) for row in frame)
    return np.arctan2(np.hypot(zero, third), along), np.arctan2(third, zero)


def angles_between(a: Floats, b: Floats) -> Floats:
    """(N,) angles between columns, radians; exact for small ones too.

    Source: W. Kahan, How Futile are Mindless Assessments of Roundoff, 2006, section 12.
    """
    one, two = unit(a), unit(b)
    return np.asarray(2 * np.arctan2(norm(one - two), norm(one + two)))

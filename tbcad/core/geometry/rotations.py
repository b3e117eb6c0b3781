"""Rotations about an axis, and points on a circle."""

import numpy as np

from tbcad.core.geometry.vectors import dot
from tbcad.types import Floats


def rotated(vectors: Floats, axis: Floats, angle: Floats) -> Floats:
    """Vectors (..., 3) rotated about unit axes by angles (...), radians (Rodrigues), broadcast."""
    axis = np.broadcast_to(axis, vectors.shape)
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    along = dot(axis, vectors)[..., None] * axis
    return np.asarray(cosine * vectors + sine * np.cross(axis, vectors) + (1 - cosine) * along)


def rotated_about_x(points: Floats, angle: Floats) -> Floats:
    """Points (..., 3) rotated about the first axis of their frame by angles (...), radians.

    The first coordinate stays exactly what it is.
    """
    x, y, z = np.moveaxis(points, -1, 0)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([x, cosine * y - sine * z, sine * y + cosine * z], axis=-1)


def even_angles(count: int) -> Floats:
    """Angles (count,) that divide a full turn evenly, from 0, radians."""
    return 2 * np.pi * np.arange(count) / count


def unit_circle(angle: Floats) -> Floats:
    """Points (..., 2) of the unit circle at angles (...), radians."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def bolt_circle(radius: float) -> Floats:
    """Places (4, 2) of four holes evenly on a circle, none on an axis."""
    return radius * unit_circle(np.pi / 4 + even_angles(4))

"""Products, lengths and directions of arrays of vectors along their last axis."""

import numpy as np

from tbcad.types import Floats

FLIP_X = np.array([-1.0, 1.0, 1.0])
"""Factors that reflect points and vectors in the plane x = 0, from one camera to the other."""


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products (...) of vectors (..., 3)."""
    result: Floats = np.einsum("...x,...x->...", a, b)
    return result


def norm(v: Floats) -> Floats:
    """Lengths (...) of vectors (..., 3), to the bit those of np.linalg.norm.

    That adds up three numbers for each vector, which takes six times as long as adding columns.
    """
    square = np.square(v)
    total: Floats = square[..., 0]
    for k in range(1, square.shape[-1]):
        total = total + square[..., k]
    return np.sqrt(total)


def unit(v: Floats) -> Floats:
    """Vectors (..., 3) divided by their lengths; zero vectors stay zero."""
    length = norm(v)[..., None]
    result: Floats = np.divide(v, length, out=np.zeros_like(v), where=length > 0)
    return result


def facet_vectors(corners: Floats) -> Floats:
    """Normals (..., 3) of triangles with corners (..., 3, 3), twice as long as their areas."""
    a, b, c = (corners[..., k, :] for k in range(3))
    return np.cross(b - a, c - a)


def perpendicular_axes(axis: Floats) -> Floats:
    """Two unit vectors (..., 2, 3) that are a right-handed frame with unit axes (..., 3)."""
    first = unit(np.cross(np.eye(3)[np.argmin(np.abs(axis), axis=-1)], axis))
    return np.stack([first, np.cross(axis, first)], axis=-2)

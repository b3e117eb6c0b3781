"""Distances of points from triangles, in columns."""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.vectors import cross, dot, norm
from tbcad_verify.types import Floats

Corners = tuple[Floats, Floats, Floats]  # of F triangles, (3, F) each


def distances(point: Floats, corners: Corners) -> Floats:
    """(F,) distance of one point (3,) from each triangle, mm."""
    a, b, c = corners
    x = np.broadcast_to(point[:, None], a.shape)
    normal = cross(b - a, c - a)
    size = norm(normal)
    flat = size > 0
    unit = normal / np.where(flat, size, 1)
    height = dot(x - a, unit)
    foot = x - height * unit
    inside = flat.copy()
    least = np.full(a.shape[1], np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= dot(cross(end - start, foot - start), unit) >= 0
        least = np.minimum(least, to_segments(x, start, end))
    return np.where(inside, np.abs(height), least)


def to_segments(x: Floats, a: Floats, b: Floats) -> Floats:
    """(N,) distance of points from segments a - b, (3, N) each."""
    way = b - a
    t = dot(x - a, way) / np.maximum(dot(way, way), np.finfo(np.float64).tiny)
    return norm(x - a - np.clip(t, 0, 1) * way)

"""Spheroids about a camera's ellipsoid, whose semi-axes are both longer by one length."""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.record.export import Camera
from tbcad_verify.types import Floats

MERIDIAN = 2001  # rays between two spheroids
HALVINGS = 60


def growth(semi_axes: Floats, camera: Camera, point: Floats) -> Floats:
    """(N,) by how much both semi-axes must grow for the spheroid to pass through points, mm.

    `semi_axes`: of the camera's ellipsoid along its axis and across it, (2,) mm.
    `point`: (3, N) mm.
    """
    offset = point - camera.pinhole[:, None] / 2
    along = dot(offset, unit(camera.pinhole[:, None]))
    across = np.sqrt(np.maximum(dot(offset, offset) - along**2, 0))
    low, high = np.full(along.size, -semi_axes[1] / 2), norm(offset)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        out = (along / (semi_axes[0] + middle)) ** 2 + (across / (semi_axes[1] + middle)) ** 2 > 1
        low, high = np.where(out, middle, low), np.where(out, high, middle)
    return high


def least_wall(semi_axes: Floats, deepest: float, beyond: float) -> float:
    """Length of the shortest ray between two spheroids, at right angles to the inner, mm."""
    angle = np.linspace(0, np.pi / 2, MERIDIAN)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    inner, outer = ((semi_axes + more)[:, None] for more in (deepest, beyond))
    start, direction = inner * circle / outer, circle / inner
    direction /= np.hypot(*direction) * outer
    # The ray and the outer spheroid, both scaled so that this is a circle.
    a, b, c = (
        (direction**2).sum(axis=0),
        (direction * start).sum(axis=0),
        (start**2).sum(axis=0) - 1,
    )
    return float(((np.sqrt(b * b - a * c) - b) / a).min())

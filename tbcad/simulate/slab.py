"""Rays as points in four dimensions, seen along one direction (Levoy and Hanrahan's light slab).

A ray x(z) = m + z t, with z along the direction and m, t across it, becomes (m, s t) with
s = R / sqrt(3). Then the distance of two points is the root mean square distance of the two rays
over the depth -R ... R of the capture sphere, in mm: of all captured rays the nearest is the one
that runs closest to the wanted ray where the object is.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.simulate.compiled import compiled

Floats = NDArray[np.float64]

# A ray at more than this to the direction has no place in its slab.
LEAST_COSINE = 0.2


@dataclass(frozen=True)
class Slab:
    """A direction to look along.

    Attributes:
        axes: rows: two unit vectors across, and one against the way of the light that is looked
            at, (3, 3).
        scale: s, mm.
    """

    axes: Floats
    scale: float

    def points(self, origin: NDArray[Any], direction: NDArray[Any]) -> Floats:
        """Rays with origins and unit directions (n, 3) as points (n, 4); NaN where too oblique."""
        return _points(
            np.ascontiguousarray(self.axes),
            self.scale,
            np.ascontiguousarray(origin),
            np.ascontiguousarray(direction),
        )

    def place(self, points: Floats) -> Floats:
        """Points (n, 3) in the slab's axes, (n, 3)."""
        return np.asarray(points @ self.axes.T)


def slab_along(forward: Floats, right: Floats, capture_mm: float) -> Slab:
    """The slab of a view along `forward`, whose rows run along `right`."""
    axes = np.stack([right, np.cross(forward, right), forward])
    return Slab(axes, capture_mm / 2 / np.sqrt(3))


@compiled
def _points(axes: Floats, scale: float, origin: NDArray[Any], direction: NDArray[Any]) -> Floats:
    result = np.empty((len(origin), 4))
    for i in range(len(origin)):
        depth = speed = 0.0
        for j in range(3):
            depth += axes[2, j] * origin[i, j]
            speed += axes[2, j] * direction[i, j]
        if speed < LEAST_COSINE:
            result[i] = np.nan
            continue
        for k in range(2):
            across = slope = 0.0
            for j in range(3):
                across += axes[k, j] * origin[i, j]
                slope += axes[k, j] * direction[i, j]
            slope /= speed
            result[i, k] = across - depth * slope
            result[i, 2 + k] = scale * slope
    return result

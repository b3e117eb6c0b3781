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

from tbcad.simulate.parallel import compiled, in_threads
from tbcad.types import Floats

# A ray at more than this to the direction has no place in its slab.
MIN_COSINE = 0.2
RAYS_PER_CHUNK = 1 << 17


@dataclass(frozen=True)
class TwoPlane:
    """A direction to look along.

    Attributes:
        axes: rows: two unit vectors across, and one against the way of the light that is looked
            at, (3, 3).
        scale: s, mm.
    """

    axes: Floats
    scale: float

    def points(
        self,
        origin: NDArray[Any],
        direction: NDArray[Any],
        valid: NDArray[np.bool_] | None = None,
    ) -> Floats:
        """Rays as points (n, 4); NaN where too oblique, or not valid.

        Args:
            origin: mm, (n, 3).
            direction: unit vectors, (n, 3).
            valid: which rays there are, (n,); all of them if None.
        """
        axes, there = np.ascontiguousarray(self.axes), np.ones(0, dtype=np.bool_)
        starts, ways = np.ascontiguousarray(origin), np.ascontiguousarray(direction)
        result = np.empty((len(ways), 4))

        def some(part: slice) -> None:
            marks = there if valid is None else valid[part]
            _points(axes, self.scale, starts[part], ways[part], marks, result[part])

        in_threads(
            some, [slice(k, k + RAYS_PER_CHUNK) for k in range(0, len(ways), RAYS_PER_CHUNK)]
        )
        return result

    def place(self, points: Floats) -> Floats:
        """Points (n, 3) in the slab's axes, (n, 3)."""
        return np.asarray(points @ self.axes.T)


def two_plane_along(forward: Floats, right: Floats, capture_mm: float) -> TwoPlane:
    """The slab of a view along `forward`, whose rows run along `right`."""
    axes = np.stack([right, np.cross(forward, right), forward])
    return TwoPlane(axes, capture_mm / 2 / np.sqrt(3))


@compiled
def _points(
    axes: Floats,
    scale: float,
    origin: NDArray[Any],
    direction: NDArray[Any],
    valid: NDArray[np.bool_],
    result: Floats,
) -> None:
    for i in range(len(origin)):
        if len(valid) > 0 and not valid[i]:
            result[i] = np.nan
            continue
        depth = speed = 0.0
        for j in range(3):
            depth += axes[2, j] * origin[i, j]
            speed += axes[2, j] * direction[i, j]
        if speed < MIN_COSINE:
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

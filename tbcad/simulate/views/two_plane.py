"""Two-plane parametrisation: rays as points in four dimensions, for views along one direction.

A ray x(z) = m + z t, with z along the direction and m, t across it, becomes (m, s t) with
s = R / sqrt(3). Then the distance of two points is the root mean square distance of the two rays
over the depth -R ... R of the capture sphere, in mm: of all captured rays the nearest is the one
that runs closest to the target ray where the object is. (M. Levoy and P. Hanrahan, Light Field
Rendering, 1996, call it a light slab.)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.compiled import compiled
from tbcad.simulate.parallel import chunks, in_threads
from tbcad.types import Bools, Floats

# A ray at more than this to the direction has no coordinates.
MIN_COSINE = 0.2
RAYS_PER_CHUNK = 1 << 17


@dataclass(frozen=True)
class TwoPlane:
    """The parametrisation for one direction.

    Attributes:
        axes: rows: two unit vectors across, and the direction of the view, (3, 3).
        scale: s, mm.
    """

    axes: Floats
    scale: float

    def coordinates(
        self,
        origin: NDArray[np.floating],
        direction: NDArray[np.floating],
        valid: Bools | None = None,
    ) -> Floats:
        """Rays as points (n, 4); NaN where too oblique, or not valid.

        Args:
            origin: mm, (n, 3).
            direction: unit vectors, (n, 3).
            valid: which rays there are, (n,); all of them if None.
        """
        origin, direction = np.ascontiguousarray(origin), np.ascontiguousarray(direction)
        valid = np.ones(len(direction), dtype=np.bool_) if valid is None else valid
        result = np.empty((len(direction), 4))

        def fill(part: slice) -> None:
            self.fill(result[part], origin[part], direction[part], valid[part])

        in_threads(fill, chunks(len(direction), RAYS_PER_CHUNK))
        return result

    def fill(
        self,
        result: Floats,
        origin: NDArray[np.floating],
        direction: NDArray[np.floating],
        valid: Bools,
    ) -> None:
        """Write the `coordinates` of rays in contiguous arrays into an array (n, 4)."""
        _coordinates(np.ascontiguousarray(self.axes), self.scale, origin, direction, valid, result)

    def place(self, points: Floats) -> Floats:
        """Points (n, 3), mm, along the axes, the third over s, (n, 3)."""
        return np.asarray(points @ self.axes.T / [1, 1, self.scale])


def two_plane_along(forward: Floats, right: Floats, capture_mm: float) -> TwoPlane:
    """The parametrisation for a view along `forward`, whose rows run along `right`."""
    axes = np.stack([right, np.cross(forward, right), forward])
    return TwoPlane(axes, capture_mm / 2 / np.sqrt(3))


@compiled
def _coordinates(
    axes: Floats,
    scale: float,
    origin: NDArray[np.floating],
    direction: NDArray[np.floating],
    valid: Bools,
    result: Floats,
) -> None:
    for i in range(len(origin)):
        depth = speed = 0.0
        for j in range(3):
            depth += axes[2, j] * origin[i, j]
            speed += axes[2, j] * direction[i, j]
        if not valid[i] or speed < MIN_COSINE:
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

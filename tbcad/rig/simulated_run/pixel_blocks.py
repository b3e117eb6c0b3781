"""Square blocks of a photograph's pixels: which may show something, and which do."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label

from tbcad.core.geometry.vectors import norm, unit
from tbcad.types import Bools, Floats, Ints

SIDE = 16  # pixels
ROUNDING = 1e-9  # radians
ALL = np.ones((3, 3))  # neighbours, across corners too


@dataclass(frozen=True)
class PixelBlocks:
    """Cones that hold all rays through the pixels of each block, (r, c)."""

    shape: tuple[int, int]  # of the picture, rows and columns
    middle: Floats  # unit vectors, (r, c, 3)
    half_angle: Floats  # radians, (r, c)

    def about(self, place: Floats, radius: Floats) -> Bools:
        """Blocks (r, c) of which a ray may meet one of some spheres, without a miss.

        Their places (k, 3) are from the pinhole, radii (k,) in the same unit.
        """
        distance = norm(place)
        width = np.arcsin(np.minimum(radius / distance, 1.0))
        width[radius >= distance] = np.pi
        found = np.zeros(self.half_angle.shape, dtype=bool)
        for way, half in zip(place / distance[:, None], width, strict=True):
            apart = 2 * np.arcsin(np.minimum(norm(self.middle - way) / 2, 1.0))
            found |= apart <= half + self.half_angle + ROUNDING
        return found

    def pixels(self, blocks: Bools) -> Ints:
        """Numbers of the pixels of some blocks (r, c), counted row by row, ascending, (n,)."""
        whole = blocks.repeat(SIDE, axis=0).repeat(SIDE, axis=1)
        return np.flatnonzero(whole[: self.shape[0], : self.shape[1]])


def pixel_blocks(directions: Floats) -> PixelBlocks:
    """The blocks of a picture whose pixels have unit directions (h, w, 3)."""
    height, width = shape = directions.shape[:2]
    first = np.arange(0, height, SIDE), np.arange(0, width, SIDE)
    last = (np.minimum(begin + SIDE, size) for begin, size in zip(first, shape, strict=True))
    near = [(begin + end - 1) // 2 for begin, end in zip(first, last, strict=True)]
    middle = unit(directions[np.ix_(*near)])
    spread = middle.repeat(SIDE, axis=0)[:height].repeat(SIDE, axis=1)[:, :width]
    chord = norm(directions - spread)
    farthest = np.maximum.reduceat(np.maximum.reduceat(chord, first[0], axis=0), first[1], axis=1)
    return PixelBlocks((height, width), middle, 2 * np.arcsin(farthest / 2))


def boxes_about(picture: NDArray[np.floating], reach: int) -> list[tuple[slice, slice]]:
    """Boxes that hold all that is not zero in a picture (h, w, c), and `reach` pixels about it.

    Boxes may overlap, but what is not zero in one block or in neighbours is in one box.
    """
    height, width, channels = picture.shape
    rows = np.logical_or.reduceat(picture != 0, np.arange(0, height, SIDE), axis=0)
    columns = np.arange(0, width * channels, SIDE * channels)
    groups, _ = label(np.logical_or.reduceat(rows.reshape(len(rows), -1), columns, axis=1), ALL)
    boxes = find_objects(groups)
    return [(_pixels(rows, reach), _pixels(columns, reach)) for rows, columns in boxes]


def _pixels(blocks: slice, reach: int) -> slice:
    return slice(max(SIDE * blocks.start - reach, 0), SIDE * blocks.stop + reach)

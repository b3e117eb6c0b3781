"""A sparse grid: the nodes of a cube where the object may be, and what lies between skipped."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tbcad.types import Bools, Floats, Ints

SIDES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
LONGEST_LEAP = 255  # cells, that fit into a byte


@dataclass(frozen=True)
class Grid:
    """Nodes of a cubic lattice about the origin; v of its n^3 nodes are there.

    Between them values are interpolated linearly, in cells that have all eight corners.
    """

    n: int  # nodes along each edge of the cube
    width_mm: float  # of the cube
    place: NDArray[np.uint16]  # of the nodes in the lattice, in ascending order, (v, 3)

    @staticmethod
    def about(wanted: Bools, width_mm: float) -> "Grid":
        """The nodes of all cells that have a wanted node (n, n, n)."""
        nodes = np.zeros_like(wanted)
        cells = _cells(wanted, np.logical_or)
        for corner in _corners(nodes):
            np.logical_or(corner, cells, out=corner)
        return Grid(len(wanted), width_mm, np.argwhere(nodes).astype(np.uint16))

    def __len__(self) -> int:
        return len(self.place)

    @property
    def pitch_mm(self) -> float:
        """Distance of neighbouring nodes."""
        return self.width_mm / (self.n - 1)

    @cached_property
    def row(self) -> NDArray[np.int32]:
        """Number of each node of the lattice, -1 where it is not there, (n, n, n)."""
        rows = np.full((self.n,) * 3, -1, dtype=np.int32)
        rows[tuple(self.place.T)] = np.arange(len(self), dtype=np.int32)
        return rows

    @cached_property
    def leap(self) -> NDArray[np.uint8]:
        """Cells (n-1, n-1, n-1) from each to the nearest with all corners, along all axes at once.

        0 where it has them itself.
        """
        whole = _cells(self.row >= 0, np.logical_and)
        if not whole.any():
            return np.full(whole.shape, LONGEST_LEAP, dtype=np.uint8)
        away = ndimage.distance_transform_cdt(~whole, "chessboard")
        return np.asarray(np.minimum(away, LONGEST_LEAP), dtype=np.uint8)

    @cached_property
    def neighbours(self) -> NDArray[np.int32]:
        """Numbers of the nodes on the six sides of each node, -1 where there is none, (v, 6)."""
        padded = np.pad(self.row, 1, constant_values=-1)
        at = self.place.astype(np.int64) + 1
        return np.stack([padded[tuple((at + side).T)] for side in SIDES], axis=1)

    @property
    def points(self) -> Floats:
        """Places of the nodes, mm, (v, 3)."""
        return np.asarray(self.place * self.pitch_mm - self.width_mm / 2, dtype=np.float64)

    def dense(self, values: NDArray[np.float32], missing: float = 0.0) -> NDArray[np.float32]:
        """Values of the nodes (v,) on the whole lattice, (n, n, n)."""
        result = np.full((self.n,) * 3, missing, dtype=np.float32)
        result[tuple(self.place.T)] = values
        return result

    def sampled(self, lattice: NDArray[np.float32]) -> NDArray[np.float32]:
        """A lattice (k, k, k) over the same cube at the nodes, linearly, (v,)."""
        at = self.place.T * ((len(lattice) - 1) / (self.n - 1))
        return np.asarray(ndimage.map_coordinates(lattice, at, order=1, mode="nearest"))


def resampled(lattice: NDArray[np.float32], n: int) -> NDArray[np.float32]:
    """A lattice (k, k, k) with n nodes along the same edges, linearly, (n, n, n)."""
    for axis in range(3):
        lattice = _along(lattice, n, axis)
    return lattice


def _along(lattice: NDArray[np.float32], n: int, axis: int) -> NDArray[np.float32]:
    at = np.linspace(0, lattice.shape[axis] - 1, n)
    first: Ints = np.minimum(at.astype(np.int64), lattice.shape[axis] - 2)
    shape = [1, 1, 1]
    shape[axis] = n
    share = (at - first).astype(np.float32).reshape(shape)
    return (1 - share) * lattice.take(first, axis) + share * lattice.take(first + 1, axis)


def _corners(nodes: Bools) -> list[Bools]:
    """Eight views of a lattice (n, n, n): a corner of each cell, (n-1, n-1, n-1)."""
    ends = (slice(None, -1), slice(1, None))
    return [nodes[corner] for corner in product(ends, repeat=3)]


def _cells(nodes: Bools, together: np.ufunc) -> Bools:
    """The eight corners of each cell, together, (n-1, n-1, n-1)."""
    return np.asarray(together.reduce(_corners(nodes)))

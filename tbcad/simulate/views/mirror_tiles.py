"""The captured rays of some mirrors, each mirror a tile of pixels, packed one after another."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad.simulate.capture.light_field import Frame, LightField
from tbcad.types import Floats, Ints

NEIGHBOURS = 6


@dataclass(frozen=True)
class MirrorTile:
    """What one mirror shows.

    Attributes:
        valid: whether a pixel is of this mirror, (h, w).
        colour: (h, w, 3), uint8.
        origin: mm, (h, w, 3), float32.
        direction: (h, w, 3), float32.
        pinhole: point that its rays come nearest to, mm, (3,).
        spread: farthest that one of its rays passes by it, mm.
        middle: number of its pixel that is nearest to the middle, row by row.
    """

    valid: NDArray[np.bool_]
    colour: NDArray[np.uint8]
    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    pinhole: Floats
    spread: float
    middle: int


@dataclass(frozen=True)
class PackedTiles:
    """Tiles of k mirrors in one list of n pixels, row by row.

    Attributes:
        first: pixel that each tile begins with, (k,).
        shape: height and width of each, (k, 2).
        valid: (n,).
        colour: (n, 3), uint8.
        origin: mm, (n, 3).
        direction: (n, 3).
        pinhole: (k, 3), mm.
        spread: (k,), mm.
        middle: pixel in the middle of each, (k,).
    """

    first: Ints
    shape: Ints
    valid: NDArray[np.bool_]
    colour: NDArray[np.uint8]
    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    pinhole: Floats
    spread: Floats
    middle: Ints


@dataclass
class MirrorTiles:
    """Tiles of a light field, each read once.

    Attributes:
        source: the light field; its file must stay open.
        u: directions of the virtual cameras of all frames, one after the other, (m, 3).
        apex: of their mirrors, mm, (m, 3).
        width: no ray of a mirror passes its apex by more, mm, (m,).
    """

    source: LightField
    u: Floats = field(init=False)
    apex: Floats = field(init=False)
    width: Floats = field(init=False)
    _read: dict[int, MirrorTile | None] = field(init=False, default_factory=dict)
    _places: list[tuple[Frame, int]] = field(init=False)

    def __post_init__(self) -> None:
        """Number the mirrors of all frames."""
        frames = list(self.source.frames.values())
        self.u = np.concatenate([frame.u for frame in frames])
        self.apex = np.concatenate([frame.mirrors.apex for frame in frames])
        self.width = np.concatenate([_widths(frame.mirrors.apex) for frame in frames])
        self._places = [(frame, i) for frame in frames for i in range(len(frame.u))]

    def packed(self, mirrors: Ints) -> PackedTiles | None:
        """Tiles of some mirrors, without those that show nothing; None if none shows anything."""
        tiles = [tile for tile in map(self._tile, mirrors.tolist()) if tile is not None]
        if not tiles:
            return None
        shape = np.array([tile.valid.shape for tile in tiles])
        first = np.concatenate([[0], np.cumsum(shape.prod(axis=1))[:-1]])
        return PackedTiles(
            first,
            shape,
            np.concatenate([tile.valid.ravel() for tile in tiles]),
            np.concatenate([tile.colour.reshape(-1, 3) for tile in tiles]),
            np.concatenate([tile.origin.reshape(-1, 3) for tile in tiles]),
            np.concatenate([tile.direction.reshape(-1, 3) for tile in tiles]),
            np.stack([tile.pinhole for tile in tiles]),
            np.array([tile.spread for tile in tiles]),
            first + np.array([tile.middle for tile in tiles]),
        )

    def _tile(self, mirror: int) -> MirrorTile | None:
        if mirror not in self._read:
            self._read[mirror] = _tile(*self._places[mirror])
        return self._read[mirror]


def _widths(apex: Floats) -> Floats:
    """About how far corners of cells are from the apices (m, 3), rather more, (m,).

    Cells of six neighbours have corners at 0.58 of the neighbours' distance; those at the edges
    have fewer, and farther neighbours count for them.
    """
    away, _ = cKDTree(apex).query(apex, k=min(NEIGHBOURS + 1, len(apex)))
    result: Floats = np.asarray(away).reshape(len(apex), -1)[:, -1]
    return result


def _tile(frame: Frame, index: int) -> MirrorTile | None:
    x0, x1, y0, y1 = frame.boxes[index].tolist()
    part = frame.read(slice(y0, y1), slice(x0, x1))
    valid = part["mirror"] == index + 1
    if not valid.any():
        return None
    rows, columns = (np.flatnonzero(valid.any(axis=axis)) for axis in (1, 0))
    cut = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    valid = valid[cut]
    origin, direction = part["origin"][cut], part["direction"][cut]
    pinhole, spread = convergence_point(origin[valid], direction[valid])
    middle = _middle(valid)
    return MirrorTile(valid, part["colour"][cut], origin, direction, pinhole, spread, middle)


def _middle(valid: NDArray[np.bool_]) -> int:
    height, width = valid.shape
    rows, columns = np.nonzero(valid)
    away = (2 * rows - height) ** 2 + (2 * columns - width) ** 2
    return int((rows * width + columns)[away.argmin()])


def convergence_point(origin: NDArray[Any], direction: NDArray[Any]) -> tuple[Floats, float]:
    """Point (3,) with the least squared distance to rays (n, 3), and the largest distance, mm."""
    d = direction.astype(np.float64)
    o = origin.astype(np.float64)
    along = np.einsum("nx,nx->n", o, d)
    matrix = len(d) * np.eye(3) - np.einsum("nx,ny->xy", d, d)
    foot = o - along[:, None] * d
    # One ray, or parallel ones, leave the place along them open: nearest the mirror then.
    point = o.mean(axis=0)
    point = point + np.linalg.lstsq(matrix, foot.sum(axis=0) - matrix @ point, rcond=1e-9)[0]
    away = point - o
    across = away - np.einsum("nx,nx->n", away, d)[:, None] * d
    return point, float(np.sqrt((across**2).sum(axis=1)).max())

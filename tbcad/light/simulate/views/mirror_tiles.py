"""The captured rays of each mirror: a rectangle of pixels, read when first needed."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad.core.geometry.vectors import dot, norm
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField
from tbcad.types import Bools, Bytes, Floats, Ints

NEIGHBOURS = 6
BORDER = ((1, 1), (1, 1), (0, 0))  # a pixel on all sides, of rows, columns and components


@dataclass(frozen=True)
class MirrorTile:
    """A rectangle of h x w pixels that holds a mirror's, row by row; n = h w.

    The pixels on its border are not of the mirror, so that each of the mirror's has 8 neighbours.
    """

    shape: tuple[int, int]  # h and w
    valid: Bools  # whether a pixel is of this mirror, (n,)
    colour: Bytes  # (n, 3)
    origin: NDArray[np.float32]  # of the rays, mm, (n, 3)
    direction: NDArray[np.float32]  # of the rays, (n, 3)
    pinhole: Floats  # point that the rays come nearest to, the virtual camera's, mm, (3,)
    middle: int  # number of the mirror's pixel nearest to the middle of the rectangle


@dataclass
class MirrorTiles:
    """The tiles of all mirrors of a light field, each read once."""

    source: LightField  # the light field; its file must stay open
    # directions of the virtual cameras of all frames, one after the other, (m, 3)
    u: Floats = field(init=False)
    apex: Floats = field(init=False)  # of their mirrors, mm, (m, 3)
    width: Floats = field(init=False)  # no ray of a mirror passes its apex by more, mm, (m,)
    _read: dict[int, MirrorTile | None] = field(init=False, default_factory=dict)
    _mirrors: list[tuple[CameraFrame, int]] = field(init=False)

    def __post_init__(self) -> None:
        """Number the mirrors of all frames."""
        frames = list(self.source.frames.values())
        self.u = np.concatenate([frame.u for frame in frames])
        self.apex = np.concatenate([frame.mirrors.apex for frame in frames])
        self.width = np.concatenate([_widths(frame.mirrors.apex) for frame in frames])
        self._mirrors = [(frame, i) for frame in frames for i in range(len(frame.u))]

    @property
    def camera_spacing(self) -> float:
        """Angle between neighbouring virtual cameras, spread evenly over the hemisphere, rad."""
        return float(np.sqrt(2 * np.pi / len(self.u) * 2 / np.sqrt(3)))

    @property
    def pixel_pitch(self) -> float:
        """Distance of neighbouring pixels at the capture sphere, mm.

        Each mirror's share of the sensor is taken as spread evenly over the capture sphere.
        """
        cameras = [frame.camera for frame in self.source.frames.values()]
        pixels = sum(camera.width_px * camera.height_px for camera in cameras)
        return float(self.source.capture_mm / np.sqrt(pixels / len(self.u)))

    def of(self, mirrors: Ints) -> list[MirrorTile]:
        """Tiles of some mirrors, without those that have no pixels."""
        tiles = map(self._tile, mirrors.tolist())
        return [tile for tile in tiles if tile is not None]

    def _tile(self, mirror: int) -> MirrorTile | None:
        if mirror not in self._read:
            self._read[mirror] = _tile(*self._mirrors[mirror])
        return self._read[mirror]


def _widths(apex: Floats) -> Floats:
    """About how far corners of cells are from the apices (m, 3), rather more, (m,).

    Cells of six neighbours have corners at 0.58 of the neighbours' distance; those at the edges
    have fewer, and farther neighbours count for them.
    """
    distance, _ = cKDTree(apex).query(apex, k=min(NEIGHBOURS + 1, len(apex)))
    return np.reshape(distance, (len(apex), -1))[:, -1]


def mirror_pixels(frame: CameraFrame, index: int) -> tuple[Bools, list[NDArray[Any]]] | None:
    """The smallest rectangle with all pixels of a mirror; None where it has none.

    Which are of the mirror, (h, w); and colours, origins and directions, (h, w, 3) each.
    """
    x0, x1, y0, y1 = frame.boxes[index].tolist()
    pixels = frame.read(slice(y0, y1), slice(x0, x1))
    valid = pixels["mirror"] == index + 1
    if not valid.any():
        return None
    rows, columns = (np.flatnonzero(valid.any(axis=axis)) for axis in (1, 0))
    cut = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return valid[cut], [pixels[name][cut] for name in ("colour", "origin", "direction")]


def _tile(frame: CameraFrame, index: int) -> MirrorTile | None:
    found = mirror_pixels(frame, index)
    if found is None:
        return None
    valid = np.pad(found[0], 1)
    height, width = valid.shape
    valid = valid.ravel()
    colour, origin, direction = (np.pad(one, BORDER).reshape(-1, 3) for one in found[1])
    pinhole, _ = convergence_point(origin[valid], direction[valid])
    pixel = np.flatnonzero(valid)
    row, column = np.divmod(pixel, width)
    middle = int(pixel[((2 * row - height) ** 2 + (2 * column - width) ** 2).argmin()])
    return MirrorTile((height, width), valid, colour, origin, direction, pinhole, middle)


def convergence_point(
    origin: NDArray[np.floating], direction: NDArray[np.floating]
) -> tuple[Floats, float]:
    """Point (3,) with the minimum squared distance to rays (n, 3), and the largest distance, mm."""
    d, o = direction.astype(np.float64), origin.astype(np.float64)
    matrix = len(d) * np.eye(3) - np.einsum("nx,ny->xy", d, d)
    foot = o - dot(o, d)[:, None] * d
    # One ray, or parallel ones, leave the place along them open: nearest the mirror then.
    point = o.mean(axis=0)
    point = point + np.linalg.lstsq(matrix, foot.sum(axis=0) - matrix @ point, rcond=1e-9)[0]
    offset = point - o
    return point, float(norm(offset - dot(offset, d)[:, None] * d).max())

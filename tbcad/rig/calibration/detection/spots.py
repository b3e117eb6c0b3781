"""Bright spots of a photograph: where each is, how bright, and how well that is known.

Coordinates are columns and rows; whole numbers are pixel centres. Brightness is in the numbers of
the file, summed over the three colours.
"""

from collections import Counter
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tbcad.rig.runs import Image16
from tbcad.types import Bools, Floats, Ints

THRESHOLD = 0.02  # of the largest number: less is no spot
NEIGHBOURS_PX = 1.5  # pixels that touch, also at a corner
FULL = 1.0  # of the largest number: saturated
MAX_BRIGHT = 200_000  # pixels: of more the light is not that of LEDs in balls
# Radius of the disc whose light is summed: of a spot's own area, and of what spreads it.
OF_SPOT, OF_SPREAD_PX = 1.4, 2.5
MAX_RADIUS_PX = 25
RING_PX = 2  # about the disc, for the light behind
ROUNDING = 1 / 12  # variance of a number that is rounded
COLUMNS = 8  # of a table of spots: place, sums and largest number
ROUNDS = 4  # of finding the centroid in the disc about the last one
COLOURS = 3
CLIP = 5.0  # in numbers: larger differences of dark photographs are of hot pixels
# Electrons that fill a pixel where colours do not tell: a sensor with pixels of 3.45 um.
FULL_ELECTRONS = 10_000.0
# What the model of domes leaves open, dust, and what a lens as sharp as its pixels adds, pixels.
FLOOR_PX = 0.006
PHOTOGRAPH_PX = 1e5  # apart: spots of different photographs never pair


@dataclass(frozen=True)
class BrightSpots:
    """Bright spots, over n of them."""

    frame: Ints  # from 0, (n,)
    led: Ints  # that shone, from 0, (n,)
    pixel: Floats  # column and row of the centroid, (n, 2)
    light: Floats  # sum over the disc, (n,)
    radius: Floats  # of the disc, pixels, (n,)
    shot: Floats  # sum of light times the squared distance from the centroid, of one way, (n,)
    spread: Floats  # the same of ones where there is light: what other noise counts by, (n,)
    # sum of squared differences of colours, scaled to the same sum, less what rounding adds, (n,)
    colours: Floats
    full: Floats  # largest number of a pixel as a share of the largest possible, (n,)

    def __len__(self) -> int:
        return len(self.frame)

    def only(self, which: Bools | Ints) -> "BrightSpots":
        """Some of them."""
        return BrightSpots(**{one.name: getattr(self, one.name)[which] for one in fields(self)})


def joined_spots(parts: list[BrightSpots]) -> BrightSpots:
    """All spots of several photographs."""
    if not parts:
        empty, none = np.zeros(0), np.zeros(0, dtype=np.int64)
        return BrightSpots(none, none, np.zeros((0, 2)), *[empty] * 6)
    return BrightSpots(
        **{
            one.name: np.concatenate([getattr(p, one.name) for p in parts])
            for one in fields(BrightSpots)
        }
    )


def find_spots(
    image: Image16, dark: Image16 | None, frame: int, led: int
) -> tuple[BrightSpots, Counter[str]]:
    """The spots of a photograph (h, w, 3) by one LED, less a dark one, and what else is bright.

    That is counted: clusters larger than a highlight, `saturated` ones of these with a pixel at the
    largest number; photographs that are `flooded` by more bright pixels than LEDs in balls give, or
    `black`.
    """
    largest = np.iinfo(image.dtype).max
    threshold = max(round(THRESHOLD * largest), 1)
    row, column = _bright(image, dark, threshold)
    if not 0 < len(row) <= MAX_BRIGHT:
        return joined_spots([]), Counter(["flooded" if len(row) else "black"])
    label = _clusters(row, column)
    places = [(row[label == k], column[label == k]) for k in range(int(label.max()) + 1)]
    large = [place for place in places if _radius(place[0]) > MAX_RADIUS_PX]
    clipped = sum(int(image[place].max() >= FULL * largest) for place in large)
    sums = [_measured(image, dark, *one) for one in places if _radius(one[0]) <= MAX_RADIUS_PX]
    table = np.array([one for one in sums if one is not None]).reshape(-1, COLUMNS)
    table[:, -1] /= largest
    frames, leds = np.full(len(table), frame), np.full(len(table), led)
    found = BrightSpots(frames, leds, table[:, :2], *table[:, 2:].T)
    return found, Counter(large=len(large), saturated=clipped)


def _radius(row: Ints) -> float:
    """Radius of the disc about a cluster, pixels, by the rows of its pixels."""
    return float(OF_SPOT * np.sqrt(len(row) / np.pi) + OF_SPREAD_PX)


def _bright(image: Image16, dark: Image16 | None, threshold: int) -> tuple[Ints, Ints]:
    """Rows and columns of pixels that are brighter than in the dark by a threshold."""
    pixel = np.unique(np.flatnonzero(image.reshape(-1) > threshold) // 3)
    above = image.reshape(-1, 3)[pixel].astype(np.int64)
    if dark is not None:
        above -= dark.reshape(-1, 3)[pixel]
    row, column = np.divmod(pixel[above.max(axis=1) > threshold], image.shape[1])
    return row, column


def _clusters(row: Ints, column: Ints) -> Ints:
    pairs = cKDTree(np.column_stack([row, column])).query_pairs(
        NEIGHBOURS_PX, output_type="ndarray"
    )
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(row), len(row)))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _measured(
    image: Image16, dark: Image16 | None, row: Ints, column: Ints
) -> tuple[float, ...] | None:
    """Centroid, sums and largest number of a spot; None where there is nothing to measure."""
    radius = _radius(row)
    half = int(np.ceil(radius)) + RING_PX + 1
    at = np.rint([column.mean(), row.mean()]).astype(int)
    first = np.maximum(at - half, 0)
    box = np.s_[first[1] : at[1] + half + 1, first[0] : at[0] + half + 1]
    numbers = image[box].astype(np.float64)
    light = numbers - (0 if dark is None else dark[box])
    x, y = (first[k] + np.arange(light.shape[1 - k], dtype=np.float64) for k in (0, 1))
    places = np.stack(np.broadcast_arrays(x, y[:, None]), axis=-1)
    centre, zone = np.array([column.mean(), row.mean()]), np.zeros(0)
    inside, above = np.zeros(0, dtype=bool), np.zeros(0)
    for _ in range(ROUNDS):
        away = (x - centre[0]) ** 2 + ((y - centre[1]) ** 2)[:, None]
        inside, before = away <= radius**2, zone
        zone = inside.astype(int) + (away <= (radius + RING_PX) ** 2)
        if np.array_equal(zone, before):  # the same discs have the same centroid
            break
        ring = zone == 1
        above = (light - _median(light[ring]) if ring.any() else light).sum(axis=-1)
        total = float(above[inside].sum())
        if total <= 0:
            return None
        centre = (above[inside, None] * places[inside]).sum(axis=0) / total
    offset = ((places - centre) ** 2).sum(axis=-1)[inside] / 2
    return (
        *centre,
        total,
        radius,
        float((np.maximum(above[inside], 0) * offset).sum()),
        float(offset[above[inside] != 0].sum()),
        _colour_noise(light[inside]),
        float(numbers[inside].max()),
    )


def _median(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of each colour of pixels (m, 3), to the bit that of numpy, in a quarter of its time."""
    ordered, count = np.sort(numbers, axis=0), len(numbers)
    return np.asarray(ordered[(count - 1) // 2 : count // 2 + 1].mean(axis=0))


def _colour_noise(light: NDArray[np.float64]) -> float:
    """Sum of squared differences of the colours (m, 3), each scaled to the mean of all."""
    sums = light.sum(axis=0)
    if (sums <= 0).any():
        return 0.0
    even = light * (sums.mean() / sums)
    apart = float(((even - even.mean(axis=1, keepdims=True)) ** 2).sum())
    # Of three colours two are free, when their mean is taken off; empty pixels are not rounded.
    rounded = int(np.count_nonzero(light.any(axis=1)))
    return float(apart - (light.shape[1] - 1) * ROUNDING * rounded)


def reading_variance(dark: Image16, other: Image16) -> float:
    """Variance of a number without light, from two dark photographs."""
    change = np.clip(dark.astype(np.float32) - other.astype(np.float32), -CLIP, CLIP)
    return float((change**2).mean() / 2) + ROUNDING


def gain(spots: BrightSpots, reading: float, largest: float) -> float:
    """Variance of light over light, in numbers."""
    pixels = np.pi * spots.radius**2
    known = spots.colours != 0
    if not known.any():
        return largest / FULL_ELECTRONS
    read = (reading - ROUNDING) * pixels[known].sum()
    variance = spots.colours[known].sum() / (COLOURS - 1) - read
    return float(max(variance / (spots.light[known].sum() / COLOURS), 0.0))


def centroid_sigmas(spots: BrightSpots, reading: float, of_light: float) -> Floats:
    """Standard deviation of each centroid, of column and of row, pixels, (n,)."""
    variance = (of_light * spots.shot + COLOURS * reading * spots.spread) / spots.light**2
    return np.asarray(np.sqrt(variance + FLOOR_PX**2))


def stacked(frame: Ints, led: Ints, pixel: Floats) -> Floats:
    """Places of all photographs, each in a plane of its own, (n, 4)."""
    return np.column_stack([pixel, PHOTOGRAPH_PX * frame, PHOTOGRAPH_PX * led])

"""Light along rays through a field: compositing, in compiled loops.

The light of a ray is the sum over its samples k of T_k a_k c_k, with a_k = 1 - exp(-s_k d) of the
density s_k and the step d, and T_k the product of all 1 - a before k (N. Max, IEEE Trans.
Visualization and Computer Graphics 1(2), 1995). Density is (x + sqrt(x^2 + q)) / 2 of a number x
that is interpolated linearly between nodes and may be negative, so surfaces lie between nodes
(A. Karnewar and others, ReLU Fields, SIGGRAPH 2022; J. T. Barron, Squareplus, 2021). Colours are
interpolated too; of a field of first order, each has a part that is linear in the ray's direction.
Nothing here depends on threads: each call has its own samples and its own sums.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_sum

Singles = NDArray[np.float32]

SOFTNESS = np.float32(1e-2)  # q above, 1/mm^2
LEAST_OPACITY = np.float32(2e-4)  # of a sample, less is nothing
LEAST_LIGHT = np.float32(2e-3)  # that is let through, less is not followed
MATT = 4  # columns of a field without view dependence: x, red, green, blue
GLOSSY = 13  # and three of each colour, which the direction multiplies


class Medium(NamedTuple):
    """A field as the loops take it."""

    width: float  # of the grid's cube, mm
    step: float  # between samples, mm
    rows: NDArray[np.int32]  # of the grid, (n, n, n)
    leap: NDArray[np.uint8]  # of the grid, (n-1, n-1, n-1)
    values: Singles  # of the nodes, (v, 4 or 13)


@compiled_sum
def spans(
    entry: Singles,
    direction: Singles,
    length: Singles,
    leap: NDArray[np.uint8],
    width: float,
    near: int,
) -> tuple[Singles, Singles]:
    """Where rays come near cells with all corners first and last, mm from their entry; -1: never.

    Rays enter the capture sphere at (n, 3), mm, along unit directions, for lengths (n,). The leap
    (k, k, k) is that of a grid whose cube is so wide, mm. So many cells away is near: 1 or more, so
    that no part of them is left out.
    """
    first = np.full(len(entry), np.float32(-1))
    last = np.full(len(entry), np.float32(-1))
    cells = leap.shape[0]
    scale, half = np.float32(cells / width), np.float32(width / 2)
    for i in range(len(entry)):
        t = np.float32(0)
        while t < length[i]:
            x = int((entry[i, 0] + direction[i, 0] * t + half) * scale)
            y = int((entry[i, 1] + direction[i, 1] * t + half) * scale)
            z = int((entry[i, 2] + direction[i, 2] * t + half) * scale)
            away = leap[
                min(max(x, 0), cells - 1), min(max(y, 0), cells - 1), min(max(z, 0), cells - 1)
            ]
            if away <= near:
                if first[i] < 0:
                    first[i] = t
                last[i] = t + np.float32(0.5) / scale
            t += max(np.float32(away) - np.float32(near), np.float32(0.5)) / scale
    return first, last


@compiled_sum
def _turned(values: Singles, row: int, colour: int, direction: Singles) -> Any:
    """A colour of a node in a direction, of a field of first order."""
    first = 1 + 3 * colour
    sloped = values[row, first] * direction[0] + values[row, first + 1] * direction[1]
    return values[row, colour] + sloped + values[row, first + 2] * direction[2]


@compiled_sum
def march(
    entry: Singles,
    direction: Singles,
    span: tuple[float, float],
    jitter: Any,
    medium: Medium,
    at: Singles,
    slot: Singles,
) -> tuple[int, Any, Any, Any, Any]:
    """Follow one ray; the samples that hold something are left in `at` and `slot`.

    From its entry into the capture sphere, mm, (3,), along a unit direction; span: where it may
    meet something, mm from there; jitter of the first sample in steps. `at` are places of samples
    in units of nodes, and in mm from the entry, (k, 4); `slot` is opacity, weight, slope of density
    against x, and colour of each, (k, 6). Returns their number, light that is let through, red,
    green, blue.
    """
    one, zero = np.float32(1), np.float32(0)
    width, step, rows, leap, values = medium
    n, glossy = rows.shape[0], values.shape[1] == GLOSSY
    scale, half = np.float32((n - 1) / width), np.float32(width / 2)
    through, red, green, blue = one, zero, zero, zero
    count = 0
    t, last, stride = np.float32(span[0] + jitter * step), np.float32(span[1]), np.float32(step)
    while t <= last and count < len(at):
        x = (entry[0] + direction[0] * t + half) * scale
        y = (entry[1] + direction[1] * t + half) * scale
        z = (entry[2] + direction[2] * t + half) * scale
        i, j, k = int(x), int(y), int(z)
        outside = x < 0 or y < 0 or z < 0 or i >= n - 1 or j >= n - 1 or k >= n - 1
        away = np.uint8(1) if outside else leap[i, j, k]
        if away > 0:
            t += stride * max(one, np.floor((np.float32(away) - one) / scale / stride))
            continue
        u, v, w = x - np.float32(i), y - np.float32(j), z - np.float32(k)
        number, r, g, b = zero, zero, zero, zero
        for di in range(2):
            wx = u if di else one - u
            for dj in range(2):
                wxy = wx * (v if dj else one - v)
                for dk in range(2):
                    share = wxy * (w if dk else one - w)
                    row = rows[i + di, j + dj, k + dk]
                    number += share * values[row, 0]
                    if glossy:
                        r += share * _turned(values, row, 1, direction)
                        g += share * _turned(values, row, 2, direction)
                        b += share * _turned(values, row, 3, direction)
                    else:
                        r += share * values[row, 1]
                        g += share * values[row, 2]
                        b += share * values[row, 3]
        root = np.sqrt(number * number + SOFTNESS)
        opacity = one - np.exp(np.float32(-0.5) * (number + root) * stride)
        if opacity >= LEAST_OPACITY:
            weight = through * opacity
            at[count, 0], at[count, 1], at[count, 2], at[count, 3] = x, y, z, t
            slot[count, 0], slot[count, 1] = opacity, weight
            slot[count, 2] = np.float32(0.5) * (one + number / root)
            slot[count, 3], slot[count, 4], slot[count, 5] = r, g, b
            red += weight * r
            green += weight * g
            blue += weight * b
            through *= one - opacity
            count += 1
            if through < LEAST_LIGHT:
                break
        t += stride
    return count, through, red, green, blue


@compiled_sum
def most_samples(medium: Medium) -> int:
    """Samples on the longest way through the cube."""
    return int(2 * medium.width / medium.step) + 2


@compiled_sum
def composited(
    entry: Singles,
    direction: Singles,
    length: Singles,
    medium: Medium,
) -> Singles:
    """Red, green, blue, opacity of rays, and where they become half opaque, mm from entry, (n, 5).

    The place is NaN on rays that are less than half opaque. Arguments as of `spans` and `march`.
    """
    result = np.zeros((len(entry), 5), dtype=np.float32)
    most = most_samples(medium)
    at = np.empty((most, 4), dtype=np.float32)
    slot = np.empty((most, 6), dtype=np.float32)
    for i in range(len(entry)):
        result[i, 4] = np.nan
        count, through, red, green, blue = march(
            entry[i], direction[i], (0.0, length[i]), 0.5, medium, at, slot
        )
        result[i, 0], result[i, 1], result[i, 2] = red, green, blue
        result[i, 3] = 1 - through
        seen = np.float32(0)
        for k in range(count):
            if seen + slot[k, 1] >= 0.5:
                share = (np.float32(0.5) - seen) / slot[k, 1]
                result[i, 4] = at[k, 3] + (share - np.float32(0.5)) * np.float32(medium.step)
                break
            seen += slot[k, 1]
    return result

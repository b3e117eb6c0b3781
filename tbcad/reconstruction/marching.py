"""Light along rays through a field: compositing, and its gradient, in compiled loops.

The light of a ray is the sum over its samples k of T_k a_k c_k, with a_k = 1 - exp(-s_k d) of the
density s_k and the step d, and T_k the product of all 1 - a before k (N. Max, IEEE Trans.
Visualization and Computer Graphics 1(2), 1995). Density is (x + sqrt(x^2 + q)) / 2 of a number x
that is interpolated linearly between nodes and may be negative, so surfaces lie between nodes
(A. Karnewar and others, ReLU Fields, SIGGRAPH 2022; J. T. Barron, Squareplus, 2021). Colours are
interpolated too; of a field of first order, each has a part that is linear in the ray's direction.
The gradient is what differentiation of these sums gives, sample by sample from the near end: what
lies behind a sample is the light of the ray without what was added up to there.

Nothing here depends on threads: each call has its own samples and its own sums.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbcad.compiled import compiled_sum

Singles = NDArray[np.float32]

SOFTNESS = np.float32(1e-2)  # q above, 1/mm^2
LEAST_OPACITY = np.float32(2e-4)  # of a sample, less is nothing
LEAST_LIGHT = np.float32(2e-3)  # that is let through, less is not followed
MATT = 4  # columns of a field without view dependence: x, red, green, blue
GLOSSY = 13  # and three of each colour, which the direction multiplies


class Medium(NamedTuple):
    """A field as the loops take it.

    Attributes:
        width: of the grid's cube, mm.
        step: between samples, mm.
        rows: of the grid, (n, n, n).
        leap: of the grid, (n-1, n-1, n-1).
        values: of the nodes, (v, 4 or 13).
    """

    width: float
    step: float
    rows: NDArray[np.int32]
    leap: NDArray[np.uint8]
    values: Singles


class Pixels(NamedTuple):
    """Photographed rays as the loops take them.

    Attributes:
        entry: where they enter the capture sphere, mm, (n, 3).
        direction: unit vectors, (n, 3).
        first: where they may meet something, mm from the entry, (n,).
        last: up to where, (n,).
        colour: that was photographed, 0 to 1, (n, 3).
        weight: of their squared errors, (n,).
        footprint: change of entry and direction for a pixel's step right and down, (n, 4, 3), or
            (1, 4, 3) of zeros.
        places: of k rays in a pixel, from its centre, pixels, (p, k, 2); one of p for each pixel.
    """

    entry: Singles
    direction: Singles
    first: Singles
    last: Singles
    colour: Singles
    weight: Singles
    footprint: Singles
    places: Singles


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

    Args:
        entry: where rays enter the capture sphere, mm, (n, 3).
        direction: unit vectors, (n, 3).
        length: of the rays in the sphere, mm, (n,).
        leap: of a grid, (k, k, k).
        width: of its cube, mm.
        near: how many cells away from them is near; 1 or more, so that no part of them is left out.
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

    Args:
        entry: where it enters the capture sphere, mm, (3,).
        direction: unit vector, (3,).
        span: where it may meet something, mm from there.
        jitter: of the first sample, in steps.
        medium: the field.
        at: places of the samples in units of nodes, and in mm from the entry, (k, 4).
        slot: of each sample: opacity, weight, slope of density against x, and colour, (k, 6).

    Returns:
        Number of samples, light that is let through, red, green, blue.
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
def _most_samples(medium: Medium) -> int:
    """Samples on the longest way through the cube."""
    return int(2 * medium.width / medium.step) + 2


@compiled_sum
def composited(
    entry: Singles,
    direction: Singles,
    length: Singles,
    medium: Medium,
) -> Singles:
    """Red, green, blue, opacity of rays, and where they become half opaque, mm from the entry.

    Arguments as of `spans` and `march`.

    Returns:
        These five, (n, 5); NaN for the place on rays that are less than half opaque.
    """
    result = np.zeros((len(entry), 5), dtype=np.float32)
    most = _most_samples(medium)
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


@compiled_sum
def _spread(
    at: Singles,
    rows: NDArray[np.int32],
    direction: Singles,
    by: tuple[float, float, float, float],
    gradient: Singles,
) -> None:
    """Add a sample's gradient, by number, red, green and blue, to the eight nodes about it."""
    density, red, green, blue = by
    one = np.float32(1)
    i, j, k = int(at[0]), int(at[1]), int(at[2])
    u = at[0] - np.float32(i)
    v = at[1] - np.float32(j)
    w = at[2] - np.float32(k)
    glossy = gradient.shape[1] == GLOSSY
    for di in range(2):
        wx = u if di else one - u
        for dj in range(2):
            wxy = wx * (v if dj else one - v)
            for dk in range(2):
                share = wxy * (w if dk else one - w)
                row = rows[i + di, j + dj, k + dk]
                gradient[row, 0] += share * density
                gradient[row, 1] += share * red
                gradient[row, 2] += share * green
                gradient[row, 3] += share * blue
                if glossy:
                    for axis in range(3):
                        part = share * direction[axis]
                        gradient[row, 4 + axis] += part * red
                        gradient[row, 7 + axis] += part * green
                        gradient[row, 10 + axis] += part * blue


@compiled_sum
def _back(
    at: Singles,
    slot: Singles,
    count: int,
    light: tuple[float, float, float],
    off: tuple[float, float, float],
    direction: Singles,
    medium: Medium,
    gradient: Singles,
) -> None:
    """Add the gradient of one followed ray.

    Args:
        at: as `march` leaves it.
        slot: likewise.
        count: of samples.
        light: of the ray.
        off: derivative of the loss by that light.
        direction: of the ray.
        medium: the field.
        gradient: by nodes, as their values, (v, 4 or 13).
    """
    one = np.float32(1)
    through, (behind_r, behind_g, behind_b) = one, light
    for k in range(count):
        opacity, weight, slope = slot[k, 0], slot[k, 1], slot[k, 2]
        behind_r -= weight * slot[k, 3]
        behind_g -= weight * slot[k, 4]
        behind_b -= weight * slot[k, 5]
        through *= one - opacity
        gain = off[0] * (through * slot[k, 3] - behind_r)
        gain += off[1] * (through * slot[k, 4] - behind_g)
        gain += off[2] * (through * slot[k, 5] - behind_b)
        number = np.float32(medium.step) * slope * gain
        by = (number, off[0] * weight, off[1] * weight, off[2] * weight)
        _spread(at[k], medium.rows, direction, by, gradient)


@compiled_sum
def add_gradient(
    ray: NDArray[np.int64], pixels: Pixels, seed: int, medium: Medium, gradient: Singles
) -> tuple[float, int]:
    """Add half the gradient of the weighted squared errors of pixels.

    A pixel's light is the mean of the rays at its places, always the same ones: by other places
    in each step the variance inside of pixels would be noise in the gradient, which does not
    fade, or, with the error of the same rays, an error that smooths.

    Args:
        ray: numbers of the pixels, (b,).
        pixels: all of them.
        seed: of each ray's first sample.
        medium: the field.
        gradient: what is added to, (v, 4 or 13).

    Returns:
        Sum of the weighted squared errors, and number of samples.
    """
    entry, direction, first, last, colour, weight, footprint, places = pixels
    kinds, k = places.shape[0], places.shape[1]
    most = _most_samples(medium)
    at = np.empty((k, most, 4), dtype=np.float32)
    slot = np.empty((k, most, 6), dtype=np.float32)
    toward, begin = np.empty((k, 3), dtype=np.float32), np.empty(3, dtype=np.float32)
    count, light = np.empty(k, dtype=np.int64), np.empty((k, 3), dtype=np.float32)
    off = np.empty(3, dtype=np.float32)
    loss, followed = 0.0, 0
    wide = footprint.shape[0] > 1
    for q in range(len(ray)):
        i = ray[q]
        kind = _mixed(i, 0) % np.uint32(kinds)
        state = _mixed(i, seed)
        off[:] = -colour[i]
        for j in range(k):
            state = _mixed(state, j)
            jitter = np.float32(state >> np.uint32(8)) / np.float32(1 << 24)
            for axis in range(3):
                begin[axis], toward[j, axis] = entry[i, axis], direction[i, axis]
                if wide:
                    x, y = places[kind, j, 0], places[kind, j, 1]
                    begin[axis] += x * footprint[i, 0, axis] + y * footprint[i, 1, axis]
                    toward[j, axis] += x * footprint[i, 2, axis] + y * footprint[i, 3, axis]
            count[j], _, light[j, 0], light[j, 1], light[j, 2] = march(
                begin, toward[j], (first[i], last[i]), jitter, medium, at[j], slot[j]
            )
            followed += count[j]
            off += light[j] / np.float32(k)
        loss += weight[i] * (off * off).sum()
        off *= weight[i] / np.float32(k)
        for j in range(k):
            by, seen = (off[0], off[1], off[2]), (light[j, 0], light[j, 1], light[j, 2])
            _back(at[j], slot[j], count[j], seen, by, toward[j], medium, gradient)
    return loss, followed


@compiled_sum
def _mixed(number: Any, seed: int) -> np.uint32:
    """A number of 32 bits that looks random (C. Wellons, lowbias32, 2018; with a seed)."""
    x = np.uint32(np.uint32(number) ^ np.uint32(np.uint32(seed) * np.uint32(0x9E3779B9)))
    x = np.uint32((x ^ (x >> np.uint32(16))) * np.uint32(0x7FEB352D))
    x = np.uint32((x ^ (x >> np.uint32(15))) * np.uint32(0x846CA68B))
    return np.uint32(x ^ (x >> np.uint32(16)))

"""A step of a fit: the gradient of the squared errors of rays, and Adam on the nodes of a field.

The gradient is what differentiation of the sums of `marching` gives, sample by sample from the near
end: what lies behind a sample is the light of the ray without what was added up to there.

Sources: D. P. Kingma and J. Ba, Adam, ICLR 2015; total variation of the density's number, with a
rounded corner, after L. I. Rudin, S. Osher and E. Fatemi, Physica D 60, 1992.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_sum
from tbcad.light.reconstruction.marching import (
    GLOSSY,
    SOFTNESS,
    Medium,
    Singles,
    march,
    most_samples,
)

MEMORY = (0.9, 0.99)  # of the means of gradients and of their squares
EPSILON = np.float32(1e-7)
CORNER = np.float32(0.3)  # of the total variation, 1/mm^2


class Pixels(NamedTuple):
    """Photographed rays as the loops take them."""

    entry: Singles  # where they enter the capture sphere, mm, (n, 3)
    direction: Singles  # unit vectors, (n, 3)
    first: Singles  # where they may meet something, mm from the entry, (n,)
    last: Singles  # up to where, (n,)
    colour: Singles  # that was photographed, 0 to 1, (n, 3)
    weight: Singles  # of their squared errors, (n,)
    # change of entry and direction for a pixel's step right and down, (n, 4, 3), or (1, 4, 3) of
    # zeros
    footprint: Singles
    # of k rays in a pixel, from its centre, pixels, (p, k, 2); one of p for each pixel
    places: Singles


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
    """Add the gradient of a ray that `march` followed: its light, and the loss's derivative by it.

    The gradient is by nodes, as their values, (v, 4 or 13).
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
    """Add half the gradient of the weighted squared errors of pixels with numbers (b,).

    A pixel's light is the mean of the rays at its places, always the same ones: by other places in
    each step the variance inside of pixels would be noise in the gradient, which does not fade, or,
    with the error of the same rays, an error that smooths.

    The seed is of each ray's first sample; the gradient (v, 4 or 13) is added to. Returns the sum
    of the weighted squared errors, and the number of samples.
    """
    entry, direction, first, last, colour, weight, footprint, places = pixels
    kinds, k = places.shape[0], places.shape[1]
    most = most_samples(medium)
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
        for axis in range(3):
            off[axis] = -colour[i, axis]
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


class Moments(NamedTuple):
    """Means of the gradients of nodes, and of their squares, (v, c) each."""

    mean: Singles
    square: Singles


class ColumnSteps(NamedTuple):
    """Limits and weights of the columns of a field's values, (c,) each."""

    size: Singles  # of the step
    smooth: Singles  # weight of the differences to neighbours
    least: Singles  # smallest value
    most: Singles  # largest value


def unbiased_size(size: Singles, step: int) -> Singles:
    """Size of a step that makes up for means that began at zero."""
    first, second = (1 - memory**step for memory in MEMORY)
    return np.asarray(size * np.float32(second**0.5 / first))


@compiled_sum
def adam(
    nodes: tuple[int, int],
    values: Singles,
    changed: Singles,
    parts: Singles,
    moments: Moments,
    neighbours: NDArray[np.int32],
    columns: ColumnSteps,
    sparse: float,
) -> None:
    """Change some nodes, from the first to the one before the last, and empty their gradients.

    Values (v, c) are those before the step, changed (v, c) those after it; parts (p, v, c) of the
    gradient are added in their order. Each node has neighbours (v, 6); sparse is the weight of the
    logarithm of the density.
    """
    one = np.float32(1)
    b1, b2 = np.float32(MEMORY[0]), np.float32(MEMORY[1])
    for v in range(nodes[0], nodes[1]):
        for c in range(values.shape[1]):
            gradient = np.float32(0)
            for p in range(parts.shape[0]):
                gradient += parts[p, v, c]
                parts[p, v, c] = 0
            x = values[v, c]
            changed[v, c] = x
            if gradient == 0 and moments.mean[v, c] == 0:
                continue
            rough = np.float32(0)
            for j in range(6):
                other = neighbours[v, j]
                if other >= 0:
                    apart = x - values[other, c]
                    rough += apart / np.sqrt(apart * apart + CORNER) if c == 0 else apart
            gradient += columns.smooth[c] * rough
            if c == 0:
                slope = (one + x / np.sqrt(x * x + SOFTNESS)) / np.float32(2)
                gradient += np.float32(sparse) * slope / (one + max(x + x, np.float32(0)))
            mean = b1 * moments.mean[v, c] + (one - b1) * gradient
            square = b2 * moments.square[v, c] + (one - b2) * gradient * gradient
            moments.mean[v, c], moments.square[v, c] = mean, square
            x -= columns.size[c] * mean / (np.sqrt(square) + EPSILON)
            changed[v, c] = min(max(x, columns.least[c]), columns.most[c])

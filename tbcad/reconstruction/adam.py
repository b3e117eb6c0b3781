"""A step of Adam on the nodes of a field, smoothness and sparsity included.

Source: D. P. Kingma and J. Ba, Adam, ICLR 2015; total variation of the density's number, with a
rounded corner, after L. I. Rudin, S. Osher and E. Fatemi, Physica D 60, 1992.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbcad.compiled import compiled_sum
from tbcad.reconstruction.marching import SOFTNESS, Singles

MEMORY = (0.9, 0.99)  # of the means of gradients and of their squares
EPSILON = np.float32(1e-7)
CORNER = np.float32(0.3)  # of the total variation, 1/mm^2


class Moments(NamedTuple):
    """Means of the gradients of nodes, and of their squares, (v, c) each."""

    mean: Singles
    square: Singles


class Columns(NamedTuple):
    """Limits and weights of the columns of a field's values, (c,) each.

    Attributes:
        size: of the step.
        smooth: weight of the differences to neighbours.
        least: smallest value.
        most: largest value.
    """

    size: Singles
    smooth: Singles
    least: Singles
    most: Singles


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
    columns: Columns,
    sparse: float,
) -> None:
    """Change some nodes, and empty their gradients.

    Args:
        nodes: the first, and the one after the last.
        values: before the step, (v, c).
        changed: after it, (v, c).
        parts: of the gradient, added in their order, (p, v, c).
        moments: changed likewise.
        neighbours: of each node, (v, 6).
        columns: what holds for each.
        sparse: weight of the logarithm of the density.
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

"""Gaussian random fields in space: smooth errors of one part, in few random numbers.

A field of unit variance whose values at x and y have the covariance exp(-|x - y|^2 / (2 L^2)) is

    f(x) = k(x, X) F^-T z,    k(X, X) = F F^T,

with the kernel k, some of the part's points X and independent standard normal numbers z: it equals
the field at X and is its best estimate elsewhere (Rasmussen, Williams, Gaussian Processes for
Machine Learning, MIT Press 2006). X are the pivots of an incomplete Cholesky factorisation, taken
until the variance that is missing at any of the part's points is below a limit.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.types import Floats, Ints

# Share of the variance that a field may lack at any point: 0.1 % of its standard deviation.
MISSING_VARIANCE = 1e-6
# Digits of a variance by which points are compared, so that rounding does not choose among equals.
COMPARED_DIGITS = 9


@dataclass(frozen=True)
class SmoothField:
    """A field of unit variance, as a function of K standard normal numbers.

    Attributes:
        points: X, mm, (K, 3).
        length: correlation length L, mm.
        factor: F, lower triangular, (K, K).
    """

    points: Floats
    length: float
    factor: Floats

    def __len__(self) -> int:
        """Number of random numbers K."""
        return len(self.points)

    def basis(self, places: Floats) -> Floats:
        """What each random number adds to the field at places (p, 3), (p, K)."""
        kernel = covariance(places, self.points, self.length)
        solved = np.linalg.solve(self.factor, kernel.T).T
        return np.ascontiguousarray(solved, dtype=np.float64)


def smooth_field(points: Floats, length: float, chosen: Ints | None = None) -> SmoothField:
    """The field of a part.

    Args:
        points: of the part, nearer to each other than the length, mm, (n, 3).
        length: correlation length, mm, greater than 0.
        chosen: which of the points are X; otherwise those that `pivots` finds.
    """
    chosen = pivots(points, length) if chosen is None else chosen
    some = points[chosen]
    factor = np.asarray(np.linalg.cholesky(covariance(some, some, length)), dtype=np.float64)
    return SmoothField(some, length, factor)


def covariance(first: Floats, second: Floats, length: float) -> Floats:
    """Covariance of a field of unit variance between points (p, 3) and (q, 3), (p, q)."""
    square = sum((first[:, None, axis] - second[None, :, axis]) ** 2 for axis in range(3))
    result: Floats = np.exp(square / (-2 * length * length))
    return result


def pivots(points: Floats, length: float, missing: float = MISSING_VARIANCE) -> Ints:
    """Numbers of the points (n, 3) from whose values the field follows at all others.

    Incomplete Cholesky factorisation with the largest remaining variance as the pivot.

    Args:
        points: of the part, mm, (n, 3).
        length: correlation length, mm.
        missing: variance, of 1, that may be missing at any of the points.
    """
    left, chosen = np.ones(len(points)), list[int]()
    columns = np.empty((len(points), len(points)))
    while left.max() > missing:
        pivot = int(np.argmax(np.round(left, COMPARED_DIGITS)))
        known = columns[:, : len(chosen)]
        column = covariance(points, points[[pivot]], length)[:, 0] - known @ known[pivot]
        columns[:, len(chosen)] = column / np.sqrt(column[pivot])
        left = np.maximum(left - columns[:, len(chosen)] ** 2, 0.0)
        left[pivot] = 0.0
        chosen.append(pivot)
    return np.array(chosen, dtype=np.int64)

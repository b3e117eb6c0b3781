"""The smallest sphere about points, however flat they lie."""

from itertools import combinations

import numpy as np

from tbcad.types import Floats

MOST_STEPS = 1000
ROUNDING = 1e-12  # of the radius


def smallest_sphere(points: Floats) -> tuple[Floats, float]:
    """Middle (3,) and radius of the smallest sphere that holds points (n, 3).

    Two to four of them lie on it. The farthest point outside of the smallest sphere about those
    few is added to them until there is none; the radius grows with each step.

    Source: E. Welzl, Smallest enclosing disks, LNCS 555, 1991.
    """
    few = points[:1]
    middle, radius = few[0], 0.0
    for _ in range(MOST_STEPS):
        distance = np.linalg.norm(points - middle, axis=1)
        farthest = int(distance.argmax())
        if distance[farthest] <= radius * (1 + ROUNDING):
            break
        few = np.vstack([few, points[farthest]])
        middle, radius, few = _smallest_of_few(few)
    return middle, float(np.linalg.norm(points - middle, axis=1).max())


def _smallest_of_few(points: Floats) -> tuple[Floats, float, Floats]:
    """Middle and radius for up to five points, and the fewest of them that it follows from."""
    best = points[0], np.inf, points[:1]
    for count in range(2, min(len(points), 4) + 1):
        for chosen in combinations(range(len(points)), count):
            on = points[list(chosen)]
            middle = _equally_far(on)
            reach = float(np.linalg.norm(points - middle, axis=1).max())
            if reach < best[1] * (1 - ROUNDING):
                best = middle, reach, on
    return best


def _equally_far(points: Floats) -> Floats:
    """The point equally far from points (k, 3), in the plane, line or space that they span."""
    along = points[1:] - points[0]
    square = (along**2).sum(axis=1) / 2
    weights = np.linalg.lstsq(along @ along.T, square, rcond=None)[0]
    return np.asarray(points[0] + weights @ along)

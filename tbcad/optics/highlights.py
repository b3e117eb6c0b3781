"""Where spheres show a light to a camera."""

import numpy as np

from tbcad.geometry.vectors import norm, unit
from tbcad.types import Floats

ITERATIONS = 40  # of the search for the point of reflection; each gains a digit or so


def reflection_points(
    centre: Floats,
    radius: Floats,
    place: Floats,
    pinhole: Floats,
    iterations: int = ITERATIONS,
) -> Floats:
    """Where spheres (m,) show places (3,) or (m, 3) to a pinhole (3,), mm, (m, 3).

    There the normal bisects both directions. A normal that turns by one angle turns the bisector
    back by about r (1/a + 1/b) / 2 of it, at distances a and b, so the new normal is their mean
    with that weight.
    """
    normal = unit(pinhole - centre)
    for _ in range(iterations):
        point = centre + radius[:, None] * normal
        ways = place - point, pinhole - point
        weight = radius / 2 * (1 / norm(ways[0]) + 1 / norm(ways[1]))
        bisector = unit(unit(ways[0]) + unit(ways[1]))
        normal = unit(bisector + weight[:, None] * normal)
    return np.asarray(centre + radius[:, None] * normal)

"""The law of reflection: rays from a pinhole after a mirror, and where a sphere shows a light.

The origin is the centre of the capture sphere, so twice the smallest distance by which rays miss it
is what a mirror covers.
"""

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.types import Floats

ITERATIONS = 40  # of the search for the point of reflection; each gains a digit or so


def reflect(ray: Floats, normal: Floats) -> Floats:
    """Directions (..., 3) of rays (..., 3) after mirrors with unit normals (..., 3).

    Lengths stay as they are; the sign of the normal does not matter.
    """
    return np.asarray(ray - 2 * dot(ray, normal)[..., None] * normal)


def reflected_rays(pinhole: Floats, point: Floats, normal: Floats) -> Floats:
    """Unit directions (..., 3) of rays from a pinhole after mirrors, at points, with normals."""
    return reflect(unit(point - pinhole), normal)


def miss_distances(pinhole: Floats, point: Floats, normal: Floats) -> Floats:
    """Distances (...) from the origin of the lines of rays, as of `reflected_rays`, mm."""
    return norm(np.cross(point, reflected_rays(pinhole, point, normal)))


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

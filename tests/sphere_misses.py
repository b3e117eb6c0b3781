"""Rays after spheres in arrays, with which the compiled loops are compared."""

import numpy as np

from tbcad.core.geometry.vectors import dot, norm
from tbcad.core.optics.reflection import reflected_rays
from tbcad.types import Floats


def sphere_miss_distances(pinhole: Floats, ray: Floats, centre: Floats, radius: Floats) -> Floats:
    """Distances (...) from the origin of rays after convex spherical mirrors, mm.

    Args:
        pinhole: mm, (3,).
        ray: unit directions from the pinhole, (..., 3).
        centre: of the spheres, mm, (..., 3).
        radius: of the spheres, mm, (...).

    Returns:
        Infinite where the ray misses the sphere, or leaves it away from the origin.
    """
    to_centre = centre - pinhole
    along = dot(ray, to_centre)
    inside = radius**2 - dot(to_centre, to_centre) + along**2
    point = pinhole + (along - np.sqrt(np.maximum(inside, 0)))[..., None] * ray
    direction = reflected_rays(pinhole, point, (point - centre) / radius[..., None])
    missed = (inside < 0) | (dot(direction, point) > 0)
    return np.asarray(np.where(missed, np.inf, norm(np.cross(point, direction))))

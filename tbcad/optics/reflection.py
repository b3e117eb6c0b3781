"""The law of reflection: rays from a pinhole after a mirror, and how far they miss the origin.

The origin is the centre of the capture sphere, so twice the smallest miss is what a mirror covers.
"""

import numpy as np

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.types import Floats


def reflect(ray: Floats, normal: Floats) -> Floats:
    """Directions (..., 3) of rays (..., 3) after mirrors with unit normals (..., 3).

    Lengths stay as they are; the sign of the normal does not matter.
    """
    return np.asarray(ray - 2 * dot(ray, normal)[..., None] * normal)


def reflected_rays(pinhole: Floats, point: Floats, normal: Floats) -> Floats:
    """Unit directions (..., 3) of rays from a pinhole after mirrors.

    Args:
        pinhole: mm, (3,).
        point: where the rays meet the mirrors, mm, (..., 3).
        normal: unit normals of the mirrors there, (..., 3).
    """
    return reflect(unit(point - pinhole), normal)


def miss_distances(pinhole: Floats, point: Floats, normal: Floats) -> Floats:
    """Distances (...) of the lines of the reflected rays from the origin, mm.

    Args:
        pinhole: mm, (3,).
        point: where the rays meet the mirrors, mm, (..., 3).
        normal: unit normals of the mirrors there, (..., 3).
    """
    return norm(np.cross(point, reflected_rays(pinhole, point, normal)))


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

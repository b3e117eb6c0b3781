"""The law of reflection: rays from a pinhole after a mirror, and where a sphere shows a light.

The origin is the centre of the capture sphere, so twice the smallest distance by which rays miss it
is what a mirror covers.
"""

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.types import Floats

WAVELENGTH_NM = 550.0  # the middle of the visible
SCATTERED = 0.01  # share of the light that the roughness of mirrors may scatter: a judgement
ITERATIONS = 40  # of the search for the point of reflection; each gains a digit or so


def reflect(ray: Floats, normal: Floats) -> Floats:
    """Directions (..., 3) of rays (..., 3) after mirrors with unit normals (..., 3).

    Lengths stay as they are; the sign of the normal does not matter.
    """
    return np.asarray(ray - 2 * dot(ray, normal)[..., None] * normal)


def scattered_share(roughness_nm: float, wavelength_nm: float = WAVELENGTH_NM) -> float:
    """Total integrated scatter of an RMS roughness Rq: 1 - exp(-(4 pi Rq / wavelength)^2).

    Source: Bennett and Porteus, J. Opt. Soc. Am. 51 (1961) 123, at normal incidence.
    """
    return float(scattered_shares(np.asarray(roughness_nm), wavelength_nm))


def scattered_shares(roughness_nm: Floats, wavelength_nm: float = WAVELENGTH_NM) -> Floats:
    """The same (...) of roughnesses (...); at an angle of incidence times its cosine (Beckmann)."""
    return np.asarray(-np.expm1(-((4 * np.pi * roughness_nm / wavelength_nm) ** 2)))


def roughness_nm(scattered: float = SCATTERED, wavelength_nm: float = WAVELENGTH_NM) -> float:
    """RMS roughness Rq that scatters a share of the light, nm: `scattered_share` inverted."""
    return float(wavelength_nm * np.sqrt(-np.log1p(-scattered)) / (4 * np.pi))


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

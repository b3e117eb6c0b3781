"""Flat mirrors, and the paper's paraxial radius that widens what they see (eqs. 1 and 2)."""

import numpy as np
from scipy.spatial import cKDTree

from tbcad.geometry.ellipsoid import Ellipsoid
from tbcad.geometry.vectors import dot, unit
from tbcad.types import Floats, Ints

# A geodesic vertex has at most six neighbours; two rings of them bound every flat mirror.
NEIGHBOURS = 19


def half_angles(ellipsoid: Ellipsoid, u: Floats, all_u: Floats) -> Floats:
    """theta_0: half angle, at V about V -> origin, of the largest cone in the mirror's polygon.

    The polygon is cut out by the tangent planes at all directions; a plane that does not bound it
    never gives the least angle, so the nearest ones suffice.

    Args:
        ellipsoid: the camera's ellipsoid.
        u: directions of the mirrors asked for, (m, 3).
        all_u: directions of all tangent planes, (k, 3); contains u.

    Returns:
        Half angles in radians, (m,).
    """
    near: Ints = np.asarray(cKDTree(all_u).query(u, k=min(NEIGHBOURS, len(all_u)))[1])
    apex, normal = ellipsoid.apices(all_u), ellipsoid.normals(all_u)
    camera = ellipsoid.camera_distance * u
    own, others = near[:, :1], near[:, 1:]
    # height of V below each tangent plane; the pencil of planes through V and the shared edge
    own_height = dot(normal[own], camera[:, None] - apex[own])
    height = dot(normal[others], camera[:, None] - apex[others])
    plane = height[:, :, None] * normal[own] - own_height[:, :, None] * normal[others]
    sines: Floats = np.abs(dot(unit(plane), u[:, None])).min(axis=1)
    return np.arcsin(sines)


def half_widths(ellipsoid: Ellipsoid, u: Floats, theta0: Floats) -> Floats:
    """Half width l = (d - rho) tan(theta_0) of each mirror, mm, (m,)."""
    return (ellipsoid.camera_distance - ellipsoid.radial_distance(u)) * np.tan(theta0)


def required_angles(ellipsoid: Ellipsoid, u: Floats, width: Floats, sphere_radius: float) -> Floats:
    """theta_1 = atan((R - l) / rho) of eq. 1, radians, (m,)."""
    return np.arctan2(sphere_radius - width, ellipsoid.radial_distance(u))


def paper_curvatures(theta0: Floats, theta1: Floats, width: Floats) -> Floats:
    """Curvature 1/r by eq. 2, r = l / sin((theta_1 - theta_0) / 2), 1/mm, (m,).

    Zero or negative where the flat mirror already sees enough.
    """
    return np.sin((theta1 - theta0) / 2) / width

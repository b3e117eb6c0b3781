"""Flat mirrors, and the paper's paraxial radii that widen their field (section 3.2)."""

import numpy as np
from scipy.spatial import cKDTree

from tbcad.core.geometry.ellipsoid import Ellipsoid
from tbcad.core.geometry.vectors import dot, unit
from tbcad.types import Floats, Ints

# A geodesic vertex has at most six neighbours; it and two rings of them bound every flat mirror.
NEIGHBOURS = 19


def half_angles(ellipsoid: Ellipsoid, u: Floats, all_u: Floats) -> Floats:
    """Half angle theta_0 of each flat mirror's field of view, radians, (m,) (the paper's figure 3).

    It is that of the largest cone, at the virtual camera about its direction u to the origin, that
    fits in the mirror's polygon. The polygon is cut out by the tangent planes at all directions (k,
    3), u included; a plane that does not bound it never gives the smallest angle, so the nearest
    ones suffice.
    """
    near: Ints = np.asarray(cKDTree(all_u).query(u, k=min(NEIGHBOURS, len(all_u)))[1])
    apex, normal = ellipsoid.apices(all_u), ellipsoid.normals(all_u)
    camera = ellipsoid.camera_distance * u
    mirror, others = near[:, :1], near[:, 1:]
    # From the virtual camera's heights over two tangent planes follows the plane through it and
    # the edge that they share.
    height = dot(normal[mirror], camera[:, None] - apex[mirror])
    other_height = dot(normal[others], camera[:, None] - apex[others])
    plane = other_height[:, :, None] * normal[mirror] - height[:, :, None] * normal[others]
    sines: Floats = np.abs(dot(unit(plane), u[:, None])).min(axis=1)
    return np.arcsin(sines)


def half_widths(ellipsoid: Ellipsoid, u: Floats, theta0: Floats) -> Floats:
    """Half width l = (d - rho) tan(theta_0) of flat mirrors in directions u (m, 3), mm, (m,)."""
    return (ellipsoid.camera_distance - ellipsoid.radial_distance(u)) * np.tan(theta0)


def required_angles(
    ellipsoid: Ellipsoid, u: Floats, half_width: Floats, sphere_radius: float
) -> Floats:
    """Half angle theta_1 = atan((R - l) / rho) that sees the capture sphere, radians, (m,) (eq. 1).

    Directions u (m, 3), half widths l of flat mirrors (m,) and the sphere's radius R in mm.
    """
    return np.arctan2(sphere_radius - half_width, ellipsoid.radial_distance(u))


def paper_curvatures(theta0: Floats, theta1: Floats, half_width: Floats) -> Floats:
    """Curvatures 1 / r with r = l / sin((theta_1 - theta_0) / 2), 1/mm, (m,) (eq. 2).

    Zero or negative where the flat mirror already sees enough. The equation is paraxial: with
    these radii mirrors hit at an angle cover less than the capture sphere (rule traced).
    """
    return np.sin((theta1 - theta0) / 2) / half_width

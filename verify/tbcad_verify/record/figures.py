"""Recorded figures that follow from a mirror's direction, worked out again from definitions."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.mesh.vectors import dot, unit
from tbcad_verify.record.export import Camera, Export
from tbcad_verify.record.poses import geodesic
from tbcad_verify.types import Floats

NEIGHBOURS = 19  # a vertex and two rings round it; farther planes never bound a flat mirror


def figure_errors(export: Export) -> Floats:
    """(M,) largest deviation of each mirror's figures, mm; inf where its camera is unknown.

    Checked, angles as lengths at 1 mm: polar angle and azimuth about the axis from the origin to
    the pinhole, theta_0 of the flat mirror, its half width l and theta_1 of equation 1.

    Source: DESIGN.md section 2.
    """
    mirrors = export.mirrors
    vertices = geodesic(int(export.spec["optics"]["n"]))
    errors = np.full(len(mirrors), np.inf)
    for camera in export.cameras.values():
        rows = np.flatnonzero(mirrors.camera == camera.id)
        one = mirrors.take(rows)
        expected = _figures(export, camera, one.columns("ux", 3), vertices)
        angles = np.radians(one.columns("theta0_deg", 4))
        turns = np.remainder(angles - expected[1:] + np.pi, 2 * np.pi) - np.pi
        errors[rows] = np.abs([one.size_mm - expected[0], *turns]).max(axis=0, initial=0)
    return errors


def _figures(export: Export, camera: Camera, u: Floats, vertices: Floats) -> Floats:
    """(5, M) half widths, mm, theta_0, theta_1, polar angles and azimuths, rad."""
    b = float(export.spec["optics"]["semi_minor_mm"])
    rho = _radial_distance(camera, b, u)
    theta0 = _half_angles(camera, b, u, vertices)
    width = (_camera_distance(camera, b) - rho) * np.tan(theta0)
    theta1 = np.arctan2(export.target_mm / 2 - width, rho)
    axis = unit(camera.pinhole[:, None])
    zenith = np.array([[0.0], [0.0], [1.0]])
    zero = unit(zenith - axis[2] * axis)
    across, third = zero.T @ u, np.cross(axis, zero, axis=0).T @ u
    polar = np.arctan2(np.hypot(across, third), axis.T @ u)
    return np.stack([width, theta0, theta1, polar[0], np.arctan2(third, across)[0]])


def _half_angles(camera: Camera, b: float, u: Floats, vertices: Floats) -> Floats:
    """(M,) half angle, at the virtual camera, of the largest cone inside each flat mirror.

    Mirrors are bounded by the tangent planes of the ellipsoid at all vertices. The plane through a
    virtual camera and the line where two tangent planes meet is in the pencil of the two.
    """
    count = min(NEIGHBOURS, vertices.shape[1])
    own, *others = np.asarray(cKDTree(vertices.T).query(u.T, k=count)[1]).T
    rho = _radial_distance(camera, b, vertices)
    normal = unit(unit(camera.pinhole[:, None] - rho * vertices) - vertices)
    virtual = _camera_distance(camera, b) * u
    sines = []
    own_height = dot(normal[:, own], virtual - rho[own] * vertices[:, own])
    for other in others:
        height = dot(normal[:, other], virtual - rho[other] * vertices[:, other])
        plane = unit(height * normal[:, own] - own_height * normal[:, other])
        sines.append(np.abs(dot(plane, u)))
    return np.asarray(np.arcsin(np.min(sines, axis=0)))


def _camera_distance(camera: Camera, b: float) -> float:
    """Of every virtual camera from the origin, mm: twice the semi-major axis."""
    return float(np.hypot(2 * b, np.linalg.norm(camera.pinhole)))


def _radial_distance(camera: Camera, b: float, u: Floats) -> Floats:
    """(N,) of the ellipsoid from the origin along u (3, N), mm."""
    focal = float(np.linalg.norm(camera.pinhole)) / 2
    return np.asarray(b**2 / (np.hypot(b, focal) - camera.pinhole @ u / 2))

"""The part of a ball that shows the capture sphere to the camera, and the light that it takes.

A ball is placed with its apex on the ellipsoid. Points are given in the ellipsoid's frame (along
the axis, out from it at azimuth zero, across), since a rotation about the axis changes nothing in
that frame but the azimuth.
"""

from dataclasses import dataclass
from math import cos, radians, sin, sqrt

import numpy as np

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.loop_vectors import (
    Vector,
    dot,
    minus,
    plus_scaled,
    reflect,
    scaled,
    unit,
    vector,
)
from tbcad.core.geometry.rotations import even_angles, rotated_about_x, unit_circle
from tbcad.core.geometry.round_cones import RoundCones
from tbcad.core.geometry.vectors import norm
from tbcad.core.geometry.vectors import unit as unit_vectors
from tbcad.core.optics.camera import Camera
from tbcad.types import Floats

OUTLINE_POINTS = 24  # so smooth that the area by Fourier series is exact to 10^-6
# A tilt of the mirror turns the ray by twice as much, or less across the plane of incidence, so
# no ray at this tilt meets the capture sphere.
MAX_TILT = radians(70)
BISECTIONS = 50


@dataclass(frozen=True)
class BallPoses:
    """Balls in the half-plane of azimuth zero, over k of them."""

    polar: Floats  # polar angles about the axis, radians, (k,)
    apex: Floats  # points on the ellipsoid, mm, (k, 3), the third zero
    normal: Floats  # inward unit normals there, (k, 3), the third zero


def ball_poses(ellipsoid: Ellipsoid, polar: Floats) -> BallPoses:
    """Apices and normals at polar angles (k,), radians, in the half-plane of azimuth zero."""
    frame = ellipsoid.frame()
    u = np.cos(polar)[:, None] * frame[0] + np.sin(polar)[:, None] * frame[1]
    return BallPoses(polar, ellipsoid.apices(u) @ frame.T, ellipsoid.normals(u) @ frame.T)


def used_outlines(poses: BallPoses, radius: Floats, pinhole: float, capture: float) -> Floats:
    """Outline on each ball of the part that shows the capture sphere, mm, (k, OUTLINE_POINTS, 3).

    Outside the outline rays from the camera miss the sphere. The tilt of the ball's surface at
    which they touch it is found by bisection, in OUTLINE_POINTS directions about the apex. The
    pinhole is given by its distance along the axis, capture is the sphere's radius, mm.
    """
    camera, circle = np.array([pinhole, 0.0, 0.0]), unit_circle(even_angles(OUTLINE_POINTS))
    tangent = _tangents(poses.normal, circle)
    tilt = _touching_tilts(poses.apex, poses.normal, tangent, radius, camera, capture)[..., None]
    apex_normal = poses.normal[:, None]
    normal = np.cos(tilt) * apex_normal + np.sin(tilt) * tangent
    return np.asarray(poses.apex[:, None] + radius[:, None, None] * (normal - apex_normal))


def _tangents(normal: Floats, circle: Floats) -> Floats:
    """Unit vectors (k, s, 3) square to normals (k, 3) in the directions of points (s, 2)."""
    across = np.array([0.0, 0.0, 1.0])
    in_plane = np.cross(across, normal)[:, None]
    return np.asarray(circle[:, :1] * in_plane + circle[:, 1:] * across)


@compiled_loop
def _touching_tilts(
    apex: Floats, normal: Floats, tangent: Floats, radius: Floats, camera: Floats, capture: float
) -> Floats:
    """Tilts (k, s) toward unit vectors (k, s, 3) at which camera rays touch the sphere, radians."""
    result, pinhole = np.empty(tangent.shape[:2]), vector(camera)
    for k in range(len(apex)):
        top, up = vector(apex[k]), vector(normal[k])
        for s in range(tangent.shape[1]):
            low, high, toward = 0.0, MAX_TILT, vector(tangent[k, s])
            for _ in range(BISECTIONS):
                tilt = (low + high) / 2
                tilted = plus_scaled(scaled(cos(tilt), up), sin(tilt), toward)
                point = plus_scaled(top, radius[k], minus(tilted, up))
                if _hits_sphere(point, tilted, pinhole, capture):
                    low = tilt
                else:
                    high = tilt
            result[k, s] = low
    return result


@compiled_part
def _hits_sphere(point: Vector, normal: Vector, camera: Vector, capture: float) -> bool:
    """Whether a ray from the camera meets the capture sphere after a mirror at a point."""
    toward_origin = -dot(reflect(unit(minus(point, camera)), normal), point)
    return toward_origin > sqrt(max(dot(point, point) - capture * capture, 0.0))


def light_hulls(outline: Floats, pinhole: float, capture: float) -> tuple[RoundCones, RoundCones]:
    """Hulls that hold all light of each ball: capture sphere to ball, ball to pinhole, (k,).

    The part in use, with outlines (k, s, 3), lies in the ball about the outline's middle, so every
    ray lies in the hull of that ball and the capture sphere, or of that ball and the pinhole.
    """
    middle = (outline.min(axis=1) + outline.max(axis=1)) / 2
    radius = norm(outline - middle[:, None]).max(axis=1) / np.cos(np.pi / outline.shape[1])
    middle, zero = middle[:, :2], np.zeros_like(radius)
    at_object, at_camera = np.zeros_like(middle), np.broadcast_to([pinhole, 0.0], middle.shape)
    return (
        RoundCones(at_object, middle, zero + capture, radius),
        RoundCones(at_camera, middle, zero, radius),
    )


def pixel_counts(camera: Camera, frame: Floats, outline: Floats, azimuth: Floats) -> Floats:
    """Number of pixels inside outlines at azimuths (m,), radians, exact, (m,).

    Outlines (m, s, 3), mm, are at azimuth zero in the ellipsoid's frame, rows (3, 3).
    """
    ray = rotated_about_x(outline, azimuth[:, None]) @ frame - camera.pinhole
    across = ray @ camera.axes[:2].T
    return enclosed_areas(across / (ray @ camera.forward)[..., None] / camera.pixel_pitch)


def enclosed_areas(outline: Floats) -> Floats:
    """Areas (m,) within smooth closed curves sampled evenly at points (m, s, 2).

    With the Fourier series sum c_n e^(i n t) of the curve the area is pi sum n |c_n|^2.
    """
    count = outline.shape[1]
    terms = np.fft.fft(outline[..., 0] + 1j * outline[..., 1], axis=1) / count
    order = np.fft.fftfreq(count, 1 / count)
    return np.asarray(np.abs(np.pi * (order * np.abs(terms) ** 2).sum(axis=1)))


def field_angles(ellipsoid: Ellipsoid, polar: Floats) -> Floats:
    """Angle at the pinhole between the axis (to the origin) and each apex, radians, (k,)."""
    ray = unit_vectors(ball_poses(ellipsoid, polar).apex - [norm(ellipsoid.pinhole), 0.0, 0.0])
    return np.asarray(np.arctan2(ray[:, 1], -ray[:, 0]))

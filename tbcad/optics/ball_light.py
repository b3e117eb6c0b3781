"""The part of a ball that shows the capture sphere to the camera, and the light that it takes.

A ball is placed with its apex on the ellipsoid. Points are given in the ellipsoid's frame (along
the axis, out from it at azimuth zero, across), since a rotation about the axis changes nothing in
that frame but the azimuth.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.ellipsoid import Ellipsoid
from tbcad.geometry.rotations import even_angles, rotated_about_x, unit_circle
from tbcad.geometry.round_cones import RoundCones
from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.camera import Camera
from tbcad.optics.reflection import reflected_rays
from tbcad.types import Bools, Floats

# Points of an outline: it is so smooth that its area by Fourier series is exact to 10^-6.
OUTLINE_POINTS = 24
# A tilt of the mirror turns the ray by twice as much, or less across the plane of incidence, so
# no ray at this tilt meets the capture sphere.
MAX_TILT = np.radians(70)
BISECTIONS = 50


@dataclass(frozen=True)
class BallPoses:
    """Balls in the half-plane of azimuth zero, over k of them.

    Attributes:
        polar: polar angles about the axis, radians, (k,).
        apex: points on the ellipsoid, mm, (k, 3), the third zero.
        normal: inward unit normals there, (k, 3), the third zero.
    """

    polar: Floats
    apex: Floats
    normal: Floats


def ball_poses(ellipsoid: Ellipsoid, polar: Floats) -> BallPoses:
    """Apices and normals at polar angles (k,), radians, in the half-plane of azimuth zero."""
    frame = ellipsoid.frame()
    u = np.cos(polar)[:, None] * frame[0] + np.sin(polar)[:, None] * frame[1]
    return BallPoses(polar, ellipsoid.apices(u) @ frame.T, ellipsoid.normals(u) @ frame.T)


def used_outlines(poses: BallPoses, radius: Floats, pinhole: float, capture: float) -> Floats:
    """Outline on each ball of the part that shows the capture sphere, mm, (k, OUTLINE_POINTS, 3).

    Outside the outline rays from the camera miss the sphere. The tilt of the ball's surface at
    which they touch it is found by bisection, in OUTLINE_POINTS directions about the apex.

    Args:
        poses: of the balls, (k,).
        radius: of the balls, mm, (k,).
        pinhole: distance of the pinhole along the axis, mm.
        capture: radius of the capture sphere, mm.
    """
    camera = np.array([pinhole, 0.0, 0.0])
    low = np.zeros((len(radius), OUTLINE_POINTS))
    high = np.full_like(low, MAX_TILT)
    for _ in range(BISECTIONS):
        tilt = (low + high) / 2
        hits = _hits_sphere(*_tilted_surface(poses, radius, tilt), camera, capture)
        low, high = np.where(hits, tilt, low), np.where(hits, high, tilt)
    point, _ = _tilted_surface(poses, radius, low)
    return point


def _tilted_surface(poses: BallPoses, radius: Floats, tilt: Floats) -> tuple[Floats, Floats]:
    """Points and normals (k, s, 3) of the balls at tilts (k, s) from their apices' normals."""
    circle = unit_circle(even_angles(tilt.shape[1]))
    across = np.array([0.0, 0.0, 1.0])
    in_plane = np.cross(across, poses.normal)[:, None]
    tangent = circle[:, :1] * in_plane + circle[:, 1:] * across
    apex_normal = poses.normal[:, None]
    normal = np.cos(tilt)[..., None] * apex_normal + np.sin(tilt)[..., None] * tangent
    return poses.apex[:, None] + radius[:, None, None] * (normal - apex_normal), normal


def _hits_sphere(point: Floats, normal: Floats, camera: Floats, capture: float) -> Bools:
    """Whether rays from the camera meet the capture sphere after mirrors at points (..., 3)."""
    toward_origin = -dot(reflected_rays(camera, point, normal), point)
    tangent_length = np.sqrt(np.maximum(dot(point, point) - capture**2, 0))
    return np.asarray(toward_origin > tangent_length)


def light_hulls(outline: Floats, pinhole: float, capture: float) -> tuple[RoundCones, RoundCones]:
    """Hulls that hold all light of each ball: capture sphere to ball, ball to pinhole, (k,).

    The part in use lies in the ball about the middle of its outline, so every ray lies in the hull
    of that ball and the capture sphere, or of that ball and the pinhole.

    Args:
        outline: on the balls, mm, (k, s, 3).
        pinhole: distance along the axis, mm.
        capture: radius of the capture sphere, mm.
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
    """Number of pixels inside outlines (m, s, 3) at azimuths (m,), exact, (m,).

    Args:
        camera: that sees them.
        frame: rows of the ellipsoid's frame, (3, 3).
        outline: at azimuth zero, mm, (m, s, 3).
        azimuth: radians, (m,).
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
    ray = unit(ball_poses(ellipsoid, polar).apex - [norm(ellipsoid.pinhole), 0.0, 0.0])
    return np.asarray(np.arctan2(ray[:, 1], -ray[:, 0]))

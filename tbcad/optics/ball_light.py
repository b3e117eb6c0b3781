"""The part of a ball that shows the capture sphere to the camera, and the light that it takes.

A ball stands with its apex on the ellipsoid; points are given in the ellipsoid's frame (along the
axis, out from it at azimuth zero, across), since turning about the axis changes nothing there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.geometry.ellipsoid import Ellipsoid
from tbcad.geometry.round_cones import RoundCones
from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.camera import Camera
from tbcad.optics.trace import reflected
from tbcad.types import Floats

# Points of an outline: it is so smooth that its area by Fourier series is exact to 10^-6.
OUTLINE_POINTS = 24
# A ray is turned by twice the tilt of the mirror, less across the plane of incidence.
STEEPEST = np.radians(70)
HALVINGS = 50


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
    """Apices and normals at polar angles (k,) in the half-plane of azimuth zero."""
    frame = ellipsoid.frame()
    u = np.cos(polar)[:, None] * frame[0] + np.sin(polar)[:, None] * frame[1]
    return BallPoses(polar, ellipsoid.apices(u) @ frame.T, ellipsoid.normals(u) @ frame.T)


def turned(points: Floats, azimuth: Floats) -> Floats:
    """Points (..., 3) of the frame turned about its axis by angles (...), radians."""
    along, out, across = np.moveaxis(points, -1, 0)
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    return np.stack([along, cosine * out - sine * across, sine * out + cosine * across], axis=-1)


def used_outlines(at: BallPoses, radius: Floats, pinhole: float, capture: float) -> Floats:
    """Outline on each ball of the part that shows the capture sphere, mm, (k, POINTS, 3).

    Args:
        at: where the balls stand, (k,).
        radius: of the balls, mm, (k,).
        pinhole: distance of the pinhole along the axis, mm.
        capture: radius of the capture sphere, mm.

    Outside the outline rays from the camera miss the sphere. The tilt of the ball's surface at
    which they touch it is found by halving, in POINTS directions about the apex.
    """
    camera = np.array([pinhole, 0.0, 0.0])
    low, high = (
        np.zeros((len(radius), OUTLINE_POINTS)),
        np.full((len(radius), OUTLINE_POINTS), STEEPEST),
    )
    for _ in range(HALVINGS):
        tilt = (low + high) / 2
        meets = _meets(*_surface(at, radius, tilt), camera, capture)
        low, high = np.where(meets, tilt, low), np.where(meets, high, tilt)
    point, _ = _surface(at, radius, low)
    return point


def _surface(at: BallPoses, radius: Floats, tilt: Floats) -> tuple[Floats, Floats]:
    """Points and normals (k, POINTS, 3) of the balls tilted (k, POINTS) from their apices."""
    turn = 2 * np.pi * np.arange(OUTLINE_POINTS) / OUTLINE_POINTS
    across = np.array([0.0, 0.0, 1.0])
    in_plane = np.cross(across, at.normal)[:, None]
    away = np.cos(turn)[:, None] * in_plane + np.sin(turn)[:, None] * across
    normal = np.cos(tilt)[..., None] * at.normal[:, None] + np.sin(tilt)[..., None] * away
    return at.apex[:, None] + radius[:, None, None] * (normal - at.normal[:, None]), normal


def _meets(point: Floats, normal: Floats, camera: Floats, capture: float) -> NDArray[np.bool_]:
    """Whether rays from the camera off these points meet the capture sphere."""
    out = reflected(camera, point, normal)
    forward = -dot(out, point)
    meets: NDArray[np.bool_] = forward > np.sqrt(np.maximum(dot(point, point) - capture**2, 0))
    return meets


def light_hulls(outline: Floats, pinhole: float, capture: float) -> tuple[RoundCones, RoundCones]:
    """Hulls that hold all light of each ball: capture sphere to ball, ball to pinhole, (k,).

    Args:
        outline: on the balls, mm, (k, s, 3).
        pinhole: distance along the axis, mm.
        capture: radius of the capture sphere, mm.

    The useful part lies in the ball about the middle of its outline, so every ray lies in the hull
    of that ball and the capture sphere, and of that ball and the pinhole.
    """
    middle = (outline.min(axis=1) + outline.max(axis=1)) / 2
    reach = norm(outline - middle[:, None]).max(axis=1) / np.cos(np.pi / outline.shape[1])
    middle, still = middle[:, :2], np.zeros_like(reach)
    at_object, at_camera = np.zeros_like(middle), np.broadcast_to([pinhole, 0.0], middle.shape)
    return (
        RoundCones(at_object, middle, still + capture, reach),
        RoundCones(at_camera, middle, still, reach),
    )


def pixel_counts(view: Camera, frame: Floats, outline: Floats, azimuth: Floats) -> Floats:
    """Number of pixels inside outlines (m, s, 3) turned by azimuths (m,), exact, (m,).

    Args:
        view: the camera.
        frame: rows of the ellipsoid's frame, (3, 3).
        outline: at azimuth zero, mm, (m, s, 3).
        azimuth: radians, (m,).
    """
    ray = turned(outline, azimuth[:, None]) @ frame - view.pinhole
    axes = np.stack([view.right, np.cross(view.forward, view.right)])
    width = view.half_sizes[0] * 2 / view.width_px
    image = (ray @ axes.T) / (ray @ view.forward)[..., None] / width
    return enclosed_areas(image)


def enclosed_areas(outline: Floats) -> Floats:
    """Areas (m,) within smooth closed curves sampled evenly at points (m, s, 2).

    With the Fourier series sum c_n e^(i n t) of the curve the area is pi sum n |c_n|^2.
    """
    count = outline.shape[1]
    terms = np.fft.fft(outline[..., 0] + 1j * outline[..., 1], axis=1) / count
    order = np.fft.fftfreq(count, 1 / count)
    area: Floats = np.abs(np.pi * (order * np.abs(terms) ** 2).sum(axis=1))
    return area


def ball_miss_distances(camera: Floats, ray: Floats, centre: Floats, radius: Floats) -> Floats:
    """Distance from the origin of rays after balls, mm, (...); infinite where they miss the ball.

    Args:
        camera: the pinhole, mm, (3,).
        ray: unit directions, (..., 3).
        centre: of the balls, mm, (..., 3).
        radius: of the balls, mm, (...).
    """
    to_centre = centre - camera
    along = dot(ray, to_centre)
    inside = radius**2 - dot(to_centre, to_centre) + along**2
    point = camera + (along - np.sqrt(np.maximum(inside, 0)))[..., None] * ray
    out = reflected(camera, point, (point - centre) / radius[..., None])
    back = (inside < 0) | (dot(out, point) > 0)
    miss: Floats = np.where(back, np.inf, norm(np.cross(point, out)))
    return miss


def field_angles(ellipsoid: Ellipsoid, polar: Floats) -> Floats:
    """Angle at the pinhole between the axis (to the origin) and each apex, radians, (k,)."""
    way = unit(ball_poses(ellipsoid, polar).apex - [norm(ellipsoid.pinhole), 0.0, 0.0])
    angle: Floats = np.arctan2(way[:, 1], -way[:, 0])
    return angle

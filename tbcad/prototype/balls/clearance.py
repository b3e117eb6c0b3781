"""What each ball must keep clear of: other balls, their light, the post and the camera.

Every one of these becomes an angle about the axis, in closed form (optics/swing.py).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tbcad.geometry.round_cones import RoundCones, contact_angle, spheres
from tbcad.optics.ball_light import light_hulls
from tbcad.optics.camera import Camera
from tbcad.prototype.balls.selection import Balls
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import PrototypeSpec
from tbcad.types import Floats

# Kept on top of every least angle, radians: far more than the solver's rounding and far less than
# matters, so that no two balls come closer than they may.
SOLVER_MARGIN = 1e-4


@dataclass(frozen=True)
class Obstacle:
    """Something that does not turn with the base.

    Attributes:
        cone: its hull, (1,).
        azimuth: of the half-plane it lies in, radians in (0, 2 pi).
    """

    cone: RoundCones
    azimuth: float


def min_separations(
    balls: Balls, keys: PrototypeSpec, pinhole: float, capture: float
) -> tuple[Floats, Floats]:
    """Least differences of azimuth so that no balls touch, and so that light passes, (k, k) each.

    Args:
        balls: in the frame at azimuth zero.
        keys: the wall between balls and the margin of the light.
        pinhole: distance of the pinhole along the axis, mm.
        capture: radius of the capture sphere, mm.
    """
    centre, radius = balls.body_centre[:, :2], balls.body_radius
    touch = contact_angle(centre, radius, spheres(centre, radius).grown(keys.ball_wall_mm))
    to_object, to_camera = light_hulls(balls.outline, pinhole, capture)
    dark = np.maximum(
        contact_angle(centre, radius, to_object.grown(keys.light_margin_mm)),
        contact_angle(centre, radius, to_camera.grown(keys.light_margin_mm)),
    )
    # Of a pair each must leave the other's light alone.
    return _between(touch), _between(np.maximum(dark, dark.T))


def _between(angle: Floats) -> Floats:
    result = np.where(angle > 0, angle + SOLVER_MARGIN, 0.0)
    np.fill_diagonal(result, 0.0)
    return result


def obstacles(keys: PrototypeSpec, frame: Floats, view: Camera, length: float) -> list[Obstacle]:
    """The post below the object and the camera's body behind its pinhole.

    Args:
        keys: their sizes.
        frame: rows of the ellipsoid's frame, (3, 3).
        view: the camera.
        length: of the post, to beyond all balls, mm.
    """
    post = _obstacle(np.zeros(3), frame @ [0.0, 0.0, -length], keys.post_diameter_mm / 2)
    start = frame @ view.pinhole
    end = start - keys.camera_length_mm * (frame @ view.forward)
    camera = _obstacle(start, end, keys.camera_diameter_mm / 2)
    sizes = (keys.post_diameter_mm, keys.camera_diameter_mm)
    return [thing for thing, size in zip((post, camera), sizes, strict=True) if size > 0]


def _obstacle(start: Floats, end: Floats, radius: float) -> Obstacle:
    """A capsule from a point on the axis to another point."""
    azimuth = float(np.arctan2(end[2], end[1])) % (2 * np.pi)
    first, second = (np.array([[point[0], np.hypot(*point[1:])]]) for point in (start, end))
    size = np.array([radius])
    return Obstacle(RoundCones(first, second, size, size), azimuth)


def allowed_azimuths(
    balls: Balls, keys: PrototypeSpec, things: Iterable[Obstacle]
) -> tuple[Floats, Floats]:
    """Least and largest azimuth (k,) of each ball such that it meets nothing in between.

    Raises:
        SpecError: when a ball meets something at every azimuth.
    """
    floor, ceiling = np.full(len(balls), -np.pi), np.full(len(balls), np.pi)
    for thing in things:
        cone = thing.cone.grown(keys.ball_wall_mm)
        half = contact_angle(balls.body_centre[:, :2], balls.body_radius, cone)[0]
        if half.max() >= np.pi:
            raise SpecError(
                f"ball {int(half.argmax()) + 1} meets the post or the camera at every angle of "
                "the base: make prototype.post_diameter_mm or prototype.camera_diameter_mm smaller"
            )
        met = half > 0
        ceiling[met] = np.minimum(ceiling, thing.azimuth - half)[met]
        floor[met] = np.maximum(floor, thing.azimuth - 2 * np.pi + half)[met]
    return floor, ceiling


def seat_half_angles(balls: Balls, wall: float) -> Floats:
    """Angle at the axis between a ball's centre and the edge of its seat, radians, (k,)."""
    share = (balls.body_radius + wall) / np.maximum(balls.body_centre[:, 1], 1e-9)
    angle: Floats = np.arcsin(np.minimum(share, 1))
    return angle

"""What each ball must keep clear of: other balls, their light, the post and the camera.

Each becomes an angle about the axis, in closed form (geometry/round_cones.py).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.round_cones import RoundCones, contact_angle, spheres
from tbcad.core.optics.ball_light import light_hulls
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.balls.selection import Balls
from tbcad.types import Floats

# Added to each minimum angle, radians: far more than the solver's rounding and far less than
# matters, so that balls keep their distance in spite of that rounding.
SOLVER_MARGIN = 1e-4
# Minimum distance of a ball from the axis, mm, against division by zero.
NEAR_AXIS_MM = 1e-9


@dataclass(frozen=True)
class Obstacle:
    """Something that does not rotate with the base."""

    cone: RoundCones  # its hull, (1,)
    azimuth: float  # of the half-plane that contains it, radians in (0, 2 pi)


def min_separations(
    balls: Balls, spec: PrototypeSpec, pinhole: float, capture: float
) -> tuple[Floats, Floats]:
    """Minimum differences of azimuth so that no balls touch, and so that light passes, (k, k) each.

    pinhole is its distance along the axis and capture the radius of the capture sphere, mm.
    """
    centre, radius = balls.body_centre[:, :2], balls.body_radius
    touching = contact_angle(centre, radius, spheres(centre, radius).grown(spec.ball_wall_mm))
    to_object, to_camera = light_hulls(balls.outline, pinhole, capture)
    blocking = np.maximum(
        contact_angle(centre, radius, to_object.grown(spec.light_margin_mm)),
        contact_angle(centre, radius, to_camera.grown(spec.light_margin_mm)),
    )
    # Neither ball of a pair may block the other's light.
    return _with_margin(touching), _with_margin(np.maximum(blocking, blocking.T))


def _with_margin(angle: Floats) -> Floats:
    result = np.where(angle > 0, angle + SOLVER_MARGIN, 0.0)
    np.fill_diagonal(result, 0.0)
    return result


def obstacles(spec: PrototypeSpec, frame: Floats, view: Camera, length: float) -> list[Obstacle]:
    """The post below the object, and the camera behind its pinhole; of diameter zero left out.

    The post's length reaches beyond all balls, mm; frame (3, 3): rows of the ellipsoid's frame.
    """
    post = _capsule(np.zeros(3), frame @ [0.0, 0.0, -length], spec.post_diameter_mm / 2)
    start = frame @ view.pinhole
    end = start - spec.camera_length_mm * (frame @ view.forward)
    camera = _capsule(start, end, spec.camera_diameter_mm / 2)
    return [obstacle for obstacle in (post, camera) if obstacle.cone.start_radius[0] > 0]


def _capsule(start: Floats, end: Floats, radius: float) -> Obstacle:
    """A capsule from a point on the axis to another point."""
    azimuth = float(np.arctan2(end[2], end[1])) % (2 * np.pi)
    first, second = (np.array([[point[0], np.hypot(*point[1:])]]) for point in (start, end))
    size = np.array([radius])
    return Obstacle(RoundCones(first, second, size, size), azimuth)


def allowed_azimuths(
    balls: Balls, spec: PrototypeSpec, obstacles: Iterable[Obstacle]
) -> tuple[Floats, Floats]:
    """Minimum and maximum azimuth (k,) of each ball between which it is clear of all obstacles.

    SpecError when a ball meets an obstacle at every azimuth.
    """
    lowest, highest = np.full(len(balls), -np.pi), np.full(len(balls), np.pi)
    for obstacle in obstacles:
        cone = obstacle.cone.grown(spec.ball_wall_mm)
        half = contact_angle(balls.body_centre[:, :2], balls.body_radius, cone)[0]
        if half.max() >= np.pi:
            raise SpecError(
                f"ball {int(half.argmax()) + 1} meets the post or the camera at every angle of "
                "the base: make prototype.post_diameter_mm or prototype.camera_diameter_mm smaller"
            )
        met = half > 0
        highest[met] = np.minimum(highest, obstacle.azimuth - half)[met]
        lowest[met] = np.maximum(lowest, obstacle.azimuth - 2 * np.pi + half)[met]
    return lowest, highest


def seat_half_angles(balls: Balls, wall: float) -> Floats:
    """Angle at the axis between a ball's centre and the edge of its seat, radians, (k,)."""
    out = np.maximum(balls.body_centre[:, 1], NEAR_AXIS_MM)
    return np.asarray(np.arcsin(np.minimum((balls.body_radius + wall) / out, 1)))

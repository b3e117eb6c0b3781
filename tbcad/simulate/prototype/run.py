"""One run of the base through its stops, seen from the object.

The second half is photographed with the object turned by 180 degrees about z. In the frame of the
object the prototype is turned instead: its camera is then where the shell's camera b is, and each
ball in the place of one of camera b's mirrors. Both runs differ only in where the prototype is.
"""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.geometry.rotations import rotated
from tbcad.geometry.vectors import norm, unit
from tbcad.optics.camera import Camera
from tbcad.optics.surfaces import Surfaces
from tbcad.simulate.prototype.plan import HALF_TURN, Plan
from tbcad.simulate.scene.reflector import Reflector, SubstitutedReflector
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class PrototypeRun:
    """A run of s stops, whose balls replace the m mirrors of one of the shell's cameras.

    All in the frame of the object.

    Attributes:
        reflector: the shell's camera and mirrors, whose picture is composed.
        camera: that takes the photographs.
        balls: at each stop: centre and radius of the reflecting sphere, centre and radius of the
            sphere in the seat, mm, (s, k, 8).
        stop: whose photograph shows the ball in place of each mirror, (m,).
        ball: in place of each mirror, (m,).
        ball_surfaces: the reflecting surface of that ball at that stop, (m,).
        window_rotation: matrices that rotate directions (3,) @ matrix of the shell's picture into
            the photograph's, (m, 3, 3).
    """

    reflector: Reflector
    camera: Camera
    balls: Floats
    stop: Ints
    ball: Ints
    ball_surfaces: Surfaces
    window_rotation: Floats

    def __len__(self) -> int:
        """Number of stops."""
        return len(self.balls)


def prototype_runs(
    reflectors: tuple[Reflector, Reflector], plan: Plan
) -> tuple[PrototypeRun, PrototypeRun]:
    """Both runs: that for camera a's mirrors, and that for camera b's, the object turned."""
    a, b = reflectors
    return _run(a, a.camera, plan, 0, np.ones(3)), _run(b, a.camera, plan, 1, HALF_TURN)


def ball_reflector(run: PrototypeRun) -> SubstitutedReflector:
    """What a light field records of a run: the shell's camera and cells, with balls for mirrors.

    `u` are the directions of the balls: where the virtual cameras really were.
    """
    shell, balls = run.reflector, run.ball_surfaces
    return SubstitutedReflector(shell.camera_id, shell.camera, unit(balls.apex), shell.cells, balls)


def _run(reflector: Reflector, camera: Camera, plan: Plan, of: int, flip: Floats) -> PrototypeRun:
    ball, stop, frame = plan.ball[of], plan.stop[of], plan.frame * flip
    angle = plan.angle[stop]
    apex, normal = (
        rotated(vectors[ball] * flip, frame[0], angle) for vectors in (plan.apex, plan.normal)
    )
    turned = replace(
        camera,
        pinhole=camera.pinhole * flip,
        forward=camera.forward * flip,
        right=camera.right * flip,
    )
    rotations = _window_rotations(reflector.mirrors.apex, apex, frame, turned.pinhole)
    if not plan.moved:
        rotations = np.broadcast_to(np.eye(3), rotations.shape)
    return PrototypeRun(
        reflector=reflector,
        camera=turned,
        balls=_balls_at_stops(plan, frame[0], flip),
        stop=stop,
        ball=ball,
        ball_surfaces=Surfaces(apex, normal, 1 / plan.radius[ball]),
        window_rotation=rotations,
    )


def _balls_at_stops(plan: Plan, axis: Floats, flip: Floats) -> Floats:
    """All balls at all stops, (s, k, 8)."""
    shape = (len(plan.angle), len(plan))
    centre, body_centre = (
        rotated(np.broadcast_to(points * flip, (*shape, 3)), axis, plan.angle[:, None])
        for points in (plan.centre, plan.body_centre)
    )
    radius, body_radius = (
        np.broadcast_to(values, shape)[..., None] for values in (plan.radius, plan.body_radius)
    )
    return np.concatenate([centre, radius, body_centre, body_radius], axis=2)


def _window_rotations(mirror: Floats, ball: Floats, frame: Floats, pinhole: Floats) -> Floats:
    """Rotation of each mirror's window along with its ball, (m, 3, 3).

    About the axis by the known difference of both azimuths, then in the plane of the axis by the
    known angle between both apices as the pinhole sees them (tbcad.optics.windows).

    Args:
        mirror: apices of the mirrors, mm, (m, 3).
        ball: apices of the balls in their places, mm, (m, 3).
        frame: rows: axis, azimuth zero and third, (3, 3).
        pinhole: mm, (3,).
    """
    (phi, low), (psi, high) = (_angles(apex, frame, pinhole) for apex in (mirror, ball))
    normal = np.cos(psi)[:, None] * frame[2] - np.sin(psi)[:, None] * frame[1]
    still = np.broadcast_to(np.eye(3), (len(mirror), 3, 3))
    about_axis = rotated(still, frame[0], (psi - phi)[:, None])
    return rotated(about_axis, normal[:, None], (low - high)[:, None])


def _angles(apex: Floats, frame: Floats, pinhole: Floats) -> tuple[Floats, Floats]:
    """Azimuth of apices (m, 3), and the angle at the pinhole between them and the origin."""
    ray = apex - pinhole
    along = ray @ frame[0]
    across = norm(ray - along[:, None] * frame[0])
    return np.arctan2(apex @ frame[2], apex @ frame[1]), np.arctan2(across, -along)

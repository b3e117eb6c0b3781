"""One run of the base through its stops, seen from the object.

The second half is photographed with the object turned by 180 degrees about z. In the frame of the
object the prototype is turned instead: its camera is then where the shell's camera b is, and each
ball in the place of one of camera b's mirrors. Both runs differ only in where the prototype is.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.camera import LensCamera, without_distortion
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.optics.surfaces import Surfaces
from tbcad.light.simulate.prototype.plan import HALF_TURN, Plan
from tbcad.light.simulate.scene.reflector import Reflector, SubstitutedReflector
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class PrototypeRun:
    """A run of s stops, whose balls replace the m mirrors of one of the shell's cameras.

    All in the frame of the object.
    """

    reflector: Reflector  # the shell's camera and mirrors, whose picture is composed
    camera: LensCamera  # that takes the photographs
    # at each stop: centre and radius of the reflecting sphere, centre and radius of the sphere in
    # the seat, mm, (s, k, 8)
    balls: Floats
    stop: Ints  # whose photograph shows the ball in place of each mirror, (m,)
    ball: Ints  # in place of each mirror, (m,)
    ball_surfaces: Surfaces  # the reflecting surface of that ball at that stop, (m,)
    # matrices that rotate directions (3,) @ matrix of the shell's picture into the photograph's,
    # (m, 3, 3)
    window_rotation: Floats
    # whether a pixel of one mirror never shows another's ball: mirrors on pedestals
    parted: bool = False

    def __len__(self) -> int:
        return len(self.balls)


def prototype_runs(
    reflectors: tuple[Reflector, Reflector], plan: Plan
) -> tuple[PrototypeRun, PrototypeRun]:
    """Both runs as designed: for camera a's mirrors, and for camera b's, the object turned."""
    camera = without_distortion(reflectors[0].camera)
    a, b = (
        prototype_run(reflector, plan, half, camera, _designed_balls(plan))
        for half, reflector in enumerate(reflectors)
    )
    return a, b


def prototype_run(
    reflector: Reflector, plan: Plan, half: int, camera: LensCamera, balls: Floats
) -> PrototypeRun:
    """One run of a prototype whose camera and balls are where they are.

    Args:
        reflector: the shell's camera and mirrors.
        plan: which ball stands in for which mirror.
        half: 0 for camera a's mirrors, 1 for camera b's, the object turned.
        camera: that takes the photographs, in the frame of the prototype.
        balls: at each stop, in the frame of the prototype, as of `PrototypeRun`, (s, k, 8).
    """
    flip = HALF_TURN if half else np.ones(3)
    balls, camera = balls * np.concatenate([flip, [1.0], flip, [1.0]]), _turned(camera, flip)
    ball, stop = plan.ball[half], plan.stop[half]
    centre, radius = balls[stop, ball, :3], balls[stop, ball, 3]
    apex = reflection_points(centre, radius, np.zeros(3), camera.pinhole)
    normal = (apex - centre) / radius[:, None]
    window = reflector.mirrors.apex if plan.moved else _designed_apex(plan, half) * flip
    return PrototypeRun(
        reflector=reflector,
        camera=camera,
        balls=balls,
        stop=stop,
        ball=ball,
        ball_surfaces=Surfaces(apex, normal, 1 / radius),
        window_rotation=_window_rotations(window, reflector.camera.pinhole, apex, camera.pinhole),
        parted=plan.parted,
    )


def balls_at_stops(
    plan: Plan, centre: Floats, radius: Floats, place: Callable[[Floats], Floats]
) -> Floats:
    """Balls as of `PrototypeRun`, (s, k, 8).

    Args:
        plan: says where the sphere in the seat is, from the reflecting one, and how much larger.
        centre: of the reflecting spheres at base angle zero, mm, (k, 3).
        radius: of the reflecting spheres, mm, (k,).
        place: moves points of the base (s, k, 3) from angle zero to the stops.
    """
    shape = (len(plan.angle), len(plan))
    front, body = (
        place(np.broadcast_to(points, (*shape, 3)))
        for points in (centre, centre + plan.body_centre - plan.centre)
    )
    body_radius = radius + (plan.body_radius - plan.radius)
    radii = [np.broadcast_to(one, shape)[..., None] for one in (radius, body_radius)]
    return np.concatenate([front, radii[0], body, radii[1]], axis=2)


def ball_reflector(run: PrototypeRun) -> SubstitutedReflector:
    """What a light field records of a run: the shell's camera and cells, with balls for mirrors.

    `u` are the directions of the balls: where the virtual cameras really were.
    """
    shell, balls = run.reflector, run.ball_surfaces
    return SubstitutedReflector(shell.camera_id, shell.camera, unit(balls.apex), shell.cells, balls)


def _designed_balls(plan: Plan) -> Floats:
    place = partial(rotated, axis=plan.frame[0], angle=plan.angle[:, None])
    return balls_at_stops(plan, plan.centre, plan.radius, place)


def _designed_apex(plan: Plan, half: int) -> Floats:
    """Apices of the balls in place of a half's mirrors, where they are designed to be, (m, 3)."""
    return rotated(plan.apex[plan.ball[half]], plan.frame[0], plan.angle[plan.stop[half]])


def _turned(camera: LensCamera, flip: Floats) -> LensCamera:
    return replace(camera, pinhole=camera.pinhole * flip, axes=camera.axes * flip)


def _window_rotations(
    window: Floats, window_pinhole: Floats, apex: Floats, pinhole: Floats
) -> Floats:
    """Rotation of each window along with its ball, (m, 3, 3).

    The direction to one apex becomes that to the other, and the plane of incidence of the light
    from the origin stays one (tbcad.core.optics.windows).

    Args:
        window: apices that the windows are about, mm, (m, 3).
        window_pinhole: that sees them, mm, (3,).
        apex: of the balls in their places, mm, (m, 3).
        pinhole: that sees the balls, mm, (3,).
    """
    before, after = _sight(window, window_pinhole), _sight(apex, pinhole)
    return np.asarray(np.swapaxes(before, 1, 2) @ after)


def _sight(apex: Floats, pinhole: Floats) -> Floats:
    """Rows: direction to each apex, across the plane of incidence, and in it, (m, 3, 3)."""
    ahead, home = unit(apex - pinhole), unit(-pinhole)
    along = dot(ahead, np.broadcast_to(home, ahead.shape))
    inward = unit(home - along[:, None] * ahead)
    return np.stack([ahead, np.cross(inward, ahead), inward], axis=1)

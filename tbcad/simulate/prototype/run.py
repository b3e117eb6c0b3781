"""One run of the base through its stops, seen from the object.

The second half is photographed with the object turned by 180 degrees about z. Seen from the object
the machine is turned instead: its camera then stands where the shell's camera b stands, and each
ball in the place of one of camera b's mirrors. So both runs are alike, and differ in where the
machine stands.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    """A run of s stops that stands in for the m mirrors of one of the shell's cameras.

    All in the frame of the object.

    Attributes:
        at: the shell's camera and mirrors, whose picture is wanted.
        view: the camera that takes the photographs.
        balls: at each stop: centre and radius of the reflecting sphere, centre and radius of the
            sphere in the seat, mm, (s, k, 8).
        stop: at which each mirror is served, (m,).
        ball: that stands in for it, (m,).
        stands: the balls' surfaces where they stand in, (m,).
        turn: matrices that turn directions (3,) @ turn of the shell's picture into the
            photograph's, (m, 3, 3).
    """

    at: Reflector
    view: Camera
    balls: Floats
    stop: Ints
    ball: Ints
    stands: Surfaces
    turn: Floats

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
    at = run.at
    return SubstitutedReflector(
        at.camera_id, at.camera, unit(run.stands.apex), at.cells, run.stands
    )


def _run(at: Reflector, view: Camera, plan: Plan, half: int, turn: Floats) -> PrototypeRun:
    ball, stop, frame = plan.ball[half], plan.stop[half], plan.frame * turn
    place = (ball, plan.angle[stop])
    apex, normal = (_at(points * turn, frame, *place) for points in (plan.apex, plan.normal))
    seen_from = _carried(view, turn)
    windows = _turns(at.mirrors.apex, apex, frame, seen_from.pinhole)
    still = np.broadcast_to(np.eye(3), windows.shape)
    return PrototypeRun(
        at=at,
        view=seen_from,
        balls=_everywhere(plan, frame, turn),
        stop=stop,
        ball=ball,
        stands=Surfaces(apex, normal, 1 / plan.radius[ball]),
        turn=windows if plan.moved else still,
    )


def _carried(view: Camera, turn: Floats) -> Camera:
    return Camera(
        view.pinhole * turn,
        view.forward * turn,
        view.right * turn,
        view.width_px,
        view.height_px,
        view.hfov,
    )


def _at(points: Floats, frame: Floats, ball: Ints, angle: Floats) -> Floats:
    """Points (k, 3) of balls (...) with the base at angles (...), (..., 3)."""
    return rotated(points[ball], frame[0], angle)


def _everywhere(plan: Plan, frame: Floats, turn: Floats) -> Floats:
    """All balls at all stops, (s, k, 8)."""
    ball, angle = np.arange(len(plan))[None, :], plan.angle[:, None]
    shape = (len(plan.angle), len(plan), 1)
    centre, body = (
        _at(points * turn, frame, np.broadcast_to(ball, shape[:2]), angle)
        for points in (plan.centre, plan.body_centre)
    )
    radius, body_radius = (
        np.broadcast_to(values[:, None], shape) for values in (plan.radius, plan.body_radius)
    )
    return np.concatenate([centre, radius, body, body_radius], axis=2)


def _turns(mirror: Floats, ball: Floats, frame: Floats, pinhole: Floats) -> Floats:
    """How each mirror's window goes along with its ball, (m, 3, 3).

    About the axis by the known difference of both azimuths, then in the plane of the axis by the
    known angle between both apices as the pinhole sees them (tbcad.design.balls).

    Args:
        mirror: apices of the mirrors, mm, (m, 3).
        ball: apices of the balls where they stand in, mm, (m, 3).
        frame: rows: axis, azimuth zero and third, (3, 3).
        pinhole: mm, (3,).
    """
    (phi, low), (psi, high) = (_angles(apex, frame, pinhole) for apex in (mirror, ball))
    side = np.cos(psi)[:, None] * frame[2] - np.sin(psi)[:, None] * frame[1]
    about = rotated(np.broadcast_to(np.eye(3), (len(mirror), 3, 3)), frame[0], (psi - phi)[:, None])
    return rotated(about, side[:, None], (low - high)[:, None])


def _angles(apex: Floats, frame: Floats, pinhole: Floats) -> tuple[Floats, Floats]:
    """Azimuth of apices (m, 3), and the angle at the pinhole between them and the origin."""
    way = apex - pinhole
    along = way @ frame[0]
    out = norm(way - along[:, None] * frame[0])
    return np.arctan2(apex @ frame[2], apex @ frame[1]), np.arctan2(out, -along)

"""The prototype's plan as a build says it, and its runs through all stops, seen from the object.

The second half is photographed with the object turned by 180 degrees about z. In the frame of the
object the prototype is turned instead: its camera is then where the shell's camera b is, and each
ball in the place of one of camera b's mirrors. Both runs differ only in where the prototype is.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from tbcad.cad.formats.checked_files import REBUILD, columns
from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import LensCamera, without_distortion
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.optics.sphere_forms import turned_axes
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import (
    ROUNDING,
    ExportedDesign,
    Reflector,
    SubstitutedReflector,
)
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.tables import SAG, BallRow, PictureRow
from tbcad.types import Floats, Ints

# Of lengths in mm after rounding in a text file.
ROUNDING_MM = 1e-6
APEX, NORMAL = "px py pz", "nx ny nz"
ERROR_DEG = 1e-6
SPHERES = 8  # columns of `PrototypeRun.balls` before a form
HALF_TURN = np.array([-1.0, -1.0, 1.0])
"""Factors that turn points and vectors by 180 degrees about z."""


@dataclass(frozen=True)
class Plan:
    """Balls on the base at angle zero, and how they stand in for m mirrors of each camera.

    Balls are where weight is to bring them, on the mean over their pictures.

    The first row of `ball` and `stop` is for camera a's mirrors, the second for camera b's: they
    are photographed in a second run by the same camera, with the object turned by 180 degrees.
    """

    frame: Floats  # rows: the axis that the base turns about, azimuth zero, and the third, (3, 3)
    apex: Floats  # of the balls, mm, (k, 3)
    normal: Floats  # inward unit normals there, (k, 3)
    radius: Floats  # of the reflecting spheres, mm, (k,)
    body_centre: Floats  # of the spheres in the seats, mm, (k, 3); a ball's own, if no cap
    body_radius: Floats  # mm, (k,)
    moved: bool  # whether a mirror's window moves along with its ball
    angle: Floats  # of the base at each stop, radians, (s,)
    ball: Ints  # that stands in, from 0, (2, m)
    stop: Ints  # at which it does, from 0, (2, m)
    # whether balls are ended by walls, so that a pixel of one never shows another: those of a shell
    # with mirrors on pedestals
    parted: bool = False
    # radius of the part of a cap in use, mm, (k,); 0 of balls. None: there are no caps
    half_aperture: Floats | None = None
    # mean displacement of the balls by weight, by which their seats are made beside their places,
    # mm, (k, 3), or zero
    sag: Floats = field(default_factory=lambda: np.zeros(3))

    def __len__(self) -> int:
        return len(self.radius)

    @property
    def centre(self) -> Floats:
        """Centres of the reflecting spheres, mm, (k, 3)."""
        return self.apex - self.radius[:, None] * self.normal


def read_plan(exported: ExportedDesign) -> Plan:
    """Read balls and plan of a folder that `tbcad build` wrote with a prototype.

    InputError: there is none, or what it says cannot be.
    """
    record, table, plan_file = (
        exported.folder / name for name in (NAME, BallRow.FILE, PictureRow.FILE)
    )
    document = Prototype.read(record)
    balls, pictures = BallRow.read(exported.folder), PictureRow.read(exported.folder)
    frame = np.array([document.frame.axis, document.frame.zero, document.frame.third])
    _check_frame(record, exported, frame)
    _check_balls(table, balls)
    mirrors = len(exported.reflectors[0])
    ball, stop, error_deg = _served(plan_file, pictures, len(balls), mirrors)
    plan = Plan(
        frame=frame,
        apex=columns(balls, APEX),
        normal=columns(balls, NORMAL),
        radius=columns(balls, "radius_mm")[:, 0],
        body_centre=columns(balls, "bx by bz") + columns(balls, SAG),
        body_radius=columns(balls, "body_radius_mm")[:, 0],
        moved=document.picture == "moved",
        angle=np.radians(_angles(plan_file, pictures)),
        ball=ball.astype(np.int64),
        stop=stop.astype(np.int64),
        half_aperture=_half_apertures(record, document, len(balls)),
        sag=columns(balls, SAG),
    )
    _check_errors(plan_file, error_deg, plan, exported)
    return plan


def _check_frame(path: Path, exported: ExportedDesign, frame: Floats) -> None:
    a, b = exported.reflectors
    pinhole = a.camera.pinhole
    offset = norm(pinhole) * frame[0] - pinhole
    if np.abs(frame @ frame.T - np.eye(3)).max() > ROUNDING or np.linalg.det(frame) < 0:
        raise InputError(f"{path}: frame is not square and right-handed: {REBUILD}")
    if norm(offset) > ROUNDING_MM:
        raise InputError(f"{path}: frame.axis does not point at the pinhole of camera a: {REBUILD}")
    if norm(b.camera.pinhole - HALF_TURN * pinhole) > ROUNDING_MM:
        raise InputError(
            f"{path}: camera b is not where the object turned by 180 degrees about z has camera "
            "a, so one camera cannot take both halves: set y of optics.camera_mm to 0"
        )


def _check_balls(path: Path, balls: list[BallRow]) -> None:
    if not balls:
        raise InputError(f"{path}: no balls, at least one is needed: {REBUILD}")
    number, radius = columns(balls, "number radius_mm").T
    apex, normal, centre = (columns(balls, names) for names in (APEX, NORMAL, "cx cy cz"))
    faults = (
        (number != np.arange(1, len(balls) + 1), "is out of order"),
        (np.abs(norm(normal) - 1) > ROUNDING, "has a normal of another length than 1"),
        (
            norm(apex - radius[:, None] * normal - centre) > ROUNDING_MM,
            "has a centre that is not its radius behind its apex",
        ),
    )
    for wrong, what in faults:
        if wrong.any():
            raise InputError(f"{path}: ball {int(np.argmax(wrong)) + 1} {what}: {REBUILD}")


def _half_apertures(path: Path, document: Prototype, balls: int) -> Floats:
    half = np.zeros(balls)
    for cap in document.caps:
        if not 1 <= cap.ball <= balls or cap.aperture_mm <= 0:
            raise InputError(f"{path}: cap {cap.ball} has no ball or aperture: {REBUILD}")
        half[cap.ball - 1] = cap.aperture_mm / 2
    return half


def _angles(path: Path, pictures: list[PictureRow]) -> Floats:
    """Base angle at each stop, degrees, (s,)."""
    angles: dict[int, float] = {}
    for one in pictures:
        if angles.setdefault(one.stop, one.base_angle_deg) != one.base_angle_deg:
            raise InputError(f"{path}: stop {one.stop} has two base angles: {REBUILD}")
    stops = sorted(angles)
    if stops != list(range(1, len(stops) + 1)):
        raise InputError(f"{path}: stops are not numbered from 1 without a gap: {REBUILD}")
    angle = np.array([angles[stop] for stop in stops])
    if (np.diff(angle) <= 0).any():
        raise InputError(f"{path}: base angles do not rise from stop to stop: {REBUILD}")
    return angle


def _served(path: Path, pictures: list[PictureRow], balls: int, mirrors: int) -> Floats:
    """Ball and stop, from 0, and error of each mirror of camera a and of camera b, (3, 2, m)."""
    served = np.full((3, 2, mirrors), -1.0)
    for row, one in enumerate(pictures, 1):
        turn, wrong = one.object_turn_deg, ""
        camera, mirror = int(turn != 0), int(one.mirror[1:]) - 1
        if turn not in (0, 180):
            wrong = f"has object_turn_deg {turn:g}, allowed is 0 or 180"
        elif one.ball > balls:
            wrong = f"names ball {one.ball}, allowed is 1 to {balls}"
        elif one.mirror[0] != "ab"[camera] or not 0 <= mirror < mirrors:
            wrong = (
                f"shows {one.mirror}, allowed with the object turned by {turn:g} degrees is "
                f"{_name(camera, 0)} to {_name(camera, mirrors - 1)}"
            )
        elif served[0, camera, mirror] >= 0:
            wrong = f"shows {one.mirror} a second time"
        if wrong:
            raise InputError(f"{path}: row {row} {wrong}: {REBUILD}")
        served[:, camera, mirror] = one.ball - 1, one.stop - 1, one.error_deg
    missing = np.argwhere(served[0] < 0)
    if missing.size:
        raise InputError(f"{path} does not show mirror {_name(*missing[0].tolist())}: {REBUILD}")
    return served


def _name(camera: int, mirror: int) -> str:
    return f"{'ab'[camera]}{mirror + 1:04d}"


def _check_errors(path: Path, said: Floats, plan: Plan, exported: ExportedDesign) -> None:
    """The balls must stand where the plan says: as far from each mirror's direction as it says."""
    a, b = exported.reflectors
    u = np.stack([a.u, b.u * HALF_TURN])
    apex = rotated(plan.apex[plan.ball], plan.frame[0], plan.angle[plan.stop])
    apart = norm(apex / norm(apex)[..., None] - u)
    off = np.abs(np.degrees(2 * np.arcsin(np.minimum(apart / 2, 1))) - said)
    camera, mirror = np.unravel_index(off.argmax(), off.shape)
    if off[camera, mirror] > ERROR_DEG:
        raise InputError(
            f"{path}: {_name(int(camera), int(mirror))} has error_deg {said[camera, mirror]:g}, "
            f"but its ball is {off[camera, mirror]:.3g} degrees off that: {REBUILD}"
        )


@dataclass(frozen=True)
class PrototypeRun:
    """A run of s stops, whose balls replace the m mirrors of one of the shell's cameras.

    All in the frame of the object.
    """

    reflector: Reflector  # the shell's camera and mirrors, whose picture is composed
    camera: LensCamera  # that takes the photographs
    # at each stop: centre and radius of the reflecting sphere, centre and radius of the sphere in
    # the seat, mm, (s, k, 8), and then the form of the first, if any has one
    # (tbcad.core.optics.sphere_forms)
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
    place = partial(rotated, axis=plan.frame[0], angle=plan.angle[:, None])
    balls = balls_at_stops(plan, plan.centre, plan.radius, place)
    a, b = (
        prototype_run(reflector, plan, half, camera, balls)
        for half, reflector in enumerate(reflectors)
    )
    return a, b


def turned_balls(balls: Floats, factors: Floats) -> Floats:
    """Balls with or without forms in a frame whose axes are turned by factors (3,) of +-1."""
    spheres = balls[..., :SPHERES] * np.concatenate([factors, [1.0], factors, [1.0]])
    forms = [turned_axes(balls[..., SPHERES:], factors)] if balls.shape[-1] > SPHERES else []
    return np.concatenate([spheres, *forms], axis=-1)


def prototype_run(
    reflector: Reflector, plan: Plan, half: int, camera: LensCamera, balls: Floats
) -> PrototypeRun:
    """One run of a prototype whose camera and balls (s, k, 8) are where they are, in its own frame.

    `half` is 0 for camera a's mirrors, 1 for camera b's, the object turned.
    """
    flip = HALF_TURN if half else np.ones(3)
    balls = turned_balls(balls, flip)
    camera = replace(camera, pinhole=camera.pinhole * flip, axes=camera.axes * flip)
    ball, stop = plan.ball[half], plan.stop[half]
    centre, radius = balls[stop, ball, :3], balls[stop, ball, 3]
    apex = reflection_points(centre, radius, np.zeros(3), camera.pinhole)
    normal = (apex - centre) / radius[:, None]
    window = reflector.mirrors.apex
    if not plan.moved:
        window = rotated(plan.apex[ball], plan.frame[0], plan.angle[stop]) * flip
    # The direction to one apex becomes that to the other, and the plane of incidence of the light
    # from the origin stays one (tbcad.core.optics.windows).
    before = sight_frames(unit(window - reflector.camera.pinhole), reflector.camera.pinhole)
    after = sight_frames(unit(apex - camera.pinhole), camera.pinhole)
    return PrototypeRun(
        reflector=reflector,
        camera=camera,
        balls=balls,
        stop=stop,
        ball=ball,
        ball_surfaces=Surfaces(apex, normal, 1 / radius),
        window_rotation=np.swapaxes(before, 1, 2) @ after,
        parted=plan.parted,
    )


def balls_at_stops(
    plan: Plan,
    centre: Floats,
    radius: Floats,
    place: Callable[[Floats], Floats],
    forms: Floats | None = None,
    normal: Floats | None = None,
) -> Floats:
    """Balls as of `PrototypeRun`, (s, k, 8), from spheres (k, 3), (k,) at base angle zero, mm.

    The plan says how far the sphere in the seat is before the reflecting one, and how much larger;
    `place` moves points of the base (s, k, 3) from angle zero to the stops. Forms there,
    (s, k, FORM_COLUMNS), follow the spheres. Normals of caps (k, 3) are the plan's, or those of
    caps that are tilted.
    """
    shape = (len(plan.angle), len(plan))
    # A ball is its own body; of a cap only the front is flatter or steeper, about its apex.
    growth = np.where(plan.body_radius < plan.radius, radius - plan.radius, 0.0)
    arm = norm(plan.body_centre - plan.centre) + growth
    behind = arm[:, None] * (plan.normal if normal is None else normal)
    front, body = (
        place(np.broadcast_to(points, (*shape, 3))) for points in (centre, centre + behind)
    )
    body_radius = radius - growth + (plan.body_radius - plan.radius)
    radii = [np.broadcast_to(one, shape)[..., None] for one in (radius, body_radius)]
    more = [] if forms is None else [forms]
    return np.concatenate([front, radii[0], body, radii[1], *more], axis=2)


def ball_reflector(run: PrototypeRun) -> SubstitutedReflector:
    """What a light field records of a run: the shell's camera and cells, with balls for mirrors.

    `u` are the directions of the balls: where the virtual cameras really were.
    """
    shell, balls = run.reflector, run.ball_surfaces
    return SubstitutedReflector(shell.camera_id, shell.camera, unit(balls.apex), shell.cells, balls)


def sight_frames(ahead: Floats, pinhole: Floats) -> Floats:
    """Rows: unit directions (m, 3), across the plane of incidence, and in it, (m, 3, 3).

    That of the light from the origin: windows are turned from one such frame into another.
    """
    home = unit(-pinhole)
    along = dot(ahead, np.broadcast_to(home, ahead.shape))
    inward = unit(home - along[:, None] * ahead)
    return np.stack([ahead, np.cross(inward, ahead), inward], axis=1)

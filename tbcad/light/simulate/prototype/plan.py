"""What an export says of its prototype: balls and plan of rotation, checked before use."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tbcad.cad.formats.checked_files import REBUILD, columns
from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import norm
from tbcad.errors import InputError
from tbcad.light.simulate.scene.exported import ROUNDING, ExportedDesign
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.tables import BallRow, PictureRow
from tbcad.types import Floats, Ints

# Of lengths in mm after rounding in a text file.
ROUNDING_MM = 1e-6
APEX, NORMAL = "px py pz", "nx ny nz"
ERROR_DEG = 1e-6
HALF_TURN = np.array([-1.0, -1.0, 1.0])
"""Factors that turn points and vectors by 180 degrees about z."""


@dataclass(frozen=True)
class Plan:
    """Balls on the base at angle zero, and how they stand in for m mirrors of each camera.

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

    def __len__(self) -> int:
        return len(self.radius)

    @property
    def centre(self) -> Floats:
        """Centres of the reflecting spheres, mm, (k, 3)."""
        return self.apex - self.radius[:, None] * self.normal


def read_plan(exported: ExportedDesign) -> Plan:
    """Read balls and plan of a folder that `tbcad build` wrote with a prototype.

    Raises:
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
    _check_pictures(plan_file, pictures, len(balls))
    angle = _angles(plan_file, pictures)
    ball, stop = _served(plan_file, pictures, len(exported.reflectors[0]))
    plan = Plan(
        frame=frame,
        apex=columns(balls, APEX),
        normal=columns(balls, NORMAL),
        radius=columns(balls, "radius_mm")[:, 0],
        body_centre=columns(balls, "bx by bz"),
        body_radius=columns(balls, "body_radius_mm")[:, 0],
        moved=document.picture == "moved",
        angle=np.radians(angle),
        ball=ball,
        stop=stop,
    )
    _check_errors(plan_file, pictures, plan, exported)
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


def _check_pictures(path: Path, pictures: list[PictureRow], balls: int) -> None:
    for row, one in enumerate(pictures, 1):
        if one.object_turn_deg not in (0, 180):
            raise InputError(
                f"{path}: row {row} has object_turn_deg {one.object_turn_deg:g}, allowed is 0 or "
                f"180: {REBUILD}"
            )
        if one.ball > balls:
            raise InputError(
                f"{path}: row {row} names ball {one.ball}, allowed is 1 to {balls}: {REBUILD}"
            )


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


def _served(path: Path, pictures: list[PictureRow], mirrors: int) -> tuple[Ints, Ints]:
    """Ball and stop, from 0, of each mirror of camera a and of camera b, (2, m)."""
    ball_and_stop = np.full((2, 2, mirrors), -1, dtype=np.int64)
    for row, one in enumerate(pictures, 1):
        camera, mirror = int(one.object_turn_deg != 0), int(one.mirror[1:]) - 1
        if one.mirror[0] != "ab"[camera] or not 0 <= mirror < mirrors:
            raise InputError(
                f"{path}: row {row} shows {one.mirror}, allowed with the object turned by "
                f"{one.object_turn_deg:g} degrees is {_name(camera, 0)} to "
                f"{_name(camera, mirrors - 1)}: {REBUILD}"
            )
        if ball_and_stop[0, camera, mirror] >= 0:
            raise InputError(f"{path}: row {row} shows {one.mirror} a second time: {REBUILD}")
        ball_and_stop[:, camera, mirror] = one.ball - 1, one.stop - 1
    missing = np.argwhere(ball_and_stop[0] < 0)
    if missing.size:
        raise InputError(f"{path} does not show mirror {_name(*missing[0].tolist())}: {REBUILD}")
    return ball_and_stop[0], ball_and_stop[1]


def _name(camera: int, mirror: int) -> str:
    return f"{'ab'[camera]}{mirror + 1:04d}"


def _check_errors(
    path: Path, pictures: list[PictureRow], plan: Plan, exported: ExportedDesign
) -> None:
    """The balls must stand where the plan says: as far from each mirror's direction as it says."""
    said = np.zeros(plan.ball.shape)
    for one in pictures:
        said[int(one.object_turn_deg != 0), int(one.mirror[1:]) - 1] = one.error_deg
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

"""What an export says of its prototype: balls and plan of rotation, checked before use."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from tbcad.errors import InputError
from tbcad.geometry.rotations import rotated
from tbcad.geometry.vectors import norm
from tbcad.simulate.scene.exported import AGAIN, ROUNDING, Exported, Number, Record, Vector
from tbcad.types import Floats, Ints

Model = TypeVar("Model")

RECORD, PLAN = "prototype.json", "rotation_plan.csv"
LARGEST_FILE = 100_000_000  # bytes; n = 60 takes 2 million
# Of lengths in mm after rounding in a text file.
ROUNDING_MM = 1e-6
ERROR_DEG = 1e-6
HALF_TURN = np.array([-1.0, -1.0, 1.0])
"""Factors that turn points and vectors by 180 degrees about z."""

Length = Annotated[float, Field(gt=0, le=1e6)]


class _Frame(Record):
    axis: Vector
    zero: Vector
    third: Vector


class _Ball(Record):
    number: int
    radius_mm: Length
    body_radius_mm: Length
    px: Number
    py: Number
    pz: Number
    nx: Number
    ny: Number
    nz: Number
    cx: Number
    cy: Number
    cz: Number
    bx: Number
    by: Number
    bz: Number


class _Document(Record):
    schema_name: Literal["tbcad-prototype/1"] = Field(alias="schema")
    camera: Literal["a"]
    picture: Literal["moved", "fixed"]
    frame: _Frame
    balls: list[_Ball] = Field(min_length=1)


class _Picture(Record):
    object_turn_deg: Number
    stop: int = Field(ge=1, le=1_000_000)
    base_angle_deg: float = Field(ge=-360, le=360)
    ball: int = Field(ge=1)
    mirror: str = Field(pattern=r"^[ab]\d{4,8}$")
    error_deg: Number


@dataclass(frozen=True)
class Plan:
    """Balls on the base at angle zero, and how they stand in for m mirrors of each camera.

    The first row of `ball` and `stop` is for camera a's mirrors, the second for camera b's: they
    are photographed in a second run by the same camera, with the object turned by 180 degrees.

    Attributes:
        frame: rows: the axis that the base turns about, azimuth zero, and the third, (3, 3).
        apex: of the balls, mm, (k, 3).
        normal: inward unit normals there, (k, 3).
        radius: of the reflecting spheres, mm, (k,).
        body_centre: of the spheres in the seats, mm, (k, 3); a ball's own, if no cap.
        body_radius: mm, (k,).
        moved: whether a mirror's window moves along with its ball.
        angle: of the base at each stop, radians, (s,).
        ball: that stands in, from 0, (2, m).
        stop: at which it does, from 0, (2, m).
    """

    frame: Floats
    apex: Floats
    normal: Floats
    radius: Floats
    body_centre: Floats
    body_radius: Floats
    moved: bool
    angle: Floats
    ball: Ints
    stop: Ints

    def __len__(self) -> int:
        """Number of balls."""
        return len(self.radius)

    @property
    def centre(self) -> Floats:
        """Centres of the reflecting spheres, mm, (k, 3)."""
        return self.apex - self.radius[:, None] * self.normal


def read_plan(exported: Exported) -> Plan:
    """Read balls and plan of a folder that `tbcad build` wrote with a prototype.

    Raises:
        InputError: there is none, or what it says cannot be.
    """
    record, table = exported.folder / RECORD, exported.folder / PLAN
    document = _document(record)
    pictures = _pictures(table)
    balls = np.array([[*ball.model_dump().values()] for ball in document.balls])
    _check_balls(record, exported, document, balls)
    _check_pictures(table, pictures, len(balls))
    angle = _angles(table, pictures)
    ball, stop = _served(table, pictures, len(exported.reflectors[0]))
    plan = Plan(
        frame=_frame(document),
        apex=balls[:, 3:6],
        normal=balls[:, 6:9],
        radius=balls[:, 1],
        body_centre=balls[:, 12:15],
        body_radius=balls[:, 2],
        moved=document.picture == "moved",
        angle=np.radians(angle),
        ball=ball,
        stop=stop,
    )
    _check_errors(table, pictures, plan, exported)
    return plan


def _document(path: Path) -> _Document:
    try:
        return _Document.model_validate(json.loads(_text(path)))
    except ValidationError as error:
        raise _refused(path, error) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} cannot be read: {error}: {AGAIN}") from None


def _pictures(path: Path) -> list[_Picture]:
    try:
        rows = list(csv.DictReader(_text(path).splitlines()))
        return TypeAdapter(list[_Picture]).validate_python(rows)
    except ValidationError as error:
        raise _refused(path, error) from None
    except csv.Error as error:
        raise InputError(f"{path} cannot be read: {error}: {AGAIN}") from None


def _text(path: Path) -> str:
    if not path.is_file():
        raise InputError(f"{path} is not there: build the prototype too, tbcad build")
    if path.stat().st_size > LARGEST_FILE:
        raise InputError(f"{path} is over 100 MB, no prototype: {AGAIN}")
    try:
        return path.read_text(encoding="utf-8")
    except (ValueError, OSError) as error:
        raise InputError(f"{path} cannot be read: {error}: {AGAIN}") from None


def _refused(path: Path, error: ValidationError) -> InputError:
    first = error.errors(include_url=False, include_context=False)[0]
    place: list[Any] = [part + 1 if isinstance(part, int) else part for part in first["loc"]]
    where = " ".join(str(part) for part in place)
    return InputError(f"{path}: {where}: {first['msg'].lower()}: {AGAIN}")


def _frame(document: _Document) -> Floats:
    frame = document.frame
    return np.array([frame.axis, frame.zero, frame.third])


def _check_balls(path: Path, exported: Exported, document: _Document, balls: Floats) -> None:
    frame, (a, b) = _frame(document), exported.reflectors
    pinhole = a.camera.pinhole
    away = norm(pinhole) * frame[0] - pinhole
    if np.abs(frame @ frame.T - np.eye(3)).max() > ROUNDING or np.linalg.det(frame) < 0:
        raise InputError(f"{path}: frame is not square and right-handed: {AGAIN}")
    if norm(away) > ROUNDING_MM:
        raise InputError(f"{path}: frame.axis does not point at the pinhole of camera a: {AGAIN}")
    if norm(b.camera.pinhole - HALF_TURN * pinhole) > ROUNDING_MM:
        raise InputError(
            f"{path}: camera b is not where the object turned by 180 degrees about z has camera "
            "a, so one camera cannot take both halves: set y of optics.camera_mm to 0"
        )
    number, radius, normal = balls[:, 0], balls[:, 1], balls[:, 6:9]
    faults = (
        (number != np.arange(1, len(balls) + 1), "is out of order"),
        (np.abs(norm(normal) - 1) > ROUNDING, "has a normal of another length than 1"),
        (
            norm(balls[:, 3:6] - radius[:, None] * normal - balls[:, 9:12]) > ROUNDING_MM,
            "has a centre that is not its radius behind its apex",
        ),
    )
    for wrong, what in faults:
        if wrong.any():
            raise InputError(f"{path}: ball {int(np.argmax(wrong)) + 1} {what}: {AGAIN}")


def _check_pictures(path: Path, pictures: list[_Picture], balls: int) -> None:
    for row, one in enumerate(pictures, 1):
        if one.object_turn_deg not in (0, 180):
            raise InputError(
                f"{path}: row {row} has object_turn_deg {one.object_turn_deg:g}, allowed is 0 or "
                f"180: {AGAIN}"
            )
        if one.ball > balls:
            raise InputError(
                f"{path}: row {row} names ball {one.ball}, allowed is 1 to {balls}: {AGAIN}"
            )


def _angles(path: Path, pictures: list[_Picture]) -> Floats:
    """Base angle at each stop, degrees, (s,)."""
    angles: dict[int, float] = {}
    for one in pictures:
        if angles.setdefault(one.stop, one.base_angle_deg) != one.base_angle_deg:
            raise InputError(f"{path}: stop {one.stop} has two base angles: {AGAIN}")
    stops = sorted(angles)
    if stops != list(range(1, len(stops) + 1)):
        raise InputError(f"{path}: stops are not numbered from 1 without a gap: {AGAIN}")
    angle = np.array([angles[stop] for stop in stops])
    if (np.diff(angle) <= 0).any():
        raise InputError(f"{path}: base angles do not rise from stop to stop: {AGAIN}")
    return angle


def _served(path: Path, pictures: list[_Picture], mirrors: int) -> tuple[Ints, Ints]:
    """Ball and stop, from 0, of each mirror of camera a and of camera b, (2, m)."""
    found = np.full((2, 2, mirrors), -1, dtype=np.int64)
    for row, one in enumerate(pictures, 1):
        half, mirror = int(one.object_turn_deg != 0), int(one.mirror[1:]) - 1
        if one.mirror[0] != "ab"[half] or not 0 <= mirror < mirrors:
            raise InputError(
                f"{path}: row {row} shows {one.mirror}, allowed with the object turned by "
                f"{one.object_turn_deg:g} degrees is {_name(half, 0)} to "
                f"{_name(half, mirrors - 1)}: {AGAIN}"
            )
        if found[0, half, mirror] >= 0:
            raise InputError(f"{path}: row {row} shows {one.mirror} a second time: {AGAIN}")
        found[:, half, mirror] = one.ball - 1, one.stop - 1
    missing = np.argwhere(found[0] < 0)
    if missing.size:
        raise InputError(f"{path} does not show mirror {_name(*missing[0].tolist())}: {AGAIN}")
    return found[0], found[1]


def _name(half: int, mirror: int) -> str:
    return f"{'ab'[half]}{mirror + 1:04d}"


def _check_errors(path: Path, pictures: list[_Picture], plan: Plan, exported: Exported) -> None:
    """The balls must stand where the plan says: as far from each mirror's direction as it says."""
    said = np.zeros(plan.ball.shape)
    for one in pictures:
        said[int(one.object_turn_deg != 0), int(one.mirror[1:]) - 1] = one.error_deg
    u = np.stack([one.u * turn for one, turn in zip(exported.reflectors, _turns(), strict=True)])
    apex = rotated(plan.apex[plan.ball], plan.frame[0], plan.angle[plan.stop])
    apart = norm(apex / norm(apex)[..., None] - u)
    off = np.abs(np.degrees(2 * np.arcsin(np.minimum(apart / 2, 1))) - said)
    half, mirror = np.unravel_index(off.argmax(), off.shape)
    if off[half, mirror] > ERROR_DEG:
        raise InputError(
            f"{path}: {_name(int(half), int(mirror))} has error_deg {said[half, mirror]:g}, but "
            f"its ball stands {off[half, mirror]:.3g} degrees off that: {AGAIN}"
        )


def _turns() -> tuple[Floats, Floats]:
    return np.ones(3), HALF_TURN

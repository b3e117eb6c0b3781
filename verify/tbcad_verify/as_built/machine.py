"""machine.json: camera, axis and balls as a calibration found them, validated strictly."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from tbcad_verify.as_built.forms import TERMS, Fronts
from tbcad_verify.errors import BadExport
from tbcad_verify.record.files import AGAIN, MAX_TEXT_BYTES, open_folder, read
from tbcad_verify.record.validation import Matrix, Strict, Vector, parse_json, validated
from tbcad_verify.types import Floats, Ints

SCHEMA, NAME = "tbcad-machine/1", "machine.json"
CALIBRATE = "write it again with `tbcad calibrate`"
SQUARE = 1e-6  # by which unit vectors and right angles may be off
MOST = 100_000
MAX_SIDE_PX = 65536

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Five = Annotated[list[float], Field(min_length=5, max_length=5)]


class RealCamera(Strict):
    """A camera with a lens that distorts as OpenCV's model says."""

    pinhole: Vector = Field(alias="pinhole_mm")  # (3,) mm
    axes: Matrix  # (3, 3) rows: across the columns, down the rows, forward
    focal: Pair = Field(alias="focal_px")  # pixels, along rows and columns
    principal: Pair = Field(alias="principal_px")  # column and row of the optical axis
    distortion: Five  # k1, k2, p1, p2, k3
    width: int = Field(alias="width_px", ge=1, le=MAX_SIDE_PX)  # columns
    height: int = Field(alias="height_px", ge=1, le=MAX_SIDE_PX)  # rows

    @model_validator(mode="after")
    def _possible(self) -> Self:
        mirrored = float(np.linalg.det(self.axes)) < 0
        if mirrored or np.abs(self.axes @ self.axes.T - np.eye(3)).max() > SQUARE:
            raise ValueError("has axes that are no unit vectors at right angles")
        if min(self.focal) <= 0:
            raise ValueError("has a focal length that is not above 0")
        return self

    def frame_margin(self, d: Floats) -> Floats:
        """(N,) distance of what is seen along d (3, N) from the picture's edge, pixels.

        Negative outside, and without limit behind the camera.
        """
        x, y, z = self.axes @ d
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = x / z, y / z
        k1, k2, p1, p2, k3 = self.distortion
        square = x * x + y * y
        radial = 1 + square * (k1 + square * (k2 + square * k3))
        column = x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x)
        row = y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y
        column = column * self.focal[0] + self.principal[0]
        row = row * self.focal[1] + self.principal[1]
        sides = [column, self.width - 1 - column, row, self.height - 1 - row]
        return np.asarray(np.where(z > 0, np.min(sides, axis=0), -np.inf))


class MeasuredBall(Strict):
    """A reflecting sphere with the base at angle zero."""

    centre: Vector = Field(alias="centre_mm")
    radius: float = Field(alias="radius_mm", gt=0, le=1e4)


class MeasuredForm(Strict):
    """Form error of a cap's front beside its radius, with the base at angle zero."""

    ball: int = Field(ge=1, le=MOST)
    half: float = Field(alias="half_aperture_mm", gt=0, le=1e3)  # radius of the disc, mm
    axes: list[Vector] = Field(min_length=2, max_length=2)  # of x and y, unit
    # astigmatism, coma, trefoil, two each, and spherical aberration, root mean square over the disc
    terms_um: list[Annotated[float, Field(ge=-1000, le=1000)]] = Field(
        min_length=TERMS, max_length=TERMS
    )

    @model_validator(mode="after")
    def _square(self) -> Self:
        axes = np.array(self.axes)
        if np.abs(axes @ axes.T - np.eye(2)).max() > SQUARE:
            raise ValueError("has axes of a form that are no unit vectors at right angles")
        return self


class MachineFrame(Strict):
    """A position of the machine: which of the two runs, and which stop."""

    turn: Literal[0, 180] = Field(alias="object_turn_deg")
    stop: int = Field(ge=1, le=MOST)


class AsBuilt(Strict):
    """The whole machine."""

    camera: RealCamera  # that takes the photographs
    axis: Vector  # (3,) unit, that the base rotates about
    axis_point: Vector = Field(alias="axis_point_mm")  # (3,) mm, of the axis
    # positions in which it was measured
    frames: list[MachineFrame] = Field(min_length=1, max_length=MOST)
    angle_deg: list[float] = Field(max_length=MOST)  # of the base in each
    # of the base in each: rotation vectors about the origin, radians, then shifts, mm; None: none
    turn: list[Vector] | None = Field(None, alias="turn_rad", max_length=MOST)
    shift: list[Vector] | None = Field(None, alias="shift_mm", max_length=MOST)
    # of each ball in each by its weight, in the base's frame, mm
    sag: list[list[Vector]] | None = Field(None, alias="sag_mm", max_length=MOST)
    # of each ball's seat in each, with which its form turns: rotation vectors there, radians
    seat_turn: list[list[Vector]] | None = Field(None, alias="seat_turn_rad", max_length=MOST)
    forms: list[MeasuredForm] | None = Field(None, max_length=MOST)  # of caps; None: spheres
    # reflecting spheres
    balls: list[MeasuredBall] = Field(alias="spheres", min_length=1, max_length=MOST)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if abs(float(np.linalg.norm(self.axis)) - 1) > SQUARE:
            raise ValueError("has an axis of another length than 1")
        of_balls = self.sag, self.seat_turn
        given = [one for one in (self.turn, self.shift, *of_balls) if one is not None]
        if {len(self.angle_deg), *map(len, given)} != {len(self.frames)}:
            raise ValueError("has another number of angles, turns, shifts or sags than of frames")
        if any(len(row) != len(self.balls) for one in of_balls for row in one or ()):
            raise ValueError("has another number of sags or turns than of spheres in a frame")
        formed = [one.ball for one in self.forms or ()]
        if len(set(formed)) != len(formed) or max(formed, default=0) > len(self.balls):
            raise ValueError("has two forms of a ball, or one of a ball that is not there")
        places = [(frame.turn, frame.stop) for frame in self.frames]
        if len(set(places)) != len(places):
            raise ValueError("has a frame twice")
        return self

    @property
    def centre(self) -> Floats:
        """(3, K) of the balls with the base at angle zero, mm."""
        return np.array([ball.centre for ball in self.balls]).T

    @property
    def radius(self) -> Floats:
        """(K,) mm."""
        return np.array([ball.radius for ball in self.balls])

    def frame_of(self, turn: int, stop: Ints) -> Ints:
        """(N,) number of the frame at each stop of a run; -1 where it was not measured."""
        number = {frame.stop: k for k, frame in enumerate(self.frames) if frame.turn == turn}
        return np.array([number.get(one, -1) for one in stop.tolist()], dtype=np.int64)

    def _turn(self, frame: Ints) -> Rotation:
        """Of the base beside its angle in frames (N,)."""
        none = np.zeros((frame.size, 3))
        return Rotation.from_rotvec(none if self.turn is None else np.array(self.turn)[frame])

    def _about_axis(self, frame: Ints) -> Rotation:
        angle = np.radians(np.array(self.angle_deg)[frame])
        return Rotation.from_rotvec(angle[:, None] * self.axis)

    def fronts(self, placed: Floats, ball: Ints, frame: Ints) -> Fronts:
        """Fronts of balls (N,) whose spheres are at (3, N) in frames (N,)."""
        count = len(self.balls)
        half, terms, axes = np.ones(count), np.zeros((TERMS, count)), np.zeros((2, count, 3))
        for one in self.forms or ():
            k = one.ball - 1
            half[k], terms[:, k], axes[:, k] = one.half, np.array(one.terms_um) / 1000, one.axes
        none = np.zeros((frame.size, 3))
        seat = none if self.seat_turn is None else np.array(self.seat_turn)[frame, ball]
        turn = self._turn(frame) * self._about_axis(frame) * Rotation.from_rotvec(seat)
        across = np.stack([turn.apply(way[ball]).T for way in axes])
        return Fronts(placed, self.radius[ball], across, half[ball], terms[:, ball])

    def placed(self, centre: Floats, ball: Ints, frame: Ints) -> Floats:
        """(3, N) where balls (N,), at (3, N) on the base, are in frames (N,), mm."""
        none, point = np.zeros(3), self.axis_point
        sag = none if self.sag is None else np.array(self.sag)[frame, ball]
        placed = point + self._about_axis(frame).apply(centre.T + sag - point)
        placed = self._turn(frame).apply(placed)
        shift = none if self.shift is None else np.array(self.shift)[frame]
        return np.asarray((placed + shift).T)


def read_machine(folder: Path) -> AsBuilt:
    """Read machine.json of a folder that `tbcad calibrate` wrote.

    BadExport: anything missing, malformed, not finite or absurd.
    """
    try:
        value = parse_json(read(open_folder(folder), NAME, MAX_TEXT_BYTES), SCHEMA)
        return validated(NAME, AsBuilt, value)
    except BadExport as error:
        raise BadExport(str(error).replace(AGAIN, CALIBRATE)) from error

"""Sections of prototype.json: frame, seats, parts, LEDs, controller, homing, drive."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from tbcad_verify.record.columns import WIDEST
from tbcad_verify.record.prototype_tables import LARGEST, MOST
from tbcad_verify.record.validation import (
    FileOrNone,
    Matrix,
    Name,
    PartFiles,
    PlainFile,
    Strict,
    Vector,
)
from tbcad_verify.types import Floats

Angle = Annotated[float, Field(ge=-360, le=360)]


class Frame(Strict):
    """Axis of the base, azimuth zero, and the third axis."""

    axis: Vector
    zero: Vector
    third: Vector

    @property
    def rows(self) -> Floats:
        """All three, (3, 3)."""
        return np.stack([self.axis, self.zero, self.third])


class Seat(Strict):
    """The seat of a ball as recorded: where to begin looking for its pads.

    Attributes:
        ball: its number, from 1.
        axis: (3,) unit, away from the light.
        normals: (3, 3) unit, of each pad, toward the ball's centre.
        contacts: (3, 3) mm, the pads' middles.
        pad: diameter of the pads, mm.
    """

    ball: int
    axis: Vector
    normals: Matrix
    contacts: Matrix = Field(alias="contacts_mm")
    pad: float = Field(alias="pad_diameter_mm", ge=1e-3, le=1e3)


class HeldBall(Strict):
    """What holds one ball against its pads, and the force along the seat's axis that it needs.

    Attributes:
        ball: its number, from 1.
        by: what holds it.
        magnet: in its seat, as in the parts list.
        needed: N.
        available: N.
        ratio: of the two.
        wider: force there is with a wider gap, N.
    """

    ball: int
    by: Literal["magnet", "glue"]
    magnet: str | None = Field(max_length=WIDEST)
    needed: float = Field(alias="force_needed_n", ge=0, le=LARGEST)
    available: float = Field(alias="force_available_n", ge=0, le=LARGEST)
    ratio: float = Field(ge=0, le=LARGEST)
    wider: float = Field(alias="wider_gap_n", ge=0, le=LARGEST)


class Holding(Strict):
    """What holds all balls."""

    balls: list[HeldBall] = Field(max_length=MOST)


class PrintedPart(PartFiles):
    """One part to be printed; y = x @ axes + origin lays it on the bed.

    The meshes are on the bed, the STEP file has the solid in its place.

    Attributes:
        role: what it is.
        finish: of its surface; None: any.
        number: of a cap, its ball's, from 1.
        axes: (3, 3).
        origin: (3,) mm.
    """

    role: Literal["base", "cap", "stage", "frame", "tool"]
    finish: str | None = Field(max_length=WIDEST)
    number: int | None = Field(alias="ball")
    axes: Matrix
    origin: Vector = Field(alias="origin_mm")

    @property
    def ball(self) -> int:
        """Of a cap, its ball from 0; else -1."""
        return (self.number or 0) - 1


class Led(Strict):
    """A light-emitting diode of the stage: its position (3,) mm and direction (3,)."""

    name: Name
    position: Vector = Field(alias="position_mm")
    direction: Vector


class Calibration(Strict):
    """What one photograph of each LED tells of the spheres' centres, with known radii.

    Attributes:
        noise_px: standard deviation of a highlight's place.
        leds_seen_min: LEDs that every mirror sees past an object.
        centre_um_median: standard deviation in a centre's least certain direction.
        centre_um_95: the same, of 95 % of the mirrors at most.
        across_um_median: standard deviation across the line of sight.
    """

    noise_px: float = Field(gt=0, le=10)
    leds_seen_min: int = Field(ge=0, le=MOST)
    centre_um_median: float = Field(ge=0, le=LARGEST)
    centre_um_95: float = Field(ge=0, le=LARGEST)
    across_um_median: float = Field(ge=0, le=LARGEST)


class PurchasedBody(Strict):
    """A purchased part, whose shape only the assembly has.

    Attributes:
        name: of its body in the assembly.
        part: name in the parts list; None for what the user has.
        turns: whether with the base.
        finish: of its surface; None: as it is bought.
    """

    name: Name
    part: str | None
    turns: bool
    finish: str | None = Field(max_length=WIDEST)


class Lamp(Strict):
    """A lamp: the middle of its shining face (3,), mm, and the direction (3,) that it faces."""

    name: Name
    position: Vector = Field(alias="position_mm")
    direction: Vector


class Lamps(Strict):
    """What lights the object.

    Attributes:
        strip: name of the LED strip in the parts list.
        strips: side by side on each lamp.
        length: of the strips, mm.
        width: of all strips of a lamp side by side, mm.
        level: whether they lie level, else they are upright.
        places: of all lamps.
        lumen_each: light of one lamp.
    """

    strip: str = Field(max_length=WIDEST)
    strips: int = Field(ge=1, le=MOST)
    length: float = Field(alias="length_mm", gt=0, le=LARGEST)
    width: float = Field(alias="width_mm", gt=0, le=LARGEST)
    level: bool
    places: list[Lamp] = Field(min_length=1, max_length=MOST)
    lumen_each: float = Field(gt=0, le=LARGEST)


class Panel(Strict):
    """A piece of card: its pattern's file, its width and height without flaps, mm."""

    name: Name
    dxf: FileOrNone
    size: Annotated[list[float], Field(alias="size_mm", min_length=2, max_length=2)]


class Shroud(Strict):
    """The box round the rig."""

    sheet: str = Field(max_length=WIDEST)
    sheets: int = Field(ge=1, le=MOST)
    finish: str = Field(max_length=WIDEST)
    panels: list[Panel] = Field(min_length=1, max_length=MOST)


class PlacedFastener(Strict):
    """A screw, washer, nut, insert, dowel, magnet or LED in its place.

    Attributes:
        name: of its body in the assembly.
        part: name in the parts list.
        position: (3,) mm, the point of its axis from which its body goes along; of screws and
            washers on the face that they press on.
        along: (3,) unit.
        through: bodies that it goes through and into, in this order.
        turns: whether with the base.
        finish: of its surface; None: as it is bought.
    """

    name: Name
    part: str = Field(max_length=WIDEST)
    position: Vector = Field(alias="position_mm")
    along: Vector
    through: list[Name] = Field(min_length=1, max_length=9)
    turns: bool
    finish: str | None = Field(max_length=WIDEST)


class AssemblyStep(Strict):
    """A step of assembly.

    Attributes:
        key: its name.
        mounts: names of the bodies and fasteners that it mounts.
    """

    key: Name
    mounts: list[Name] = Field(max_length=MOST)


Amount = Annotated[float, Field(ge=0, le=LARGEST)]


class Drawing(Strict):
    """A drawing: the part that it shows, by its name in the parts list, and what is cut by."""

    part: str = Field(max_length=WIDEST)
    dxf: PlainFile


class Home(Strict):
    """Base angles of homing in degrees, the rod that fixes angle zero, and that angle's error."""

    switch: Angle = Field(alias="switch_deg")
    homed: Angle = Field(alias="homed_deg")
    travel: Annotated[float, Field(alias="travel_deg", ge=0, le=720)]
    pin: str = Field(max_length=WIDEST)
    zero_error: Annotated[float, Field(alias="zero_error_deg", ge=0, le=10)]


class GaugeLengths(Strict):
    """Lengths of the gauge as calipers measure them, mm; from the hub's face or over both sides."""

    hub_to_near: Amount
    hub_to_far: Amount
    near_width: Amount
    far_width: Amount
    hub_to_pinhole: Amount


class MarkPicture(Strict):
    """Where a pair of marks appears, pixels, the base at an angle, degrees."""

    base_angle_deg: Angle
    side: Literal["positive", "negative"]
    column_px: float = Field(ge=-LARGEST, le=LARGEST)
    row_px: float = Field(ge=-LARGEST, le=LARGEST)


class PlaceError(Strict):
    """Standard deviations of the pinhole's place: along the base's axis, across, out, mm."""

    along_mm: Amount
    across_mm: Amount
    out_mm: Amount


class CameraTravel(Strict):
    """How far the mount moves the camera to either side."""

    along_axis_mm: Amount
    across_mm: Amount
    out_mm: Amount
    along_plate_mm: Amount
    yaw_deg: Amount
    roll_deg: Amount
    pitch_deg: Amount


class CameraPlace(Strict):
    """How the camera is put in its place.

    Attributes:
        gauge: name of its part.
        marks: near and far mark of either side, at base angle zero, (2, 2, 3) mm.
        lengths: of the gauge.
        pictures: of the marks.
        error: of the pinhole's place.
        travel: of the mount.
    """

    gauge: Name
    marks: list[list[Vector]] = Field(alias="marks_mm")
    lengths: GaugeLengths = Field(alias="lengths_mm")
    pictures: list[MarkPicture] = Field(min_length=1, max_length=99)
    error: PlaceError
    travel: CameraTravel

    @field_validator("marks")
    @classmethod
    def _pairs(cls, marks: list[list[Floats]]) -> list[list[Floats]]:
        if [len(side) for side in marks] != [2, 2]:
            raise ValueError("marks must be a near and a far one on either side")
        return marks


class DriveRecord(Strict):
    """What the drive must bear and does; balance and torques with the base at angle zero."""

    mass_g: Amount
    centre: Vector = Field(alias="centre_mm")
    moment_g_mm: Amount
    azimuth_deg: Angle
    inertia_g_mm2: Annotated[float, Field(ge=0, le=1e15)]
    worst_torque_nmm: Amount
    peak_torque_nmm: Amount
    required_torque_nmm: Amount
    holding_torque_nmm: Amount
    drive: str
    motor: str
    ratio: Amount
    steps_per_deg: Amount
    motor_wind_up_deg: Angle
    belt_wind_up_deg: Angle
    belt_centre_mm: Amount
    teeth_in_mesh: Amount
    belt_pull_n: Amount
    belt_rating_n: Amount
    belt_tension_n: Amount
    belt_tone_hz: Amount
    motor_radial_n: Amount
    hold_current_a: Amount
    hold_loss_w: Amount
    motor_rise_k: Amount


class PowerOff(Strict):
    """The base without power: its fall to an end of the travel, and what the zero pin bears."""

    fall_energy_j: Amount
    fall_speed_deg_s: Amount
    pin_force_n: Amount
    pin_shear_mpa: Amount
    pin_pressure_mpa: Amount


class Assembly(Strict):
    """Files of the whole; empty: none."""

    step: FileOrNone = ""
    glb: FileOrNone = ""

"""prototype.json and its tables, validated strictly.

A wrong form is refused here; wrong numbers are found by the checks.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from tbcad_verify.errors import BadExport
from tbcad_verify.record.columns import WIDEST
from tbcad_verify.record.files import AGAIN, MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype_tables import (
    LARGEST,
    MOST,
    Balls,
    PartsList,
    Plan,
    PlateHoles,
    Stops,
    Wiring,
)
from tbcad_verify.record.validation import (
    FileOrNone,
    Matrix,
    Name,
    PartFiles,
    Strict,
    Vector,
    parse_json,
    shown,
    validated,
)
from tbcad_verify.types import Floats

SCHEMA = "tbcad-prototype/2"
RECORD = "prototype.json"
PARTS_LIST, PLATE_HOLES, WIRING = "bom.csv", "plate_holes.csv", "wiring.csv"
BALLS, PLAN, STOPS, PROGRAM = "balls.csv", "rotation_plan.csv", "stops.csv", "rotation_plan.nc"
SETTINGS = "grbl_settings.txt"
KLIPPER, KLIPPER_CONFIG = "rotation_plan_klipper.gcode", "klipper.cfg"
OPTIONAL = (PARTS_LIST, PLATE_HOLES, WIRING, KLIPPER, KLIPPER_CONFIG)

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


class Printed(PartFiles):
    """One part to be printed; y = x @ axes + origin lays it on the bed.

    The meshes are on the bed, the STEP file has the solid in its place.

    Attributes:
        role: what it is.
        what: it is for.
        number: of a cap, its ball's, from 1.
        quantity: how many are made.
        axes: (3, 3).
        origin: (3,) mm.
    """

    role: Literal["base", "cap", "stage", "frame", "tool"]
    what: str = Field(max_length=WIDEST)
    number: int | None = Field(alias="ball")
    quantity: int = Field(ge=1, le=MOST)
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


class Bought(Strict):
    """A purchased part, whose shape only the assembly has.

    Attributes:
        name: of its body in the assembly.
        what: description.
        part: name in the parts list; None for what the user has.
        turns: whether with the base.
    """

    name: Name
    what: str
    part: str | None
    turns: bool


class FrameStock(Strict):
    """Parts of the frame that are cut or drilled."""

    plate: str
    upright: str
    uprights_cut_to_mm: float = Field(ge=0, le=LARGEST)


class LightPhase(Strict):
    """One photograph of a stop: its name, and the digital output that is on, if any."""

    name: Name
    output: int | None = Field(ge=0, le=99)


class Controller(Strict):
    """What the controller is, and the photographs of a stop in order."""

    firmware: Literal["grblhal", "grbl"]
    axis: Literal["X", "A"]
    phases: list[LightPhase] = Field(min_length=1, max_length=99)


class Home(Strict):
    """Base angles of homing in degrees, the rod that fixes angle zero, and that angle's error."""

    switch: Angle = Field(alias="switch_deg")
    homed: Angle = Field(alias="homed_deg")
    travel: Annotated[float, Field(alias="travel_deg", ge=0, le=720)]
    pin: str = Field(max_length=WIDEST)
    zero_error: Annotated[float, Field(alias="zero_error_deg", ge=0, le=10)]


Amount = Annotated[float, Field(ge=0, le=LARGEST)]


class DriveRecord(Strict):
    """What the drive must bear and does; balance and torques with the base at angle zero."""

    mass_g: Amount
    centre: Vector = Field(alias="centre_mm")
    moment_g_mm: Amount
    azimuth_deg: Angle
    inertia_g_mm2: Annotated[float, Field(ge=0, le=1e15)]
    worst_torque_nmm: Amount
    safety: Amount
    required_torque_nmm: Amount
    holding_torque_nmm: Amount
    drive: str
    motor: str
    ratio: Amount
    steps_per_deg: Amount
    wind_up_deg: Angle
    belt_pull_n: Amount
    belt_centre_mm: Amount
    counterweight_g: Amount
    counterweight_radius_mm: Amount


class Assembly(Strict):
    """Files of the whole; empty: none."""

    step: FileOrNone = ""
    glb: FileOrNone = ""


class Prototype(Strict):
    """The whole record.

    Attributes:
        camera: id of the camera that it serves.
        target_mm: coverage diameter that is required.
        picture: whether pictures are moved along with their balls when they are merged.
        frame: of the base.
        swing: smallest and largest base angle driven, degrees.
        pad_um: largest error of a ball's centre that its pads may cause.
        seats: one for each ball.
        parts: printed.
        leds: of the stage.
        calibration: by the LEDs; None without any.
        controller: of motion and lights.
        home: angles of homing.
        bought: purchased parts other than balls.
        frame_stock: parts of the frame that are cut or drilled.
        assembly: files of the whole.
        drive: of the base.
        balls: K of them.
        plan: every picture.
        stops: of the base.
        wiring: lines of the controller; None without the file.
        parts_list: what to buy and to print; None without the file.
        plate_holes: of the base plate; None without the file.
        program: text of the controller's program.
        settings: text of the controller's settings.
        klipper: text of the program for Klipper, and
        klipper_config: of its configuration; None without the file.
        digests: file name -> (size, sha256), of what was parsed.
    """

    camera: Name
    target_mm: float = Field(ge=1e-3, le=1e6)
    picture: Literal["moved", "fixed"]
    frame: Frame
    swing: list[Angle] = Field(alias="swing_deg", min_length=2, max_length=2)
    pad_um: float = Field(alias="target_pad_um", ge=1e-3, le=1e4)
    seats: list[Seat] = Field(max_length=MOST)
    parts: list[Printed] = Field(min_length=1, max_length=MOST)
    leds: list[Led] = Field(max_length=MOST)
    calibration: Calibration | None = None
    controller: Controller
    home: Home
    bought: list[Bought] = Field(max_length=MOST)
    frame_stock: FrameStock
    assembly: Assembly = Assembly()
    drive: DriveRecord
    balls: Balls
    plan: Plan
    stops: Stops
    wiring: Wiring | None
    parts_list: PartsList | None
    plate_holes: PlateHoles | None
    program: str
    settings: str
    klipper: str | None
    klipper_config: str | None
    digests: Mapping[str, tuple[int, str]]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.swing[0] > self.swing[1]:
            raise ValueError(f"swing_deg must ascend, not {self.swing}")
        if [seat.ball for seat in self.seats] != list(range(1, len(self.balls) + 1)):
            raise ValueError("seats must be one for each ball, in order")
        for part in self.parts:
            balls = range(1, len(self.balls) + 1) if part.role == "cap" else (None,)
            if part.number not in balls:
                raise ValueError(f"part {part.name}: ball must be a cap's ball or null")
        if len({part.name for part in self.parts}) != len(self.parts):
            raise ValueError("parts must have names of their own")
        if len({part.stl for part in self.parts}) != len(self.parts):
            raise ValueError("parts must each have an STL of their own")
        return self

    @property
    def moved(self) -> bool:
        """Whether pictures are moved along with their balls when they are merged."""
        return self.picture == "moved"


def read_prototype(folder: Path, cameras: Collection[str]) -> Prototype:
    """Read prototype.json and its tables.

    Args:
        folder: the export, resolved.
        cameras: ids that the design has.

    Raises:
        BadExport: anything missing, foreign, malformed, not finite or absurd.
    """
    names = (RECORD, BALLS, PLAN, STOPS, PROGRAM, SETTINGS)
    optional = [name for name in OPTIONAL if (folder / name).exists()]
    texts = {name: read(folder, name, MAX_TEXT_BYTES) for name in (*names, *optional)}
    value = parse_json(texts[RECORD], SCHEMA)
    if value.get("balls") != BALLS:
        raise BadExport(
            f"{RECORD}: balls is {shown(value.get('balls'))}, allowed is {BALLS}; {AGAIN}"
        )
    tables = {
        "balls": Balls.read(texts[BALLS]),
        "plan": Plan.read(texts[PLAN]),
        "stops": Stops.read(texts[STOPS]),
        "parts_list": PartsList.read(texts[PARTS_LIST]) if PARTS_LIST in texts else None,
        "plate_holes": PlateHoles.read(texts[PLATE_HOLES]) if PLATE_HOLES in texts else None,
        "wiring": Wiring.read(texts[WIRING]) if WIRING in texts else None,
        "program": texts[PROGRAM].text(),
        "settings": texts[SETTINGS].text(),
        "klipper": texts[KLIPPER].text() if KLIPPER in texts else None,
        "klipper_config": texts[KLIPPER_CONFIG].text() if KLIPPER_CONFIG in texts else None,
        "digests": {name: blob.digest for name, blob in texts.items()},
    }
    prototype = validated(RECORD, Prototype, value | tables)
    if prototype.camera not in cameras:
        raise BadExport(f"{RECORD}: camera {prototype.camera!r} is not in design.json; {AGAIN}")
    return prototype

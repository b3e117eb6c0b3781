"""prototype.json and its tables, validated strictly, with the fields that are used.

A wrong form is refused here; wrong numbers are found by the checks.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from tbcad_verify.errors import BadExport
from tbcad_verify.record.files import AGAIN, MAX_TEXT_BYTES, read
from tbcad_verify.record.mirrors import WIDEST, Columns, Counts, column, numbers, numbers_or_empty
from tbcad_verify.record.validation import (
    FileOrNone,
    Matrix,
    Name,
    PartFiles,
    PlainFile,
    Strict,
    Vector,
    parse_json,
    shown,
    validated,
)
from tbcad_verify.types import Bools, Floats

SCHEMA = "tbcad-prototype/2"
RECORD, GLB = "prototype.json", "prototype.glb"
PLATE_HOLES, SAG = "plate_holes.csv", "sag.csv"
BALLS, PLAN, STOPS, PROGRAM = "balls.csv", "rotation_plan.csv", "stops.csv", "rotation_plan.nc"
SETTINGS = "grbl_settings.txt"
KLIPPER, KLIPPER_CONFIG = "rotation_plan_klipper.gcode", "klipper.cfg"
OPTIONAL = (PLATE_HOLES, SAG)
# Files of a controller by their fields; no other controller's may lie beside them.
OF_GRBL = {"program": PROGRAM, "settings": SETTINGS}
OF_KLIPPER = {"klipper": KLIPPER, "klipper_config": KLIPPER_CONFIG}
MOST = 1000  # balls, parts or LEDs
MOST_ROWS = 400_000
LARGEST = 1e9

Numbers = Annotated[Floats, numbers(-LARGEST, LARGEST)]
Lengths = Annotated[Floats, numbers(1e-3, 1e4)]
Angles = Annotated[Floats, numbers(-360, 360)]
Masses = Annotated[Floats, numbers_or_empty(0, LARGEST)]
Names = Annotated[NDArray[np.str_], column(Name, np.str_)]
Kinds = Annotated[NDArray[np.str_], column(Literal["ball", "cap"], np.str_)]
GRADE_NAMES = *(f"G{one}" for one in (3, 5, 10, 16, 20, 24, 28, 40, 60, 100, 200)), ""
Grades = Annotated[NDArray[np.str_], column(Literal[GRADE_NAMES], np.str_)]
Angle = Annotated[float, Field(ge=-360, le=360)]


class Balls(Columns):
    """One ball or cap a row, K of them, with the base at angle zero.

    Apices and centres are those under weight, bodies are where the seats have them without.
    """

    most_rows: ClassVar[int] = MOST

    number: Counts
    kind: Kinds
    diameter_mm: Lengths
    grade: Grades  # by ISO 3290-1; empty for caps
    mass_g: Masses
    radius_mm: Lengths
    body_radius_mm: Lengths
    polar_deg: Numbers
    azimuth_deg: Numbers
    px: Numbers
    py: Numbers
    pz: Numbers
    nx: Numbers
    ny: Numbers
    nz: Numbers
    cx: Numbers
    cy: Numbers
    cz: Numbers
    bx: Numbers
    by: Numbers
    bz: Numbers
    sag_x_mm: Numbers
    sag_y_mm: Numbers
    sag_z_mm: Numbers

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if (wrong := np.flatnonzero(self.number != np.arange(1, len(self) + 1))).size:
            raise ValueError(f"ball {wrong[0] + 1} must have number {wrong[0] + 1}")
        return self

    @property
    def cap(self) -> Bools:
        """(K,) true for caps."""
        return np.asarray(self.kind == "cap")

    @property
    def sag(self) -> Floats:
        """(3, K) displacements of the balls by weight, on the mean over their pictures, mm."""
        return self.columns("sag_x_mm", 3)

    def names(self, which: NDArray[np.integer]) -> list[str]:
        """Their name in reports."""
        return [f"ball {k + 1}" for k in which.tolist()]


class PlateHoles(Columns):
    """plate_holes.csv: one tapped hole of the base plate a row."""

    most_rows: ClassVar[int] = MOST

    x_mm: Numbers
    y_mm: Numbers


class Plan(Columns):
    """One mirror's picture a row, N of them; angles in degrees, numbers from 1."""

    most_rows: ClassVar[int] = MOST_ROWS

    order: Counts
    turn: Angles = Field(alias="object_turn_deg")
    stop: Counts
    angle: Angles = Field(alias="base_angle_deg")
    ball: Counts
    mirror: Names


class Stops(Columns):
    """One stop of the base a row, S of them; angles in degrees, numbers from 1."""

    most_rows: ClassVar[int] = MOST_ROWS

    stop: Counts
    angle: Angles = Field(alias="base_angle_deg")


class SagTable(Columns):
    """sag.csv: how weight moves a ball at a stop, by what bends; one pair a row, stop by stop.

    The carrier also turns its seat: a small rotation vector.
    """

    most_rows: ClassVar[int] = MOST_ROWS

    stop: Counts
    ball: Counts
    carrier_x_mm: Numbers
    carrier_y_mm: Numbers
    carrier_z_mm: Numbers
    head_x_mm: Numbers
    head_y_mm: Numbers
    head_z_mm: Numbers
    shaft_x_mm: Numbers
    shaft_y_mm: Numbers
    shaft_z_mm: Numbers
    uprights_x_mm: Numbers
    uprights_y_mm: Numbers
    uprights_z_mm: Numbers
    carrier_turn_x_rad: Numbers
    carrier_turn_y_rad: Numbers
    carrier_turn_z_rad: Numbers

    def moved(self, shape: tuple[int, ...]) -> Floats | None:
        """(5, S, K, 3): mm by carrier, head, shaft and uprights, and the seats' turns, radians.

        None: of others than (S, K, 3).
        """
        pairs = np.indices(shape[:2]).reshape(2, -1) + 1
        if not np.array_equal(pairs, [self.stop, self.ball]):
            return None
        values = [getattr(self, name) for name in list(type(self).model_fields)[2:]]
        return np.stack(values).reshape(5, 3, *shape[:2]).transpose(0, 2, 3, 1)


class Seat(Strict):
    """The seat of a ball as recorded: where to begin looking for its pads."""

    ball: int  # its number, from 1
    axis: Vector  # (3,) unit, away from the light
    normals: Matrix  # (3, 3) unit, of each pad, toward the ball's centre
    contacts: Matrix = Field(alias="contacts_mm")  # (3, 3) mm, the pads' middles
    pad: float = Field(alias="pad_diameter_mm", ge=1e-3, le=1e3)  # diameter of the pads, mm


class PrintedPart(PartFiles):
    """One part to be printed; y = x @ axes + origin lays it on the bed.

    The meshes are on the bed, the STEP file has the solid in its place.
    """

    role: Literal["base", "cap", "stage", "frame", "tool"]  # what it is
    finish: str | None = Field(max_length=WIDEST)  # of its surface; None: any
    number: int | None = Field(alias="ball")  # of a cap, its ball's, from 1
    axes: Matrix  # (3, 3)
    origin: Vector = Field(alias="origin_mm")  # (3,) mm

    @property
    def ball(self) -> int:
        """Of a cap, its ball from 0; else -1."""
        return (self.number or 0) - 1


class Led(Strict):
    """A light-emitting diode of the stage: its position (3,) mm."""

    name: Name
    position: Vector = Field(alias="position_mm")


class PurchasedBody(Strict):
    """A purchased part, whose shape only the assembly has."""

    name: Name  # of its body in the assembly
    part: str | None  # name in the parts list; None for what the user has
    turns: bool  # whether with the base
    finish: str | None = Field(max_length=WIDEST)  # of its surface; None: as it is bought


class Lamp(Strict):
    """A lamp: the middle of its shining face (3,), mm, and the direction (3,) that it faces."""

    name: Name
    position: Vector = Field(alias="position_mm")
    direction: Vector


Ends = Annotated[list[Vector], Field(min_length=2, max_length=2)]


class UpperLed(Strict):
    """An LED above the object: its shining face, and ends of cylinders, (3,), mm."""

    names: Annotated[list[Name], Field(min_length=2, max_length=2)]  # of board and rod
    position: Vector = Field(alias="position_mm")
    direction: Vector
    head: Ends = Field(alias="head_mm")  # round board and what is on it
    # start on the board, elbow and end of its rod
    rod: Annotated[list[Vector], Field(alias="rod_mm", min_length=3, max_length=3)]


class UpperLamps(Strict):
    """LEDs that light what faces up."""

    part: str = Field(max_length=WIDEST)  # name of the LED in the parts list
    leds: list[UpperLed] = Field(min_length=1, max_length=MOST)
    candela: float = Field(alias="candela_each", gt=0, le=LARGEST)
    current_ma: float = Field(gt=0, le=LARGEST)
    head_diameter: float = Field(alias="head_diameter_mm", gt=0, le=LARGEST)
    rod_diameter: float = Field(alias="rod_diameter_mm", gt=0, le=LARGEST)
    tolerance: float = Field(alias="tolerance_mm", ge=0, le=LARGEST)  # that a merge leaves out


class Lamps(Strict):
    """The lamps of the object."""

    strip: str = Field(max_length=WIDEST)  # name of the LED strip in the parts list
    strips: int = Field(ge=1, le=MOST)  # side by side on each lamp
    length: float = Field(alias="length_mm", gt=0, le=LARGEST)  # of the strips, mm
    # of all strips of a lamp side by side, mm
    width: float = Field(alias="width_mm", gt=0, le=LARGEST)
    level: bool  # whether they lie level, else they are upright
    places: list[Lamp] = Field(min_length=1, max_length=MOST)  # of all lamps
    upper: UpperLamps | None = None  # above the object; None without any


class Panel(Strict):
    """A piece of card: its pattern's file, its width and height without flaps, mm."""

    name: Name
    dxf: FileOrNone
    size: Annotated[list[float], Field(alias="size_mm", min_length=2, max_length=2)]


class Shroud(Strict):
    """The box round the rig."""

    sheet: str = Field(max_length=WIDEST)
    finish: str = Field(max_length=WIDEST)
    panels: list[Panel] = Field(min_length=1, max_length=MOST)


class PlacedFastener(Strict):
    """A screw, washer, nut, insert, dowel, magnet or LED in its place."""

    name: Name  # of its body in the assembly
    part: str = Field(max_length=WIDEST)  # name in the parts list
    # (3,) mm, the point of its axis from which its body goes along; of screws and washers on the
    # face that they press on
    position: Vector = Field(alias="position_mm")
    along: Vector  # (3,) unit
    # bodies that it goes through and into, in this order
    through: list[Name] = Field(min_length=1, max_length=9)
    turns: bool  # whether with the base
    finish: str | None = Field(max_length=WIDEST)  # of its surface; None: as it is bought


class AssemblyStep(Strict):
    """A step of assembly."""

    mounts: list[Name] = Field(max_length=MOST)  # names of the bodies and fasteners that it mounts


class Drawing(Strict):
    """Files of a drawing: what is cut by, and what is read."""

    dxf: PlainFile
    pdf: PlainFile


class BoughtDrawing(Drawing):
    """The drawing of a part, by its name in the parts list."""

    part: str = Field(max_length=WIDEST)


class CapDrawing(Drawing):
    """The drawing of a cap, by the number of its ball."""

    ball: int


class Home(Strict):
    """Base angles of homing in degrees, and the rod that fixes angle zero."""

    switch: Angle = Field(alias="switch_deg")
    homed: Angle = Field(alias="homed_deg")
    travel: Annotated[float, Field(alias="travel_deg", ge=0, le=720)]
    pin: str = Field(max_length=WIDEST)
    # by which angle zero may be off, as the play of pin and key allows
    zero_error: Annotated[float, Field(alias="zero_error_deg", ge=0, le=180)]


class MarkPicture(Strict):
    """The pair of marks of a picture, the base at an angle, degrees."""

    base_angle_deg: Angle
    side: Literal["positive", "negative"]


class CameraPlace(Strict):
    """How the camera is put in its place."""

    # near and far mark of either side, at base angle zero, (2, 2, 3) mm
    marks: list[list[Vector]] = Field(alias="marks_mm")
    pictures: list[MarkPicture] = Field(min_length=1, max_length=99)  # of the marks

    @field_validator("marks")
    @classmethod
    def _pairs(cls, marks: list[list[Floats]]) -> list[list[Floats]]:
        if [len(side) for side in marks] != [2, 2]:
            raise ValueError("marks must be a near and a far one on either side")
        return marks


class Assembly(Strict):
    """Files of the whole; empty: none."""

    step: FileOrNone = ""
    glb: FileOrNone = ""


class Controller(Strict):
    """The controller of motion and lights."""

    board: str = Field(max_length=WIDEST)  # name in the parts list


class Prototype(Strict):
    """The whole record."""

    camera: Name  # id of the camera that it serves
    # smallest and largest base angle driven, degrees
    swing: list[Angle] = Field(alias="swing_deg", min_length=2, max_length=2)
    seats: list[Seat] = Field(max_length=MOST)  # one for each ball
    parts: list[PrintedPart] = Field(min_length=1, max_length=MOST)  # printed
    leds: list[Led] = Field(max_length=MOST)  # of the stage
    camera_place: CameraPlace | None = None  # how the camera is put in its place; None without one
    home: Home  # angles of homing
    controller: Controller  # of motion and lights
    # purchased parts other than balls and fasteners
    bought: list[PurchasedBody] = Field(max_length=MOST)
    fasteners: list[PlacedFastener] = Field(max_length=MOST)  # in their places
    assembly_steps: list[AssemblyStep] = Field(max_length=MOST)  # in their order
    lamps: Lamps | None  # that light the object; None without any
    shroud: Shroud | None  # round the rig; None without
    drawings: list[BoughtDrawing] = Field(max_length=MOST)  # of what is cut or drilled
    caps: list[CapDrawing] = Field(max_length=MOST)
    assembly: Assembly = Assembly()  # files of the whole
    balls: Balls  # K of them
    plan: Plan  # every picture
    stops: Stops  # of the base
    sag: SagTable | None  # of the balls at the stops; None without the file
    plate_holes: PlateHoles | None  # of the base plate; None without the file
    program: str = ""  # text of the program of GRBL or grblHAL, and
    settings: str = ""  # of its settings; empty with Klipper
    klipper: str = ""  # text of the program for Klipper, and
    klipper_config: str = ""  # of its configuration; empty with another controller
    digests: Mapping[str, tuple[int, str]]  # file name -> (size, sha256), of what was parsed

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
    def drawn(self) -> list[Drawing]:
        """All drawings."""
        return [*self.drawings, *self.caps]

    @property
    def files(self) -> frozenset[str]:
        """Tables, programs, drawings, and files of the whole."""
        drawings = [name for one in self.drawn for name in (one.dxf, one.pdf)]
        panels = [one.dxf for one in self.shroud.panels] if self.shroud else []
        return frozenset({*self.digests, *drawings, *panels, self.assembly.step, self.assembly.glb})


def read_prototype(folder: Path, cameras: Collection[str], controller: str) -> Prototype:
    """Read prototype.json, its tables, and program and settings of the design's controller.

    `cameras`: ids that the design has.

    BadExport: anything missing, foreign, malformed, not finite or absurd.
    """
    programs, others = OF_GRBL, OF_KLIPPER
    if controller == "klipper":
        programs, others = others, programs
    for name in others.values():
        if os.path.lexists(folder / name):
            raise BadExport(
                f"{name} is not for {controller}, the design's controller: remove it, or build "
                "again for the controller that you have"
            )
    names = (RECORD, BALLS, PLAN, STOPS, *programs.values())
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
        "sag": SagTable.read(texts[SAG]) if SAG in texts else None,
        "plate_holes": PlateHoles.read(texts[PLATE_HOLES]) if PLATE_HOLES in texts else None,
        **{field: texts[name].text() for field, name in programs.items()},
        "digests": {name: blob.digest for name, blob in texts.items()},
    }
    prototype = validated(RECORD, Prototype, value | tables)
    if prototype.camera not in cameras:
        raise BadExport(f"{RECORD}: camera {prototype.camera!r} is not in design.json; {AGAIN}")
    return prototype

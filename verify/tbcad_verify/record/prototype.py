"""prototype.json and its tables, validated strictly.

A wrong form is refused here; wrong numbers are found by the checks.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from tbcad_verify.errors import BadExport
from tbcad_verify.record.files import AGAIN, MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype_sections import (
    MOST,
    Angle,
    Assembly,
    AssemblyStep,
    Balls,
    BoughtDrawing,
    CameraPlace,
    CapDrawing,
    Drawing,
    Home,
    Lamps,
    Led,
    PlacedFastener,
    Plan,
    PlateHoles,
    PrintedPart,
    PurchasedBody,
    SagTable,
    Seat,
    Shroud,
    Stops,
)
from tbcad_verify.record.validation import (
    Name,
    Strict,
    parse_json,
    shown,
    validated,
)

SCHEMA = "tbcad-prototype/2"
RECORD, GLB = "prototype.json", "prototype.glb"
PLATE_HOLES, SAG = "plate_holes.csv", "sag.csv"
BALLS, PLAN, STOPS, PROGRAM = "balls.csv", "rotation_plan.csv", "stops.csv", "rotation_plan.nc"
SETTINGS = "grbl_settings.txt"
KLIPPER, KLIPPER_CONFIG = "rotation_plan_klipper.gcode", "klipper.cfg"
OPTIONAL = (PLATE_HOLES, SAG, KLIPPER, KLIPPER_CONFIG)


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
    program: str  # text of the controller's program
    settings: str  # text of the controller's settings
    klipper: str | None  # text of the program for Klipper, and
    klipper_config: str | None  # of its configuration; None without the file
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


def read_prototype(folder: Path, cameras: Collection[str]) -> Prototype:
    """Read prototype.json and its tables.

    `cameras`: ids that the design has.

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
        "sag": SagTable.read(texts[SAG]) if SAG in texts else None,
        "plate_holes": PlateHoles.read(texts[PLATE_HOLES]) if PLATE_HOLES in texts else None,
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

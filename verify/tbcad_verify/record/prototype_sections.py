"""Sections of prototype.json: frame, seats, parts, LEDs, controller, homing, drive."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from tbcad_verify.record.columns import WIDEST
from tbcad_verify.record.prototype_tables import LARGEST, MOST
from tbcad_verify.record.validation import FileOrNone, Matrix, Name, PartFiles, Strict, Vector
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


class PrintedPart(PartFiles):
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


class PurchasedBody(Strict):
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

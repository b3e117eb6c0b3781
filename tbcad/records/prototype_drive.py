"""Sections of prototype.json on what turns the base, and on the lamp."""

from typing import Annotated, Literal

from pydantic import Field

from tbcad.cad.formats.checked_files import Finite, Vector
from tbcad.core.spec.prototype import Firmware
from tbcad.records.document import RecordSection
from tbcad.records.run import PhaseName


class Phase(RecordSection):
    """A photograph of a stop, and the digital output that switches its light; None: none is on."""

    name: PhaseName
    output: Annotated[int, Field(ge=0, le=99)] | None


class Controller(RecordSection):
    """The controller of motion and lights, its board, and the photographs of a stop in order."""

    firmware: Firmware
    board: str
    axis: Literal["X", "A"]
    phases: tuple[Phase, ...] = Field(min_length=1)


class Home(RecordSection):
    """Base angles of homing, the rod that fixes angle zero, and half the width of its play."""

    switch_deg: Finite
    homed_deg: Finite
    travel_deg: Finite
    pin: str
    zero_error_deg: Finite = Field(ge=0, le=180)


class DriveRecord(RecordSection):
    """Balance of the base, which has no counterweight, and what its drive bears and does.

    Attributes:
        centre_mm: centre of gravity of what turns, in the base's frame at angle zero.
        azimuth_deg: base angle at which gravity turns it most.
        worst_torque_nmm: of gravity.
        peak_torque_nmm: with that of acceleration.
        safety: factor from it to the required one.
        motor_wind_up_deg: angle by which the motor yields under the peak torque.
        hold_margin: factor of the torque at rest; 0 where the drive holds itself.
        motor_rise_k: of its temperature above that of the room.
    """

    mass_g: Finite
    centre_mm: tuple[Finite, Finite, Finite]
    moment_g_mm: Finite
    azimuth_deg: Finite
    inertia_g_mm2: Finite
    worst_torque_nmm: Finite
    peak_torque_nmm: Finite
    safety: Finite
    required_torque_nmm: Finite
    holding_torque_nmm: Finite
    drive: str
    motor: str
    ratio: Finite
    steps_per_deg: Finite
    motor_wind_up_deg: Finite
    belt_wind_up_deg: Finite
    wind_up_limit_deg: Finite
    belt_centre_mm: Finite
    teeth_in_mesh: Finite
    belt_pull_n: Finite
    belt_rating_n: Finite
    belt_tension_n: Finite
    belt_tone_hz: Finite
    motor_radial_n: Finite
    motor_radial_limit_n: Finite
    hold_margin: Finite
    hold_current_a: Finite
    hold_loss_w: Finite
    motor_rise_k: Finite
    motor_rise_limit_k: Finite


class PowerOff(RecordSection):
    """The base without power.

    Attributes:
        brake: part that holds it, none where the drive holds it or its fall is harmless.
        brake_torque_nmm: torque of the brake on the base.
        needed_torque_nmm: that a brake needs: gravity's within the travel, and a margin.
        fall_energy_j: energy that it gets at most, without friction: until the brake engages, or
            on the way to an end of its travel; zero where the drive holds it.
        fall_energy_limit_j: permitted.
        fall_speed_deg_s: its speed then.
        pin_force_n: force on the zero pin under the largest torque of gravity at any angle.
        pin_shear_mpa: shear in the pin.
        pin_shear_limit_mpa: permitted.
        pin_pressure_mpa: pressure of the pin on its hole in the zero disc.
        pin_pressure_limit_mpa: permitted.
    """

    brake: str | None
    brake_torque_nmm: Finite
    needed_torque_nmm: Finite
    fall_energy_j: Finite
    fall_energy_limit_j: Finite
    fall_speed_deg_s: Finite
    pin_force_n: Finite
    pin_shear_mpa: Finite
    pin_shear_limit_mpa: Finite
    pin_pressure_mpa: Finite
    pin_pressure_limit_mpa: Finite


class LampPlace(RecordSection):
    """A lamp: the middle of its shining face, and the direction that it faces."""

    name: str
    position_mm: Vector
    direction: Vector


class UpperLed(RecordSection):
    """An LED above the object: its shining face's middle, and the rod that carries it.

    Attributes:
        names: of its board and its rod.
        direction: that it shines in, a unit vector.
        head_mm: the ends of the cylinder round LED, board and what is glued on it.
        rod_mm: start on the board's back, elbow, and lower end.
    """

    names: tuple[str, str]
    position_mm: Vector
    direction: Vector
    head_mm: tuple[Vector, Vector]
    rod_mm: tuple[Vector, Vector, Vector]


class UpperLampsRecord(RecordSection):
    """What lights surfaces that face up, and what it hides.

    Attributes:
        part: the LED, in the list of parts.
        candela_each: along the direction of each, in its current.
        tolerance_mm: by which boards and rods may be beside their places; a merge leaves out all
            rays that come so near to them.
    """

    part: str
    leds: tuple[UpperLed, ...] = Field(min_length=1, max_length=100)
    candela_each: float = Field(gt=0, le=1e6)
    current_ma: float = Field(gt=0, le=1e6)
    head_diameter_mm: float = Field(gt=0, le=1000)
    rod_diameter_mm: float = Field(gt=0, le=1000)
    tolerance_mm: float = Field(ge=0, le=1000)


class LampsRecord(RecordSection):
    """What lights the object.

    Attributes:
        strip: of LEDs, in the list of parts.
        strips: side by side on each lamp.
        width_mm: of all strips of a lamp side by side.
        level: whether they lie level, else they are upright.
        watt: of all lamps, as is current_ma.
    """

    strip: str
    strips: int
    length_mm: float = Field(gt=0, le=1000)
    width_mm: float = Field(gt=0, le=1000)
    level: bool
    places: tuple[LampPlace, ...] = Field(min_length=1, max_length=100)
    lumen_each: float = Field(gt=0, le=1e6)
    watt: Finite
    current_ma: Finite
    upper: UpperLampsRecord | None = None


class CardPanel(RecordSection):
    """A piece of card: its pattern's file, its width and height without flaps."""

    name: str
    what: str
    dxf: str
    size_mm: tuple[Finite, Finite]


class ShroudRecord(RecordSection):
    """The box of card round the machine."""

    sheet: str
    sheets: int
    finish: str
    panels: tuple[CardPanel, ...]

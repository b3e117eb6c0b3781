"""CSV tables of a build and of a calibration: a model for the rows of each, in millimetres."""

from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field

from tbcad.cad.formats.checked_files import Finite, Record, read_csv
from tbcad.records.design import MISSING
from tbcad.records.prototype import Prototype

MAX_WIND_UP_DEG = 10.0  # far beyond what a build permits

Length = Annotated[float, Field(gt=0, le=1e6)]
MirrorName = Annotated[str, Field(pattern=r"^[ab]\d{4,8}$")]
_empty = BeforeValidator(lambda cell: None if cell == "" else cell)
Text = Annotated[str | None, _empty]
Number = Annotated[Finite | None, _empty]
Radius = Annotated[Annotated[float, Field(gt=0, allow_inf_nan=False)] | None, _empty]


class TableRow(Record):
    """A row of a table, whose columns are the fields of the model, in their order."""

    FILE: ClassVar[str]
    MISSING: ClassVar[str] = Prototype.MISSING

    @classmethod
    def columns(cls) -> tuple[str, ...]:
        """The columns of the table."""
        return tuple(cls.model_fields)

    @classmethod
    def read(cls, folder: Path) -> list[Self]:
        """All rows of the table in a folder. InputError: it is missing, or a row does not fit."""
        return read_csv(folder / cls.FILE, cls, cls.MISSING)


class MirrorRow(TableRow):
    """A mirror; planar ones have neither centre nor radius.

    Attributes:
        ux: direction of its virtual camera, uy and uz too.
        px: its apex.
        nx: inward normal there.
        cx: centre of its sphere.
        size_mm: half width of its cell.
        theta0_deg: half angle of what it shows of the capture sphere, and theta1_deg.
    """

    FILE: ClassVar[str] = "mirrors.csv"
    MISSING: ClassVar[str] = MISSING
    id: str
    camera: Literal["a", "b"]
    ux: Finite
    uy: Finite
    uz: Finite
    px: Finite
    py: Finite
    pz: Finite
    nx: Finite
    ny: Finite
    nz: Finite
    cx: Number
    cy: Number
    cz: Number
    radius_mm: Radius
    size_mm: Finite
    theta0_deg: Number
    theta1_deg: Number
    polar_deg: Finite
    azimuth_deg: Finite
    cell_area_mm2: Finite
    coverage_mm: Finite


SAG = "sag_x_mm sag_y_mm sag_z_mm"


class BallRow(TableRow):
    """A ball or cap with the base at angle zero; a cap has neither grade nor mass.

    Attributes:
        px: apex of the reflecting sphere.
        nx: inward normal there.
        cx: its centre.
        bx: centre of the sphere in the seat as the base is made, which is without weight: by sag
            above where the ball is to be.
        sag_x_mm: displacement of the ball by weight, on the mean over its pictures; apex and
            centre are with it.
        mirrors: that it stands in for.
        coverage_mm: least of them within cells that move with the ball.
        coverage_fixed_mm: within fixed ones.
        error_deg: largest error of direction.
    """

    FILE: ClassVar[str] = "balls.csv"
    number: int
    kind: Literal["ball", "cap"]
    size: str
    diameter_mm: Length
    grade: Text
    standard: Text
    mass_g: Number
    radius_mm: Length
    body_radius_mm: Length
    polar_deg: Finite
    azimuth_deg: Finite
    px: Finite
    py: Finite
    pz: Finite
    nx: Finite
    ny: Finite
    nz: Finite
    cx: Finite
    cy: Finite
    cz: Finite
    bx: Finite
    by: Finite
    bz: Finite
    sag_x_mm: Finite = 0.0
    sag_y_mm: Finite = 0.0
    sag_z_mm: Finite = 0.0
    mirrors: int
    pixels: Finite
    pixels_shell: Finite
    coverage_mm: Finite
    coverage_fixed_mm: Finite
    error_deg: Finite


class PictureRow(TableRow):
    """A mirror's picture: by which ball, at which stop, the object turned or not."""

    FILE: ClassVar[str] = "rotation_plan.csv"
    order: int
    object_turn_deg: Finite
    stop: int = Field(ge=1, le=1_000_000)
    base_angle_deg: float = Field(ge=-360, le=360)
    ball: int = Field(ge=1)
    mirror: MirrorName
    polar_error_deg: Finite
    azimuth_error_deg: Finite
    error_deg: Finite


class StopRow(TableRow):
    """A stop of the base: what it shows, its worst errors, gravity's torque and wind-up."""

    FILE: ClassVar[str] = "stops.csv"
    stop: int = Field(ge=1)
    base_angle_deg: Finite
    mirrors: int
    balls: str
    azimuth_error_deg: Finite
    error_deg: Finite
    torque_nmm: Finite
    wind_up_deg: float = Field(ge=-MAX_WIND_UP_DEG, le=MAX_WIND_UP_DEG)


class SagRow(TableRow):
    """By how much a ball's weight and that of the base move it at a stop, by what bends, mm.

    In the frame of the shell; zero is where the design has it. The carrier also turns each seat
    its own way, as a rotation vector says; the other parts turn the base as a whole.
    """

    FILE: ClassVar[str] = "sag.csv"
    MISSING: ClassVar[str] = (
        'build the prototype again, with prototype.base.drive = "nema17-belt": no list says how '
        "stiff the bearings of other drives are"
    )
    stop: int
    ball: int
    carrier_x_mm: Finite
    carrier_y_mm: Finite
    carrier_z_mm: Finite
    head_x_mm: Finite
    head_y_mm: Finite
    head_z_mm: Finite
    shaft_x_mm: Finite
    shaft_y_mm: Finite
    shaft_z_mm: Finite
    uprights_x_mm: Finite
    uprights_y_mm: Finite
    uprights_z_mm: Finite
    carrier_turn_x_rad: Finite
    carrier_turn_y_rad: Finite
    carrier_turn_z_rad: Finite


class WiringRow(TableRow):
    """A line of the controller.

    Attributes:
        on: command that switches it on; off too.
        pins: of the connector.
        resistor: in series, as in the list of parts.
        path: of the wire, in words.
    """

    FILE: ClassVar[str] = "wiring.csv"
    line: int
    signal: str
    part: str
    output: str
    on: Text
    off: Text
    connector: Text
    pins: Text
    supply_v: Number
    forward_v: Number
    resistor: Text
    resistor_ohm: Number
    current_ma: Number
    dissipation_w: Number
    wire: Text
    length_mm: Number
    path: Text


class RayRow(TableRow):
    """How well a calibration knows the middle ray of a mirror: of its columns those that are read.

    Attributes:
        sigma_mm: standard deviation of its place at the object.
        sigma_mrad: of its direction.
        pixel_mm: width of a pixel there.
    """

    FILE: ClassVar[str] = "rays.csv"
    MISSING: ClassVar[str] = "calibrate again with tbcad calibrate"
    mirror: MirrorName
    sigma_mm: Finite = Field(ge=0)
    sigma_mrad: Finite = Field(ge=0)
    pixel_mm: Finite = Field(gt=0)

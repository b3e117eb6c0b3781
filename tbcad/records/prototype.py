"""prototype.json: all that a build says of its prototype, in millimetres and degrees."""

from typing import ClassVar, Literal

from pydantic import Field

from tbcad.cad.formats.checked_files import Finite, Vector
from tbcad.records.document import Document, RecordSection
from tbcad.records.prototype_drive import (
    Controller,
    DriveRecord,
    Home,
    LampsRecord,
    PowerOff,
    ShroudRecord,
)

NAME = "prototype.json"
MATT_BLACK = "matt black"
Matrix = tuple[Vector, Vector, Vector]


class BaseFrame(RecordSection):
    """The base's axis, toward the camera, azimuth zero, and the third axis."""

    axis: Vector
    zero: Vector
    third: Vector


class Alternative(RecordSection):
    """What a rule to choose the balls costs.

    Attributes:
        pixels: that its balls show.
        pixels_kept_share: of those that the shell shows.
        coverage_mm: least of all mirrors.
        balls_mass_g: of purchased ones.
        caps: their number.
    """

    name: str
    pixels: Finite
    pixels_kept_share: Finite
    coverage_mm: Finite
    mirrors_below_target: int
    balls_mass_g: Finite
    caps: int


class SeatRecord(RecordSection):
    """The seat of a ball.

    Attributes:
        ball: its number, from 1.
        axis: away from the light.
        normals: of its pads, toward the ball's centre.
        contacts_mm: middles of the pads.
    """

    ball: int
    axis: Vector
    normals: Matrix
    contacts_mm: Matrix
    pad_diameter_mm: Finite


class HeldBall(RecordSection):
    """What holds one ball, and the forces along its seat's axis.

    Attributes:
        ball: its number, from 1.
        magnet: in its seat, as in the list of parts.
        wider_gap_n: force that there is with the wider gap.
    """

    ball: int
    by: Literal["magnet", "glue"]
    magnet: str | None
    force_needed_n: Finite
    force_available_n: Finite
    ratio: Finite
    wider_gap_n: Finite


class Holding(RecordSection):
    """What holds all balls, and what the forces assume."""

    min_ratio: Finite
    remanence_t: Finite
    derating: Finite
    glue_mpa: Finite
    wider_gap_mm: Finite
    balls: tuple[HeldBall, ...]


class PrintedPartRecord(RecordSection):
    """A printed part; y = x @ axes + origin_mm lies on the printer's bed.

    Attributes:
        what: it is for.
        step: file of its solid, in its place; of its meshes on the bed: stl and 3mf.
        ball: that a cap stands in for, from 1.
    """

    name: str
    what: str
    step: str
    stl: str
    threemf: str = Field(alias="3mf")
    role: Literal["base", "cap", "stage", "frame", "tool"]
    finish: str | None
    ball: int | None
    quantity: int
    axes: Matrix
    origin_mm: Vector

    @property
    def listed_name(self) -> str:
        """The name that the list of parts has for it."""
        return f"cap {self.ball}" if self.role == "cap" else self.name


class Led(RecordSection):
    """A light-emitting diode of the stage: where its dome is, and where it shines."""

    name: str
    position_mm: Vector
    direction: Vector


class CentreEstimate(RecordSection):
    """What one photograph of each LED tells of the spheres' centres, with known radii.

    Attributes:
        noise_px: standard deviation of a highlight's place.
        leds_seen_min: LEDs that every mirror sees past an object.
        centre_um_median: standard deviation of a centre in its least certain direction.
        centre_um_95: the same, 95th percentile.
        across_um_median: standard deviation across the line of sight.
    """

    noise_px: Finite
    leds_seen_min: int
    centre_um_median: Finite
    centre_um_95: Finite
    across_um_median: Finite


class CapRecord(RecordSection):
    """Key, limits and finish of one cap; diameters of spigot, socket and aperture.

    Of 3/A(B/C) of ISO 10110-5: A power_fringes, B irregularity_fringes, C symmetric_fringes.
    """

    ball: int
    spigot_mm: Finite
    socket_mm: Finite
    spigot_end_mm: Finite
    tilt_deg: Finite
    centre_shift_mm: Finite
    aperture_mm: Finite
    radius_tolerance_mm: Finite
    body_tolerance_mm: Finite
    power_fringes: Finite
    irregularity_fringes: Finite
    symmetric_fringes: Finite
    roughness_rq_nm: Finite
    incidence_deg: Finite
    reflectance_min: Finite
    material: str
    finish: str
    polarity: str
    pdf: str
    dxf: str


class GaugeLengths(RecordSection):
    """Lengths of the gauge as calipers measure them: from the hub's face, or over both sides."""

    hub_to_near: Finite
    hub_to_far: Finite
    near_width: Finite
    far_width: Finite
    hub_to_pinhole: Finite


class MarkPicture(RecordSection):
    """Where a pair of marks of the gauge appears with the base at an angle."""

    base_angle_deg: Finite
    side: Literal["positive", "negative"]
    column_px: Finite
    row_px: Finite


class PlaceError(RecordSection):
    """Standard deviations of the pinhole's place: along the base's axis, across, out."""

    along_mm: Finite
    across_mm: Finite
    out_mm: Finite


class CameraTravel(RecordSection):
    """How far the mount moves the camera to either side."""

    along_axis_mm: Finite
    across_mm: Finite
    out_mm: Finite
    along_plate_mm: Finite
    yaw_deg: Finite
    roll_deg: Finite
    pitch_deg: Finite


class CameraPlace(RecordSection):
    """How the camera is put in its place.

    Attributes:
        gauge: name of its part.
        marks_mm: near and far mark of either side, at base angle zero.
        error: of the pinhole's place.
        travel: of the mount.
    """

    gauge: str
    marks_mm: tuple[tuple[Vector, Vector], tuple[Vector, Vector]]
    lengths_mm: GaugeLengths
    pictures: tuple[MarkPicture, ...]
    error: PlaceError
    travel: CameraTravel


class PurchasedBody(RecordSection):
    """A purchased part that the assembly shows.

    Attributes:
        name: of its body.
        part: name in the list of parts; None for what the user has.
        turns: whether with the base.
        finish: of its surface; None: as it is bought.
    """

    name: str
    what: str
    part: str | None
    turns: bool
    finish: str | None


class FastenerRecord(RecordSection):
    """A screw, washer, nut, insert, dowel, magnet or LED in its place.

    Attributes:
        name: of its body in the assembly.
        part: name in the list of parts.
        position_mm: the point of its axis from which its body goes along; of screws and washers
            on the face that they press on.
        through: bodies that it goes through and into, in this order.
        turns: whether with the base.
        finish: of its surface; None: as it is bought.
    """

    name: str
    part: str
    position_mm: Vector
    along: Vector
    through: tuple[str, ...]
    turns: bool
    finish: str | None


class FrameStock(RecordSection):
    """Parts of the frame that are cut or drilled, as in the list of parts."""

    plate: str
    upright: str
    uprights_cut_to_mm: Finite


class ListTotals(RecordSection):
    """Sums of the list of parts; prices by currency, of parts that have one.

    Attributes:
        mass_g: of all parts, printed ones as solids.
        without_price: kinds of parts that are bought and have none.
        tools_price: of tools, which are no parts.
        parts_printed: parts of the machine that are printed, without tools.
    """

    mass_g: Finite
    bought_price: dict[str, Finite]
    without_price: int
    tools_price: dict[str, Finite]
    parts_printed: int
    filament_g: Finite
    filament_price: dict[str, Finite]
    print_hours: Finite


class DrawingFiles(RecordSection):
    """A drawing: the part that it shows, by its name in the list of parts, and its files."""

    part: str
    pdf: str
    dxf: str


class AssemblyFiles(RecordSection):
    """Files of the whole."""

    step: str
    glb: str


class AssemblyStep(RecordSection):
    """A step of assembly, and the bodies and fasteners that it mounts."""

    key: str
    mounts: tuple[str, ...]


class Prototype(Document):
    """prototype.json.

    Attributes:
        camera: that it serves.
        target_mm: coverage diameter that is required.
        picture: whether pictures are moved along with their balls when they are merged.
        target_pad_um: largest error of a ball's centre that its pads may cause.
        swing_deg: smallest and largest base angle that the program drives to.
        balls: file of their table.
        calibration: by the LEDs; None without any.
        camera_place: None where the gauge or the camera's mount is left out.
        bought: purchased bodies other than balls and fasteners.
        drawings: of what is cut or drilled.
        assembly_steps: in their order.
    """

    MISSING: ClassVar[str] = "build the prototype too, tbcad build"
    schema_name: Literal["tbcad-prototype/2"] = Field("tbcad-prototype/2", alias="schema")
    camera: Literal["a"]
    target_mm: Finite
    picture: Literal["moved", "fixed"]
    target_pad_um: Finite
    frame: BaseFrame
    swing_deg: tuple[Finite, Finite]
    balls: Literal["balls.csv"]
    alternatives: tuple[Alternative, ...]
    seats: tuple[SeatRecord, ...]
    holding: Holding
    parts: tuple[PrintedPartRecord, ...]
    leds: tuple[Led, ...]
    calibration: CentreEstimate | None
    controller: Controller
    caps: tuple[CapRecord, ...]
    camera_place: CameraPlace | None
    home: Home
    bought: tuple[PurchasedBody, ...]
    lamps: LampsRecord | None
    shroud: ShroudRecord | None
    fasteners: tuple[FastenerRecord, ...]
    frame_stock: FrameStock
    totals: ListTotals
    drawings: tuple[DrawingFiles, ...]
    assembly: AssemblyFiles
    drive: DriveRecord
    power_off: PowerOff
    assembly_steps: tuple[AssemblyStep, ...] = ()

    def with_role(self, *roles: str) -> tuple[PrintedPartRecord, ...]:
        """Printed parts that have one of some roles."""
        return tuple(part for part in self.parts if part.role in roles)

    def drawing_of(self, part: str) -> str | None:
        """The drawing of a part of the list, as PDF."""
        return next((one.pdf for one in self.drawings if one.part == part), None)

"""machine.json, a machine as calibrated or simulated; calibration.json, how well it is known."""

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from tbcad.cad.formats.checked_files import Finite, Vector
from tbcad.records.document import Document, RecordSection
from tbcad.records.run import Frame, Geometry

Pair = tuple[Finite, Finite]
Length = Annotated[Finite, Field(gt=0)]


class CalibratedCamera(RecordSection):
    """A camera with its lens.

    Attributes:
        axes: right, down and forward as unit vectors.
        focal_px: across and down, as is principal_px.
        distortion: k1, k2, p1, p2, k3 of OpenCV.
    """

    pinhole_mm: Vector
    axes: tuple[Vector, Vector, Vector]
    focal_px: tuple[Length, Length]
    principal_px: Pair
    distortion: tuple[Finite, Finite, Finite, Finite, Finite]
    width_px: int = Field(ge=16, le=65_536)
    height_px: int = Field(ge=16, le=65_536)


class SphereRecord(RecordSection):
    """A reflecting sphere with the base at angle zero."""

    centre_mm: Vector
    radius_mm: Length


TermsUm = Annotated[tuple[Finite, ...], Field(min_length=7, max_length=7)]


class FormRecord(RecordSection):
    """Form error of a cap's front, besides its radius, with the base at angle zero.

    Attributes:
        ball: of the cap, from 1.
        half_aperture_mm: radius of the disc about the apex.
        axes: two unit vectors across the apex's normal, at right angles; a third is the normal.
        terms_um: Zernike terms over the disc, each its root mean square along the normal:
            astigmatism along and between the axes (45 degrees, 0), coma (second, first axis),
            trefoil (sine, cosine), spherical aberration.
    """

    ball: int = Field(ge=1)
    half_aperture_mm: Length
    axes: tuple[Vector, Vector]
    terms_um: TermsUm


class MachineRecord(Document):
    """machine.json.

    Attributes:
        axis: unit vector of the base's axis, through axis_point_mm.
        frames: in which it is photographed; of each:
        angle_deg: of the base, and
        turn_rad: of the base beside its angle, a rotation vector about the origin, and then
        shift_mm: of the base; None: none.
        sag_mm: of each sphere by its weight, in the base's frame, and
        seat_turn_rad: of its seat there, which turns a cap's form.
        leds_mm: places that the LEDs shine from.
        forms: of the fronts of caps; None: all are spheres.
    """

    MISSING: ClassVar[str] = "name a folder that tbcad calibrate wrote"
    schema_name: Literal["tbcad-machine/1"] = Field("tbcad-machine/1", alias="schema")
    camera: CalibratedCamera
    axis: Vector
    axis_point_mm: Vector
    frames: tuple[Frame, ...] = Field(min_length=1)
    angle_deg: tuple[Finite, ...] = Field(min_length=1)
    spheres: tuple[SphereRecord, ...] = Field(min_length=1)
    leds_mm: tuple[Vector, ...]
    turn_rad: tuple[Vector, ...] | None = None
    shift_mm: tuple[Vector, ...] | None = None
    sag_mm: tuple[tuple[Vector, ...], ...] | None = None
    seat_turn_rad: tuple[tuple[Vector, ...], ...] | None = None
    forms: tuple[FormRecord, ...] | None = None

    @model_validator(mode="after")
    def _of_each_frame(self) -> Self:
        counted = {"angles": self.angle_deg, "turns": self.turn_rad, "shifts": self.shift_mm}
        of_spheres = {"sags": self.sag_mm, "turns of seats": self.seat_turn_rad}
        for what, values in (counted | of_spheres).items():
            if values is not None and len(values) != len(self.frames):
                raise ValueError(f"another number of {what} than frames")
        for what, rows in of_spheres.items():
            if any(len(row) != len(self.spheres) for row in rows or ()):
                raise ValueError(f"another number of {what} than spheres in a frame")
        if any(one.ball > len(self.spheres) for one in self.forms or ()):
            raise ValueError("a form of a sphere that is not there")
        return self


NAME = "calibration.json"


class PhotographCounts(RecordSection):
    """How many photographs the run should have, and how many are usable."""

    expected: int
    usable: int


class ProcessChoice(RecordSection):
    """The process of the priors; `given` where it was asked for, `settings` as KIND=VALUE."""

    name: str
    title: str
    given: bool
    settings: tuple[str, ...]


class RayFigures(RecordSection):
    """How well the rays are known at the object: standard deviations of place and direction.

    Attributes:
        mirrors: with rays.
        mirrors_without_frame: by name.
        place_mm_95: 95th percentile.
        in_run_mm_median: among rays of one run.
        in_design_mm_median: in the design's frame.
        needed_mm_median: half a pixel.
        share_short_of_need: of the rays that are known worse.
    """

    mirrors: int
    mirrors_without_frame: tuple[str, ...]
    place_mm_median: float
    place_mm_95: float
    turn_mrad_median: float
    turn_mrad_95: float
    in_run_mm_median: float
    in_run_mrad_median: float
    in_design_mm_median: float
    in_design_mrad_median: float
    needed_mm_median: float
    share_short_of_need: float


class HighlightFigures(RecordSection):
    """Highlights that the estimate was given and used, and how well they fit."""

    given: int
    used: int
    rejected_by_detection: dict[str, int]
    noise_factor: float
    residual_px: float
    degrees_of_freedom: int


class OutlierRecord(RecordSection):
    """A highlight that does not fit, in standard deviations."""

    photograph: str
    ball: int
    led: int
    sigmas: float


class HalvesRecord(RecordSection):
    """Calibrations of both halves of the data, by the rays of mirrors at the object's centre.

    Attributes:
        apart: what distinguishes the halves, "angles" or "LEDs".
        highlights: of each half.
        found_mm: root mean square distance of both halves' rays.
        expected_mm: likewise, as their covariances say.
    """

    apart: str
    highlights: tuple[int, ...]
    found_mm: float
    expected_mm: float

    @property
    def ratio(self) -> float:
        """Of what is found to what is expected."""
        return self.found_mm / self.expected_mm


class PulledParameter(RecordSection):
    """A parameter that is unlike the process, in its prior's standard deviations."""

    parameter: str
    sigmas: float


class ParameterBlock(RecordSection):
    """Parameters of a kind: medians of their standard deviations before and after; None: fixed."""

    number: int
    free: int
    prior_sigma: float | None
    sigma: float | None


class CalibrationRecord(Document):
    """calibration.json.

    Attributes:
        run: folder, as is exports.
        lens: file of the intrinsics, or "estimated".
        measured_radii: as BALL=MM.
        faults: of photographs, one line each.
        doubts: why it may not be trusted.
        parameters: by the name of their block.
    """

    MISSING: ClassVar[str] = "name a folder that tbcad calibrate wrote"
    schema_name: Literal["tbcad-calibration/1"] = Field("tbcad-calibration/1", alias="schema")
    run: str
    exports: str
    export_sha256: dict[str, str]
    source: Literal["camera", "simulated"]
    geometry: Geometry
    camera: str
    photographs: PhotographCounts
    process: ProcessChoice
    lens: str
    measured_radii: tuple[str, ...]
    verdict: str
    rays: RayFigures
    highlights: HighlightFigures
    outliers: tuple[OutlierRecord, ...]
    halves: tuple[HalvesRecord, ...]
    faults: tuple[str, ...]
    doubts: tuple[str, ...]
    unlike_the_process: tuple[PulledParameter, ...]
    parameters: dict[str, ParameterBlock]

"""The keys of the design that the verification uses, with the allowed range.

A key outside its range is refused: a build never writes one. All others are ignored.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidatorFunctionWrapHandler, WrapValidator

from tbcad_verify.record.validation import Strict

LARGEST_MESH_ERROR_MM = 0.5  # that a spec may ask for and still pass

AUTO: Any = "auto"  # of a key that only a prototype needs, where none was built


def _or_auto(value: object, check: ValidatorFunctionWrapHandler) -> object:
    return value if value == AUTO else check(value)


OR_AUTO = WrapValidator(_or_auto)


def _cap_making(value: object) -> object:
    """Words as they are; true and false of builds from before there were words."""
    return {True: "printed", False: "none"}[value] if isinstance(value, bool) else value


class OpticsSpec(Strict):
    """Where the mirrors, the cameras and the object are."""

    n: int = Field(ge=2, le=60)
    capture_diameter_mm: float = Field(gt=0, le=1000)
    camera_mm: tuple[
        Annotated[float, Field(gt=0, le=10_000)],
        Annotated[float, Field(ge=-10_000, le=10_000)],
        Annotated[float, Field(ge=-10_000, lt=0)],
    ] = Field(strict=False)
    semi_minor_mm: float = Field(ge=1, le=5000)
    # Builds of before this key have no stretch.
    stretch: tuple[Annotated[float, Field(ge=0.5, le=2)], Annotated[float, Field(ge=0.5, le=2)]] = (
        Field((1.0, 1.0), strict=False)
    )


class CameraSpec(Strict):
    """The sensor and lens of both cameras."""

    width_px: int = Field(ge=16, le=32768)
    height_px: int = Field(ge=16, le=32768)
    hfov_deg: float = Field(ge=1, le=170)


class MirrorsSpec(Strict):
    """How the mirrors are curved."""

    radius_rule: Literal["traced", "paper", "flat"]
    margin_mm: float = Field(ge=0, le=20)
    # Builds from before this key have none.
    own_margins_mm: list[Annotated[float, Field(ge=0, le=20)]] = Field(
        default=[], max_length=50_000
    )
    max_radius_widths: float = Field(ge=5, le=1000)
    coating_um: float = Field(ge=0, le=500)


class FlangeSpec(Strict):
    """A flange with its bolt and dowel holes."""

    width_mm: float = Field(ge=4, le=100)
    thickness_mm: float = Field(ge=1, le=50)
    bolt_hole_mm: float = Field(ge=1, le=30)
    bolts: int = Field(ge=2, le=60)
    dowel_hole_mm: float = Field(ge=1, le=30)
    dowels: int = Field(ge=0, le=10)


class ShellLampsSpec(Strict):
    """Rings of LEDs on the lenses of a shell's cameras."""

    leds: Annotated[int, Field(ge=0, le=8), OR_AUTO] = 0
    lens_mm: Annotated[float, Field(ge=20, le=200), OR_AUTO] = 60.0
    front_mm: Annotated[float, Field(ge=-100, le=100), OR_AUTO] = 0.0


class ShellSpec(Strict):
    """The body behind the mirrors."""

    wall_mm: float = Field(ge=0.4, le=50)
    edges: Literal["valley", "pedestal"] = "valley"  # exports from before these keys have none
    groove_mm: float = Field(default=0.1, ge=0.02, le=5)
    negative: bool = False
    seam_flange: FlangeSpec
    foot_flange: FlangeSpec
    # Builds from before this section have no lamps.
    lamps: ShellLampsSpec = ShellLampsSpec()


class MeshSpec(Strict):
    """How fine the STL and 3MF are."""

    chord_error_mm: float = Field(ge=0.0002, le=1)
    structure_error_mm: float = Field(ge=0.002, le=5)

    @property
    def largest_mm(self) -> float:
        """Largest distance from mesh to exact surface, mm."""
        return max(self.chord_error_mm, self.structure_error_mm)


class PrinterSpec(Strict):
    """Printer and material of all printed parts of the prototype but caps."""

    density_g_cm3: float = Field(gt=0, le=20)
    modulus_gpa: float = Field(gt=0, le=300)
    infill: float = Field(ge=0.05, le=1)
    bed_mm: list[Annotated[float, Field(ge=20, le=2000)]] = Field(min_length=3, max_length=3)
    bed_margin_mm: float = Field(ge=0, le=50)


class BaseSpec(Strict):
    """The carrier: what its balls sit on, and what holds them and turns it."""

    pad_offset_mm: float = Field(ge=-0.05, le=0.3)
    hold: Annotated[Literal["magnet", "glue"], OR_AUTO]
    clearance_mm: float = Field(ge=0.1, le=5)
    cap_play_mm: float = Field(ge=0.02, le=0.5)
    magnet_gap_mm: float = Field(ge=0.1, le=5)
    magnet_play_mm: float = Field(ge=0, le=1)
    drive: Literal["nema17-belt", "nema17-direct", "stage-60"]
    insert_hole_mm: float = Field(ge=2, le=10)
    dowel_mm: float = Field(ge=2, le=10)
    dowel_press_mm: float = Field(ge=-0.5, le=1)
    dowel_slip_mm: float = Field(ge=0, le=1)
    coupon_offsets_mm: list[Annotated[float, Field(ge=-1, le=1)]] = Field(
        min_length=1, max_length=9
    )
    coupon_sizes: int = Field(ge=1, le=99)


class MotionSpec(Strict):
    """How the base is driven from stop to stop: motion, trigger and controller."""

    axis: Literal["X", "A"]
    controller: Literal["grblhal", "grbl", "klipper"]
    trigger: Literal["coolant", "pause"]
    home_deg: float = Field(ge=-180, le=180)
    home_trim_deg: float = Field(ge=-5, le=5)
    feed_deg_min: float = Field(ge=1, le=100000)
    acceleration_deg_s2: float = Field(gt=0, le=10000)
    settle_s: float = Field(ge=0, le=60)
    light_s: float = Field(ge=0, le=60)
    trigger_s: float = Field(gt=0, le=60)
    exposure_s: float = Field(ge=0, le=600)
    microsteps: int = Field(ge=1, le=256)
    safety: float = Field(ge=1, le=10)


Place = Annotated[
    list[Annotated[float, Field(ge=-1000, le=1000)]], Field(min_length=3, max_length=3)
]


class StageSpec(Strict):
    """The stage that carries the object, with LEDs at known places for calibration."""

    top_mm: Annotated[float, Field(ge=-1000, le=1000), OR_AUTO]
    object_diameter_mm: Annotated[float, Field(ge=1, le=1000), OR_AUTO]
    led: Literal["LED-3", "LED-5"]
    leds_mm: Annotated[list[Place], OR_AUTO]


class LightSpec(Strict):
    """Lamps that light the object, and a shroud of card."""

    lamp_z_mm: Annotated[float, Field(ge=-1000, le=0), OR_AUTO]
    strips: int = Field(ge=1, le=6)
    segments: int = Field(ge=1, le=6)
    upper: Annotated[bool, OR_AUTO] = False  # which builds before it do not have
    shroud: Annotated[bool, OR_AUTO]
    shroud_gap_mm: float = Field(ge=2, le=500)


class FrameSpec(Strict):
    """The brackets of the camera."""

    flange_mm: float = Field(ge=3, le=30)
    bearing_fit_mm: float = Field(ge=-0.5, le=0.5)
    camera_axis_mm: Annotated[float, Field(ge=5, le=300), OR_AUTO]
    camera_back_mm: Annotated[float, Field(ge=10, le=1000), OR_AUTO]
    camera_screw_mm: Annotated[float, Field(ge=10, le=1000), OR_AUTO]
    camera_travel_mm: float = Field(ge=0, le=200)


class PrototypeSpec(Strict):
    """The prototype: balls that stand in for mirrors, and the base that carries them."""

    k: Annotated[int, Field(ge=1, le=1000), OR_AUTO]
    picture: Literal["moved", "fixed"]
    caps: Annotated[Literal["printed", "turned", "none"], BeforeValidator(_cap_making)]
    max_swing_deg: float = Field(gt=0, le=360)
    ball_wall_mm: Annotated[float, Field(ge=0, le=50), OR_AUTO]
    largest_ball_mm: Annotated[float, Field(gt=0, le=1000), OR_AUTO]
    camera_diameter_mm: Annotated[float, Field(ge=0, le=500), OR_AUTO]
    base: BaseSpec
    motion: MotionSpec
    stage: StageSpec
    light: LightSpec
    frame: FrameSpec

    def left_open(self) -> list[str]:
        """Keys without a value, which only a build without a prototype may have."""
        sections = {
            "": self,
            "base.": self.base,
            "stage.": self.stage,
            "light.": self.light,
            "frame.": self.frame,
        }
        return [
            f"prototype.{name}{key}"
            for name, section in sections.items()
            for key in type(section).model_fields
            if getattr(section, key) == AUTO
        ]


class Spec(Strict):
    """The resolved design."""

    name: str = Field(pattern="^[A-Za-z0-9][A-Za-z0-9 ._-]{0,79}$")
    schema_version: Literal[2] = Field(alias="schema")
    optics: OpticsSpec
    camera: CameraSpec
    mirrors: MirrorsSpec
    shell: ShellSpec
    mesh: MeshSpec
    printer: PrinterSpec
    prototype: PrototypeSpec

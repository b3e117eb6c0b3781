"""The section [prototype] of the design: steel balls on a base that turns."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Field

from tbcad.spec.base_keys import BaseSpec
from tbcad.spec.errors import shown
from tbcad.spec.motion_keys import MotionSpec
from tbcad.spec.section import Section, as_tuple
from tbcad.spec.stage_keys import FrameSpec, StageSpec

MOST_BALLS = 1000

GradeName: TypeAlias = Literal[
    "G3", "G5", "G10", "G16", "G20", "G24", "G28", "G40", "G60", "G100", "G200"
]
Snap: TypeAlias = Literal["cover", "nearest"]
Picture: TypeAlias = Literal["moved", "fixed"]


def _count(value: object) -> object:
    if value == "auto" or (type(value) is int and 1 <= value <= MOST_BALLS):
        return value
    raise ValueError(
        f"{shown(value)} is not allowed: give a whole number from 1 to {MOST_BALLS}, or auto"
    )


def _names(value: object) -> object:
    names = as_tuple(value)
    if isinstance(names, tuple) and names and all(isinstance(name, str) for name in names):
        return names
    raise ValueError(f'{shown(value)} is not allowed: give a list such as ["metric", "my.csv"]')


class PrototypeSpec(Section):
    """The prototype: balls that stand in for mirrors, and the base that carries them."""

    k: Annotated[int | Literal["auto"], BeforeValidator(_count)] = 16
    """Number of balls, or auto: the least that keeps the limits below."""
    radius_weight_deg: float = Field(0.25, ge=0, le=100)
    """What one millimetre of radius counts, in degrees of polar angle, when mirrors are grouped."""
    auto_direction_max_deg: float = Field(3.5, gt=0, le=90)
    """With k auto: largest error of direction of any mirror."""
    auto_direction_median_deg: float = Field(1.5, gt=0, le=90)
    """With k auto: largest median error of direction."""
    auto_lost_percent: float = Field(25.0, ge=0, le=100)
    """With k auto: largest share of the shell's pixels that the balls lose."""
    catalogues: Annotated[tuple[str, ...], BeforeValidator(_names)] = ("metric", "inch")
    """Lists of balls on sale: metric, inch, or CSV files."""
    grade: GradeName = "G40"
    """Grade of the balls by ISO 3290-1; only sizes sold in it are used."""
    largest_ball_mm: float = Field(60.0, gt=0, le=1000)
    """Largest ball to buy, however large the lists go."""
    snap: Snap = "cover"
    """Which stock ball a group gets: the largest that shows all, or the nearest in radius."""
    picture: Picture = "moved"
    """Whether a ball's picture is moved to its mirror's place when pictures are merged."""
    caps: bool = True
    """Give groups beyond the largest ball a made cap of their own radius."""
    cap_rim_mm: float = Field(2.0, ge=0, le=50)
    """Width of the rim round the part of a cap in use."""
    ball_wall_mm: float = Field(3.0, ge=0, le=50)
    """Least distance between two balls, and between a ball and the post or the camera."""
    light_margin_mm: float = Field(0.5, ge=0, le=20)
    """Least distance of a ball from the light of another."""
    post_diameter_mm: float = Field(20.0, ge=0, le=200)
    """Post straight below the object, which no ball may reach; 0: none, the hub is hollow."""
    camera_diameter_mm: float = Field(60.0, ge=0, le=500)
    """Body of the camera behind its pinhole, which no ball may reach; 0: none."""
    camera_length_mm: float = Field(100.0, ge=0, le=1000)
    """Length of that body, from the pinhole back."""
    max_swing_deg: float = Field(300.0, gt=0, le=360)
    """Largest swing of the base that the drive allows."""
    stop_error_deg: float = Field(0.5, gt=0, le=20)
    """Error of direction that a mirror may have from sharing a stop of the base with others."""
    base: BaseSpec = BaseSpec()
    """The printed carrier of the balls."""
    motion: MotionSpec = MotionSpec()
    """How it is driven from stop to stop."""
    stage: StageSpec = StageSpec()
    """What the object stands on."""
    frame: FrameSpec = FrameSpec()
    """What holds stage, base and camera."""

"""The sections [prototype.stage] and [prototype.frame]: what stands still round the base."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Field

from tbcad.spec.errors import shown
from tbcad.spec.section import Section, as_tuple

Led: TypeAlias = Literal["LED-3", "LED-5"]
LEAST_LEDS, MOST_LEDS = 4, 12

_Coordinate: TypeAlias = Annotated[float, Field(ge=-1000, le=1000)]
_Place: TypeAlias = Annotated[
    tuple[_Coordinate, _Coordinate, _Coordinate], BeforeValidator(as_tuple)
]


def _places(value: object) -> object:
    places = as_tuple(value)
    if isinstance(places, tuple) and (not places or LEAST_LEDS <= len(places) <= MOST_LEDS):
        return places
    raise ValueError(
        f"{shown(value)} is not allowed: give {LEAST_LEDS} to {MOST_LEDS} places [x, y, z], "
        "or [] for a stage without"
    )


Places: TypeAlias = Annotated[tuple[_Place, ...], BeforeValidator(_places)]


class StageSpec(Section):
    """What the object stands on, with LEDs at known places to calibrate with."""

    top_mm: float = Field(-20.0, ge=-1000, le=1000)
    """Height of the disc that the object stands on; it must be inside the capture sphere."""
    disc_mm: float = Field(17.0, ge=4, le=500)
    """Diameter of that disc, which is turned by 180 degrees for the other half."""
    led: Led = "LED-3"
    """LEDs in the pockets."""
    leds_mm: Places = (
        (10.6, 7.5, -19.0),
        (3.4, -12.6, -17.0),
        (-3.4, 12.6, -13.5),
        (-10.6, -7.5, -7.0),
    )
    """Middles of the LEDs' domes, not in one plane and none hidden from a mirror; [] for none."""
    led_wall_mm: float = Field(2.0, ge=0.8, le=20)
    """Wall round an LED's pocket."""
    wire_mm: float = Field(2.4, ge=1, le=10)
    """Width of the wires' channels."""
    wall_mm: float = Field(2.7, ge=1, le=20)
    """Wall of the post, best a multiple of the slicer's lines (six of 0.45 mm, else they overfill
    it); less in posts of less than 18 mm."""


class FrameSpec(Section):
    """Base plate, uprights, and brackets for bearings, motor, camera and stage."""

    floor_mm: float = Field(-230.0, ge=-3000, le=-10)
    """Height of the base plate's upper face."""
    clearance_mm: float = Field(3.0, ge=0.5, le=50)
    """Least room of all that stands still to the light and to what the base sweeps."""
    flange_mm: float = Field(8.0, ge=3, le=30)
    """Thickness of the brackets' flanges."""
    web_mm: float = Field(6.0, ge=3, le=30)
    """Thickness of the brackets' webs."""
    uprights_mm: float = Field(80.0, ge=70, le=300)
    """Distance of the two uprights' middles."""
    bearing_fit_mm: float = Field(-0.05, ge=-0.5, le=0.5)
    """How much wider than the bearings their seats are; less than 0: a press fit."""
    belt_travel_mm: float = Field(6.0, ge=0, le=40)
    """Length by which the motor can be moved to tighten the belt, half to either side."""
    camera_screw_mm: float = Field(50.0, ge=10, le=1000)
    """How far behind the pinhole the camera's tripod thread is."""
    camera_travel_mm: float = Field(20.0, ge=0, le=200)
    """Length by which the camera can be moved along its axis, half to either side."""
    post_play_mm: float = Field(0.2, ge=0, le=2)
    """How much wider than the post its clamp is."""

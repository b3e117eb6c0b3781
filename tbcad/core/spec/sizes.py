"""The section [optics] of the design, and lengths of the prototype that follow from it.

Every rule gives the paper's design the sizes it was tried with, and grows or shrinks with the part
of the machine that the length must suit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar

from pydantic import BeforeValidator, Field

from tbcad.core.spec.section import AUTO, Entries, Reason, Section, as_tuple

if TYPE_CHECKING:
    from tbcad.core.spec.prototype import PrototypeSpec

MAX_SEMI_MINOR = 5000.0
Point: TypeAlias = Annotated[
    tuple[
        Annotated[float, Field(gt=0, le=10_000)],
        Annotated[float, Field(ge=-10_000, le=10_000)],
        Annotated[float, Field(ge=-10_000, lt=0)],
    ],
    BeforeValidator(as_tuple),
    Entries(("x", "y", "z")),
]
Stretch: TypeAlias = Annotated[float, Field(ge=0.5, le=2.0)]
# Angle between neighbouring directions, of n: an edge of the icosahedron in n parts.
EDGE_DEG = math.degrees(math.atan(2))
MAX_DIRECTION_DEG, MEDIAN_DIRECTION_DEG = 3.5, 1.5  # of fine designs
MEDIAN_OF_SPACING = 0.43
LARGEST_BALL_MM, BALL_OF_MINOR = 40.0, 0.8  # heavier balls bend the carrier: decision 0044
BALL_WALL_MM, MIN_BALL_WALL_MM, WALL_OF_MINOR = 3.0, 1.2, 0.04
POST_MM, MIN_POST_MM, POST_OF_CAPTURE = 20.0, 8.0, 1 / 3
CAMERA_MM, MIN_CAMERA_MM, CAMERA_OF_DISTANCE = 60.0, 25.0, 0.56
CAMERA_STEP_MM = 5.0
DISC_OF_CAPTURE, MIN_DISC_MM = 17 / 60, 12.0
TOP_OF_CAPTURE = -19 / 60
OBJECT_OF_CAPTURE = 2 / 3
# The crown is this much lower than the disc's face, and stays inside the sphere by the second.
CROWN_MM, INSIDE_MM = 4.8, 0.3
# Places of the LEDs in a capture sphere of 60 mm; smaller spheres have no room for any. Each is the
# other of its pair turned by 180 degrees about z, so that the object's half turn leaves the
# shadows of their arms on it as they were.
LEDS_MM, LEDS_CAPTURE_MM = (
    (
        (23.1, -4.1, -8.0),
        (-23.1, 4.1, -8.0),
        (4.1, 23.1, -2.0),
        (-4.1, -23.1, -2.0),
    ),
    60.0,
)
BELOW_CAMERA_MM, BELOW_BASE_MM, FLOOR_STEP_MM = 30.0, 50.0, 10.0
STEP_MM = 0.1  # that lengths are rounded to

AnySection = TypeVar("AnySection", bound=Section)


class OpticsSpec(Section):
    """Where the mirrors, the cameras and the object are."""

    n: Annotated[int, Reason("at n = 1 no camera sees a mirror whole")] = Field(18, ge=2, le=60)
    """Subdivision of the icosahedron: both halves together have about 5 n^2 mirrors, 1657 at n
    = 18."""
    capture_diameter_mm: float = Field(60.0, gt=0, le=1000)
    """Diameter of the capture sphere, which every virtual camera must see whole. At the paper's
    geometry 60 is the limit: larger, and the object blocks light between mirrors and cameras."""
    camera_mm: Point = (100.0, 0.0, -100.0)
    """Pinhole of camera a; camera b is its mirror image in the plane x = 0. z points up, the
    object is at the origin."""
    semi_minor_mm: float = Field(100.0, ge=1, le=MAX_SEMI_MINOR)
    """Semi-minor axis of both ellipsoids, whose foci are the origin and a pinhole. Larger:
    mirrors farther away."""
    stretch: Annotated[tuple[Stretch, Stretch], BeforeValidator(as_tuple), Entries(("x", "y"))] = (
        1.0,
        1.0,
    )
    """Directions of the virtual cameras, stretched along x and y and brought back to the unit
    sphere; 1 and 1: those of the geodesic polyhedron, as the paper has them. Above 1: more of them
    near the horizon, fewer near the zenith, where mirrors have fewest pixels."""


def with_sizes(prototype: PrototypeSpec, optics: OpticsSpec) -> PrototypeSpec:
    """The section [prototype] with a number for every length in it that was "auto".

    What needs the mirrors or the layout to be chosen stays "auto": the number of balls, the angle
    of the pads, and how balls are held.
    """
    balls = _filled(prototype, _ball_sizes(optics))
    stage = _filled(prototype.stage, _stage_sizes(optics))
    frame = _filled(prototype.frame, {"floor_mm": _floor(optics, balls)})
    return balls.model_copy(update={"stage": stage, "frame": frame})


def _filled(section: AnySection, sizes: dict[str, Any]) -> AnySection:
    """A section with those sizes whose keys are "auto"."""
    return section.model_copy(
        update={key: size for key, size in sizes.items() if getattr(section, key) == AUTO}
    )


def _ball_sizes(optics: OpticsSpec) -> dict[str, float]:
    minor, spacing = optics.semi_minor_mm, EDGE_DEG / optics.n
    camera = CAMERA_STEP_MM * round(CAMERA_OF_DISTANCE * _distance(optics) / CAMERA_STEP_MM)
    return {
        "auto_direction_max_deg": max(_rounded(spacing), MAX_DIRECTION_DEG),
        "auto_direction_median_deg": max(
            _rounded(MEDIAN_OF_SPACING * spacing), MEDIAN_DIRECTION_DEG
        ),
        "largest_ball_mm": min(_rounded(BALL_OF_MINOR * minor), LARGEST_BALL_MM),
        "ball_wall_mm": _within(WALL_OF_MINOR * minor, MIN_BALL_WALL_MM, BALL_WALL_MM),
        "post_diameter_mm": _within(
            POST_OF_CAPTURE * optics.capture_diameter_mm, MIN_POST_MM, POST_MM
        ),
        "camera_diameter_mm": min(max(camera, MIN_CAMERA_MM), CAMERA_MM),
    }


def _stage_sizes(optics: OpticsSpec) -> dict[str, Any]:
    """The disc, as low as the crown below it stays inside the capture sphere, and the LEDs."""
    capture = optics.capture_diameter_mm
    disc = max(_rounded(DISC_OF_CAPTURE * capture), MIN_DISC_MM)
    depth = math.sqrt(max((capture / 2 - INSIDE_MM) ** 2 - (disc / 2) ** 2, 0.0)) - CROWN_MM
    return {
        "disc_mm": disc,
        "top_mm": min(max(_rounded(TOP_OF_CAPTURE * capture), -_rounded(depth)), 0.0),
        "object_diameter_mm": _rounded(OBJECT_OF_CAPTURE * capture),
        "leds_mm": led_places(capture),
    }


def led_places(capture: float) -> tuple[tuple[float, ...], ...]:
    """Places of the LEDs in a capture sphere of a diameter (mm), none in a small one."""
    scale = capture / LEDS_CAPTURE_MM
    places = [tuple(_rounded(scale * x) for x in place) for place in LEDS_MM]
    return tuple(places) if scale >= 1 else ()


def _floor(optics: OpticsSpec, balls: PrototypeSpec) -> float:
    """Height of the base plate: below the camera, and below what the base sweeps."""
    x, _, z = optics.camera_mm
    below_camera = -z + balls.camera_length_mm + BELOW_CAMERA_MM
    reach = (optics.semi_minor_mm + balls.largest_ball_mm) * x / _distance(optics)
    below_base = -z / 2 + reach + BELOW_BASE_MM
    return -FLOOR_STEP_MM * math.ceil(max(below_camera, below_base) / FLOOR_STEP_MM)


def _distance(optics: OpticsSpec) -> float:
    return math.hypot(*optics.camera_mm)


def _within(value: float, low: float, high: float) -> float:
    return min(max(_rounded(value), low), high)


def _rounded(value: float) -> float:
    return round(round(value / STEP_MM) * STEP_MM, 6) + 0.0

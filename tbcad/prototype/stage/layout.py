"""The object stage in numbers: a turning disc on a crown with LED pockets, and a hollow post.

No mirror looks from below the horizon, so all light on its way from the object lies above the
bottom of the capture sphere, or next to it. The crown therefore stays inside the sphere, where it
is part of the scene, and goes through the sphere's bottom as a thin neck; below that there is no
light and the post can be thick. The disc stands as low as LED pockets beside it still fit inside.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import Component
from tbcad.geometry.rotations import rotated_about_x
from tbcad.geometry.vectors import norm
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.keepout import Room, least
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.prototype.stage.crown import (
    DISC_MM,
    INSIDE_MM,
    PLUG_MM,
    RIM_MM,
    SHOULDER_MM,
    UP,
    Sizes,
    crown,
    disc,
    post_tube,
)
from tbcad.prototype.stage.leds import check_leds
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import FrameSpec as FrameKeys
from tbcad.spec.prototype import PrototypeSpec
from tbcad.spec.prototype import StageSpec as StageKeys
from tbcad.types import Floats

NECK_MM = 6.0  # radius where the crown leaves the sphere, at most
FREE = 0.95  # ... and this share of the radius at which light grazes the sphere's bottom
BELOW_MM = 1.5  # the sphere, before the neck widens
# Light may be taken from the sphere's bottom within this: its hulls are up to 2.5 mm too large.
GRAZING_MM = 0.15


@dataclass(frozen=True)
class StageLayout:
    """The object stage; the axis of the post is z through the origin.

    Attributes:
        top: z of the disc's upper face, mm.
        disc: radius of the disc, mm.
        plate: z of the crown's upper face, below the disc, mm.
        joint: z of the post's upper end, mm.
        foot: z of its lower end, mm.
        post: radius of the post, mm.
        wire: radius of the crown's bore for the wires, mm.
        led: of the pockets, from the lists.
        leds: middles of the domes, mm, (l, 3).
        pockets: z of the pockets' floors, mm, (l,).
        items: disc, crown and post, to be printed.
        light: least distance of crown and post to the light outside the capture sphere, mm.
        swept: least distance to what the base sweeps, mm.
    """

    top: float
    disc: float
    plate: float
    joint: float
    foot: float
    post: float
    wire: float
    led: PurchasedPart
    leds: Floats
    pockets: Floats
    items: tuple[Component, ...]
    light: float
    swept: float


def stage(
    spec: tuple[StageKeys, FrameKeys, PrototypeSpec],
    made: PrototypeLayout,
    space: Room,
    parts: Parts,
) -> StageLayout:
    """The stage that fits into the room that balls, base and light leave.

    Args:
        spec: the sections of stage, frame and prototype.
        made: the prototype.
        space: room that is left.
        parts: purchased parts.

    Raises:
        SpecError: when something does not fit; it says what to change.
    """
    keys, frame, own = spec
    post, wire, neck = _sizes(own, _grazed(made, space.capture))
    led, leds = parts[keys.led], np.array(keys.leds_mm).reshape(-1, 3)
    plate = keys.top_mm - DISC_MM
    rim = _rim(keys, space, plate, neck)
    pockets = leds[:, 2] - (led["height_mm"] - led["diameter_mm"] / 2)
    check_leds(keys, made, space, led, pockets, plate)
    joint = -space.capture - BELOW_MM - (post - neck) - SHOULDER_MM
    foot = frame.floor_mm + frame.flange_mm
    if foot > joint - 2 * PLUG_MM:
        raise SpecError(
            f"the post would be too short: make prototype.frame.floor_mm {frame.floor_mm:g} "
            f"less than {joint - 2 * PLUG_MM - frame.flange_mm:.0f}"
        )
    wall = min(keys.wall_mm, 0.3 * post)
    top = crown(keys, led, leds, pockets, Sizes(plate, rim, neck, wire, post, wall, joint))
    items = (disc(keys, leds, plate, wire), top, post_tube(post, wall, joint, foot))
    light, swept = _clear(items, space, frame)
    return StageLayout(
        top=keys.top_mm,
        disc=keys.disc_mm / 2,
        plate=plate,
        joint=joint,
        foot=foot,
        post=post,
        wire=wire,
        led=led,
        leds=leds,
        pockets=pockets,
        items=items,
        light=light,
        swept=swept,
    )


def leds(numbers: StageLayout) -> list[tuple[str, Floats, Floats]]:
    """Name, middle of the dome (mm, (3,)) and unit direction (3,) of each LED."""
    return [(f"led_{i}", place, np.array(UP)) for i, place in enumerate(numbers.leds, 1)]


def _grazed(made: PrototypeLayout, capture: float) -> float:
    """Least distance from z at which light touches the sphere's bottom, mm.

    From a point at distance L and height z light that grazes the sphere comes down by at least
    asin(R / L) + asin(z / L), and touches it R times the sine of that away from the pole.
    """
    stops, mine = made.stops, made.fit.ball
    outline = made.balls.outline[mine]
    turn = (made.placement.azimuth[mine] + stops.angle[stops.stop])[:, None]
    points = rotated_about_x(outline, turn) @ made.half.ellipsoid.frame()
    away = norm(points)
    down = np.arcsin(capture / away) + np.arcsin(points[..., 2] / away)
    return capture * float(np.sin(down.min()))


def _sizes(keys: PrototypeSpec, grazed: float) -> tuple[float, float, float]:
    """Radii of post, wires' bore and neck."""
    post = keys.post_diameter_mm / 2
    if post == 0:
        raise SpecError(
            "an object held through a hollow hub is not made yet, which prototype.post_diameter_mm "
            "0 asks for: light of the hindmost balls crosses the axis there, and the shaft fills "
            "the bore; set prototype.post_diameter_mm to 20"
        )
    if post < 4:
        raise SpecError(
            f"prototype.post_diameter_mm {2 * post:g} leaves no room for the LEDs' wires: make it "
            "8 or more"
        )
    neck = min(NECK_MM, FREE * grazed, 0.65 * post)
    return post, neck / 2, neck


def _rim(keys: StageKeys, space: Room, plate: float, neck: float) -> float:
    """Radius of the crown's rim, where it is RIM_MM thick above the sphere."""
    inside = space.capture - INSIDE_MM
    room = inside**2 - (plate - RIM_MM) ** 2
    rim = float(np.sqrt(max(room, 0)))
    if keys.top_mm > 0 or rim < max(keys.disc_mm / 2, neck + 1) or plate - RIM_MM < -inside:
        need = np.sqrt(max(inside**2 - max(keys.disc_mm / 2, neck + 1) ** 2, 0))
        raise SpecError(
            f"the stage's disc does not fit into the capture sphere: set prototype.stage.top_mm "
            f"from {DISC_MM + RIM_MM - need:.1f} to 0, or make prototype.stage.disc_mm smaller"
        )
    return rim


def _clear(items: tuple[Component, ...], space: Room, frame: FrameKeys) -> tuple[float, float]:
    """Least distances to light outside the sphere and to what the base sweeps.

    Raises:
        SpecError: when one is too small.
    """
    bodies = [body for item in items for body in item.added]
    light, swept = least(space.scene, bodies, -1.0), least(space.swept, bodies)
    if light < -GRAZING_MM:
        raise SpecError(
            f"the stage or its post stands {-light:.1f} mm in the light of the balls: make "
            "prototype.post_diameter_mm smaller, or prototype.stage.top_mm greater"
        )
    if swept < frame.clearance_mm:
        raise SpecError(
            f"the base comes within {swept:.1f} mm of the stage or its post, less than "
            "prototype.frame.clearance_mm: make prototype.post_diameter_mm or prototype.k smaller, "
            "or prototype.ball_wall_mm larger"
        )
    return light, swept

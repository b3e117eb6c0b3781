"""The object stage in numbers: a turning disc on a crown with LED pockets, and a hollow post.

All light on its way from the object lies above the bottom of the capture sphere, or next to it. So
the crown stays inside the sphere, where it is part of the scene, and goes through its bottom as a
thin neck; below that the post can be thick. The disc stands as low as LED pockets still fit inside.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Component
from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec, StageSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.keepout import KeepOut, min_distance
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_part, of_kind
from tbcad.prototype.stage.crown import (
    DISC_MM,
    INSIDE_MM,
    PLUG_MM,
    RIM_MM,
    SCREW_DIRECTION,
    SEAT_MM,
    SHOULDER_MM,
    UP,
    WIRES_MM,
    CrownSizes,
    crown_component,
    disc_component,
    post_component,
)
from tbcad.prototype.stage.leds import check_leds
from tbcad.types import Floats

MAX_NECK_MM = 6.0  # radius of the crown's neck where it leaves the sphere
NECK_SHARE = 0.95  # of the radius at which light grazes the sphere's bottom
NECK_OF_POST = 0.65  # largest share of the post's radius
WALL_MM = 1.3  # of the neck: FDM prints 1.2, three lines of a nozzle of 0.4 mm, and chords cut in
MIN_BORE_MM = 1.0  # radius of a hole that FDM prints
BELOW_MM = 1.5  # length of the neck below the sphere
WIRES_UP_MM = 8.0  # of the wires' hole above the clamp
SHELF_MM = 1.0  # smallest width of the crown's plate beyond the neck
# Light may be taken from the sphere's bottom within this: its hulls are up to 2.5 mm too large.
GRAZING_MM = 0.15
THREAD_MM = 3.0
BEYOND_POST_MM = 0.5  # that the set screw may stand out of the post


@dataclass(frozen=True)
class StageLayout:
    """The object stage; the axis of the post is z through the origin."""

    sizes: CrownSizes  # of crown and post
    foot: float  # z of the post's lower end, mm
    led: PurchasedPart  # of the pockets, from the lists
    leds: Floats  # centres of the domes, mm, (l, 3)
    components: tuple[Component, ...]  # disc and crown, to be printed
    post: Component  # a tube
    clamp: PurchasedPart  # that holds the post on the plate
    light: float  # smallest distance of all to the light outside the capture sphere, mm
    swept: float  # smallest distance to what the base sweeps, mm


def stage_layout(
    spec: PrototypeSpec, prototype: PrototypeLayout, keep_out: KeepOut, parts: Parts
) -> StageLayout:
    """The stage in the space that balls, base and light leave free; SpecError if there is none."""
    stage = spec.stage
    widest = _widest_tube(spec, parts)
    post = widest["outer_mm"] / 2
    led, leds = parts[stage.led], np.array(stage.leds_mm).reshape(-1, 3)
    neck = min(
        MAX_NECK_MM,
        NECK_SHARE * _grazing_radius(prototype, keep_out.capture),
        NECK_OF_POST * post,
    )
    wire = bore_radius(neck, len(leds) > 0)
    plate = stage.top_mm - DISC_MM
    pockets = leds[:, 2] - (led["height_mm"] - led["diameter_mm"] / 2)
    joint = -keep_out.capture - BELOW_MM - (post - neck) - SHOULDER_MM
    sizes = CrownSizes(
        plate=plate,
        rim=_rim(stage, keep_out.capture, plate, neck),
        neck=neck,
        wire=wire,
        post=post,
        wall=widest["wall_mm"],
        joint=joint,
    )
    check_leds(stage, prototype, keep_out.capture, led, pockets, plate)
    key, hint = "prototype.post_diameter_mm", "make it smaller, or add one to the list"
    clamp = choose_part(parts, "clamps", key, hint, bore_mm=2 * post)
    foot = _foot(spec, joint, clamp)
    hint = "make prototype.frame.floor_mm greater, or add a longer one"
    key, long = "prototype.frame.floor_mm", joint - foot
    tube = choose_part(parts, "tubes", key, hint, outer_mm=2 * post, length_mm=long)
    components = (
        disc_component(stage, leds, sizes),
        crown_component(stage, led, leds, pockets, sizes),
    )
    column = post_component(sizes, tube, foot, foot + wires_up(clamp))
    light, swept = _check_clearances((*components, column), keep_out, spec.frame.clearance_mm)
    return StageLayout(sizes, foot, led, leds, components, column, clamp, light, swept)


def bore_radius(neck: float, wired: bool) -> float:
    """Radius of the wires' bore in a neck of a radius, mm, 0 without wires.

    SpecError: light leaves too little room for a neck whose walls can be printed.
    """
    bore = min(neck / 2, neck - WALL_MM) if wired else 0.0
    least = WALL_MM + MIN_BORE_MM if wired else WALL_MM / 2
    if neck < least:
        raise SpecError(
            f"light of the balls leaves a neck of {max(2 * neck, 0):.1f} mm diameter under the "
            f"object, and one that can be printed has {2 * least:.1f}: make prototype.k another, "
            "or optics.capture_diameter_mm or prototype.post_diameter_mm larger"
        )
    return bore


def wires_up(clamp: PurchasedPart) -> float:
    """Height of the wires' hole above the post's lower end, mm."""
    return clamp["height_mm"] + WIRES_UP_MM


def led_poses(stage: StageLayout) -> list[tuple[str, Floats, Floats]]:
    """Name, centre of the dome (mm, (3,)) and unit direction (3,) of each LED."""
    return [(f"led_{i}", centre, UP) for i, centre in enumerate(stage.leds, 1)]


def _grazing_radius(prototype: PrototypeLayout, capture: float) -> float:
    """Smallest distance from z at which light touches the sphere's bottom, mm.

    From a point at distance L and height z light that grazes the sphere comes down by at least
    asin(R / L) + asin(z / L), and touches it R times the sine of that away from the pole.
    """
    stops, ball = prototype.stops, prototype.fit.ball
    azimuth = (prototype.placement.azimuth[ball] + stops.angle[stops.stop])[:, None]
    outline = rotated_about_x(prototype.balls.outline[ball], azimuth)
    points = outline @ prototype.array.ellipsoid.frame()
    distance = norm(points)
    descent = np.arcsin(capture / distance) + np.arcsin(points[..., 2] / distance)
    return capture * float(np.sin(descent.min()))


def _widest_tube(spec: PrototypeSpec, parts: Parts) -> PurchasedPart:
    """The widest tube that is no wider than the post may be."""
    widest = float(spec.post_diameter_mm)
    if widest == 0:
        raise SpecError(
            "an object held through a hollow hub is not supported, which "
            "prototype.post_diameter_mm 0 asks for: light of the hindmost balls crosses the axis "
            "there, and the shaft fills the bore; set prototype.post_diameter_mm to 20"
        )
    tubes = of_kind(parts, "tubes")
    fitting = [one for one in tubes if one["outer_mm"] <= widest]
    if not fitting:
        least = min(one["outer_mm"] for one in tubes)
        raise SpecError(
            f"prototype.post_diameter_mm {widest:g} is less than the narrowest tube: make it "
            f"{least:g} or more"
        )
    return max(fitting, key=lambda one: one["outer_mm"])


def _rim(stage: StageSpec, capture: float, plate: float, neck: float) -> float:
    """Radius of the crown's rim, where it is RIM_MM thick above the sphere."""
    inside, min_rim = capture - INSIDE_MM, max(stage.disc_mm / 2, neck + SHELF_MM)
    bottom = plate - RIM_MM
    rim = float(np.sqrt(max(inside**2 - bottom**2, 0)))
    if stage.top_mm > 0 or rim < min_rim or bottom < -inside:
        depth = np.sqrt(max(inside**2 - min_rim**2, 0))
        raise SpecError(
            f"the stage's disc does not fit into the capture sphere: set prototype.stage.top_mm "
            f"from {DISC_MM + RIM_MM - depth:.1f} to 0, or make prototype.stage.disc_mm smaller"
        )
    return rim


def _foot(spec: PrototypeSpec, joint: float, clamp: PurchasedPart) -> float:
    """Height of the post's lower end, on the plate, mm."""
    foot, min_length = float(spec.frame.floor_mm), wires_up(clamp) + WIRES_MM + PLUG_MM
    if foot > joint - min_length:
        raise SpecError(
            f"the post would be too short: make prototype.frame.floor_mm {foot:g} "
            f"less than {joint - min_length:.0f}"
        )
    return foot


def _check_clearances(
    components: tuple[Component, ...], keep_out: KeepOut, clearance: float
) -> tuple[float, float]:
    """Smallest distances to light outside the sphere and to what the base sweeps."""
    bodies = [body for component in components for body in component.added]
    light = min_distance(keep_out.to_light_outside_sphere, bodies, -1.0)
    swept = min_distance(keep_out.to_swept, bodies)
    if light < -GRAZING_MM:
        raise SpecError(
            f"the stage or its post is {-light:.1f} mm inside the light of the balls: make "
            "prototype.post_diameter_mm smaller, or prototype.stage.top_mm greater"
        )
    if swept < clearance:
        raise SpecError(
            f"the base comes within {swept:.1f} mm of the stage or its post, less than "
            "prototype.frame.clearance_mm: make prototype.post_diameter_mm or prototype.k smaller, "
            "or prototype.ball_wall_mm larger"
        )
    return light, swept


def stage_fasteners(stage: StageLayout, parts: Parts) -> Iterator[Fastener]:
    """The plug's set screw through the post, and the LEDs in their pockets."""
    screw, tip = _set_screw(stage.sizes, parts), stage.sizes.plug - SEAT_MM
    height = np.array([0.0, 0.0, stage.sizes.joint - PLUG_MM / 2])
    place = (tip + screw["length_mm"]) * SCREW_DIRECTION + height
    yield Fastener(screw, place, -SCREW_DIRECTION, ("stage_post", "stage_crown"))
    below = stage.led["height_mm"] - stage.led["diameter_mm"] / 2
    for dome in stage.leds:
        yield Fastener(stage.led, dome - below * UP, UP, ("stage_crown",))


def _set_screw(sizes: CrownSizes, parts: Parts) -> PurchasedPart:
    """The longest set screw that does not stand out of the post; else the shortest."""
    room = sizes.post - (sizes.plug - SEAT_MM) + BEYOND_POST_MM
    screws = sorted(
        of_kind(parts, "setscrews", thread_mm=THREAD_MM), key=lambda one: one["length_mm"]
    )
    fitting = [screw for screw in screws if screw["length_mm"] <= room]
    return fitting[-1] if fitting else screws[0]

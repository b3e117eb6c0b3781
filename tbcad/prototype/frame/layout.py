"""The frame: base plate, two uprights with the bearing head, and all brackets.

Head, uprights and feet are behind the base, where neither its swing nor any light comes.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import Component, Cylinder, box
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.hub import BELOW_HEAD_MM, ZERO_DISC_MM
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.drive.travel import home_angles
from tbcad.prototype.frame.brackets import (
    EXTRUSION_MM,
    TAPPED_M5_MM,
    Bracket,
    choose_part,
    choose_screw,
    drilled_holes,
    frame_axes,
)
from tbcad.prototype.frame.feet import camera_bracket, stage_foot, upright_foot
from tbcad.prototype.frame.head import BearingHead, bearing_head
from tbcad.prototype.frame.purchased import PLATE_MM
from tbcad.prototype.homing.layout import (
    PILOT_DEPTH_MM,
    SWITCH_MM,
    HomingLayout,
    homing_layout,
)
from tbcad.prototype.homing.sizes import BRACKET_MM
from tbcad.prototype.keepout import KeepOut, min_distance
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, of_kind
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import FrameSpec, PrototypeSpec
from tbcad.types import Floats

PLATE_BORDER_MM = 10.0  # of the plate beyond the brackets' feet
ENGAGEMENT_MM = 4.0  # smallest length of a screw beyond what it holds
MOTOR_THREAD_MM = 3.0  # length of a screw in the motor
UPRIGHT_SCREWS = 4 + 2 * 2  # of the head, and of two feet
FOOT_INSERT, FOOT_SCREW_MM = "INSERT-M4", (4.0, 20.0)  # of the stage's clamp: thread, length
CAMERA_SCREW = "UNC1/4-20x12.7"
BRACKET_INSERT = "INSERT-M3"
HUB_SCREWS = 4
COUPLING_FLANGE_MM = 3.0  # thickness; no list gives it
M6_ENGAGEMENT_MM = 6.0
PLATE_WASHER = "WASHER-5"
TNUT, POST_SCREW = "TNUT-M5-6", "SET-M3x6"
MAY_BE_LIT = ("camera",)  # light goes into it
MAY_BE_SWEPT = ("rotary_stage",)  # the hub is bolted on it
HEAD_PARTS = ("bearing_front", "bearing_rear", "collar", "shaft")


@dataclass(frozen=True)
class FrameLayout:
    """The frame, in the frame of the shell.

    Attributes:
        axes: of the frame, as rows: level under the axis w, across it, up, (3, 3).
        head: bearings and motor.
        homing: zero disc, and switch with its bracket.
        printed: brackets to print.
        purchased: simple bodies of purchased parts, for the assembly.
        holes: tapped M5 holes of the base plate, (x, y) along the frame's axes, mm, (h, 2).
        holds: bracket that each hole holds.
        corner: the plate's, from where its holes are measured, (x, y) as the holes, mm, (2,).
        plate: part of the base plate.
        upright: part that the uprights are cut from.
        length: of the uprights, mm.
        screws: quantity of screws and nuts, by name.
        light: smallest distance of each to the light in use, mm.
        swept: smallest distance of each to what the base sweeps, mm.
    """

    axes: Floats
    head: BearingHead
    homing: HomingLayout
    printed: tuple[Component, ...]
    purchased: tuple[Component, ...]
    holes: Floats
    holds: tuple[str, ...]
    corner: Floats
    plate: PurchasedPart
    upright: PurchasedPart
    length: float
    screws: Counter[str]
    light: dict[str, float]
    swept: dict[str, float]


def frame_layout(
    spec: PrototypeSpec,
    prototype: PrototypeLayout,
    base: BaseLayout,
    stage: StageLayout,
    drive: Drive,
    keep_out: KeepOut,
    parts: Parts,
) -> FrameLayout:
    """The frame round a base and a stage.

    Args:
        spec: of the prototype.
        prototype: balls, their places and stops.
        base: that turns.
        stage: that carries the object.
        drive: chosen for the base.
        keep_out: what the frame must keep out of.
        parts: purchased parts.

    Raises:
        SpecError: when something does not fit; it says what to change.
    """
    axes = frame_axes(base.frame[0])
    head = bearing_head(spec.frame, base, drive, axes, parts)
    homing = homing_layout(base, head.plate, home_angles(prototype, spec.motion), parts)
    brackets = _brackets(spec, prototype, axes, stage, head, parts)
    upright, length, bars = _uprights(spec.frame, axes, head, parts)
    plate, plate_body, corner = _plate(spec.frame, axes, brackets, parts)
    purchased = (plate_body, *bars, *head.purchased, homing.switch, *_camera(spec, prototype))
    printed = (head.component, homing.bracket, *(bracket.component for bracket in brackets))
    light, swept = _check_clearances((*printed, *purchased), keep_out, spec.frame.clearance_mm)
    return FrameLayout(
        axes=axes,
        head=head,
        homing=homing,
        printed=printed,
        purchased=purchased,
        holes=np.vstack([bracket.holes for bracket in brackets]),
        holds=tuple(bracket.component.name for bracket in brackets for _ in bracket.holes),
        corner=corner,
        plate=plate,
        upright=upright,
        length=length,
        screws=_screws(spec, drive, brackets, parts) + _homing_parts(drive, homing, parts),
        light=light,
        swept=swept,
    )


def frame_purchased_parts(frame: FrameLayout) -> dict[str, int]:
    """Quantity of purchased parts of stage and frame by name, without the drive and the LEDs."""
    in_head = [item.part for item in frame.purchased if item.name in HEAD_PARTS and item.part]
    counts = Counter(in_head) + Counter(frame.screws)
    counts.update({frame.plate.name: 1, frame.upright.name: 2, POST_SCREW: 1})
    return dict(sorted(counts.items()))


def _brackets(
    spec: PrototypeSpec,
    prototype: PrototypeLayout,
    axes: Floats,
    stage: StageLayout,
    head: BearingHead,
    parts: Parts,
) -> list[Bracket]:
    brackets = [upright_foot(spec.frame, axes, head.face, side) for side in (1, -1)]
    brackets.append(stage_foot(spec.frame, axes, stage, parts[FOOT_INSERT]))
    if spec.camera_diameter_mm > 0:
        brackets.append(camera_bracket(spec, axes, prototype.array.camera))
    return brackets


def _uprights(
    spec: FrameSpec, axes: Floats, head: BearingHead, parts: Parts
) -> tuple[PurchasedPart, float, list[Component]]:
    """Part and length of the uprights, and their bodies."""
    length = head.top - spec.floor_mm
    hint = "make prototype.frame.floor_mm greater, or add a longer one"
    part = choose_part(parts, "extrusions", "prototype.frame.floor_mm", hint, length_mm=length)
    half, uprights = EXTRUSION_MM / 2, []
    for name, sign in (("upright_left", 1), ("upright_right", -1)):
        y = sign * spec.uprights_mm / 2
        low = np.array([head.face - EXTRUSION_MM, y - half, spec.floor_mm])
        body = box(low, np.array([head.face, y + half, head.top]), axes)
        what = f"{part.what}, cut to {length:.1f} mm"
        uprights.append(Component(name, what, (body,), part=part.name))
    return part, length, uprights


def _plate(
    spec: FrameSpec, axes: Floats, brackets: list[Bracket], parts: Parts
) -> tuple[PurchasedPart, Component, Floats]:
    """The smallest plate under all feet, centred under them, with tapped holes; its corner."""
    feet = np.vstack([bracket.foot for bracket in brackets])
    low, high = feet.min(axis=0) - PLATE_BORDER_MM, feet.max(axis=0) + PLATE_BORDER_MM
    middle, (length, width) = (low + high) / 2, high - low
    candidates = [
        part
        for part in of_kind(parts, "plates")
        if part["length_mm"] >= length and part["width_mm"] >= width
    ]
    if not candidates:
        raise SpecError(
            f"no base plate in plates.csv is {length:.0f} x {width:.0f} mm: add one, or make "
            "prototype.camera_diameter_mm smaller"
        )
    part = min(candidates, key=lambda plate: plate["length_mm"] * plate["width_mm"])
    half = np.array([part["length_mm"], part["width_mm"]]) / 2
    bottom = spec.floor_mm - part["thickness_mm"]
    corners = np.array([*(middle - half), bottom]), np.array([*(middle + half), spec.floor_mm])
    places = [np.array([*hole, bottom]) @ axes for bracket in brackets for hole in bracket.holes]
    holes = drilled_holes(places, part["thickness_mm"] * axes[2], TAPPED_M5_MM)
    body = Component("plate", part.what, (box(*corners, axes),), tuple(holes), part=part.name)
    return part, body, middle - half


def _camera(spec: PrototypeSpec, prototype: PrototypeLayout) -> list[Component]:
    if spec.camera_diameter_mm == 0:
        return []
    camera, radius = prototype.array.camera, spec.camera_diameter_mm / 2
    body = Cylinder(camera.pinhole, -camera.forward, radius, spec.camera_length_mm)
    return [Component("camera", "camera behind its pinhole", (body,))]


def _screws(
    spec: PrototypeSpec, drive: Drive, brackets: list[Bracket], parts: Parts
) -> Counter[str]:
    """Screws and nuts: on the uprights with T-nuts, in the plate, of motor, clamp and camera."""
    flange, in_plate = spec.frame.flange_mm, sum(len(bracket.holes) for bracket in brackets)
    counts = Counter({TNUT: UPRIGHT_SCREWS, FOOT_INSERT: 1, choose_screw(parts, *FOOT_SCREW_MM): 1})
    counts[choose_screw(parts, 5.0, flange + ENGAGEMENT_MM)] += UPRIGHT_SCREWS
    counts[choose_screw(parts, 5.0, flange + 2 * ENGAGEMENT_MM)] += in_plate
    counts[PLATE_WASHER] += in_plate  # some of their holes are slots
    if drive.motor.kind == "motors":
        counts[choose_screw(parts, 3.0, PLATE_MM + MOTOR_THREAD_MM)] += 4
    else:
        counts[choose_screw(parts, 6.0, PLATE_MM + 2 * MOTOR_THREAD_MM)] += 4
    if spec.camera_diameter_mm > 0:
        counts[CAMERA_SCREW] += 1
    return counts


def _homing_parts(drive: Drive, homing: HomingLayout, parts: Parts) -> Counter[str]:
    """Pin, switch and its screws, and the screws that hold drive and zero disc to the hub."""
    counts = Counter({homing.pin: 1, str(homing.switch.part): 1, BRACKET_INSERT: 2})
    counts[choose_screw(parts, 2.0, SWITCH_MM + PILOT_DEPTH_MM / 2)] += 2
    counts[choose_screw(parts, 3.0, BRACKET_MM + ENGAGEMENT_MM)] += 2
    if drive.motor.kind == "motors":
        on_hub = drive.wheel["width_mm"] if drive.wheel else COUPLING_FLANGE_MM
        counts[choose_screw(parts, 3.0, on_hub + ZERO_DISC_MM + ENGAGEMENT_MM)] += HUB_SCREWS
    else:
        length = BELOW_HEAD_MM + ZERO_DISC_MM + M6_ENGAGEMENT_MM
        counts[choose_screw(parts, 6.0, length)] += HUB_SCREWS
    return counts


def _check_clearances(
    components: tuple[Component, ...], keep_out: KeepOut, clearance: float
) -> tuple[dict[str, float], dict[str, float]]:
    """Smallest distances of all static parts to light and to what the base sweeps."""
    static = {component.name: component.added for component in components if not component.rotates}
    light, swept = (
        {name: min_distance(to, bodies) for name, bodies in static.items() if name not in exempt}
        for to, exempt in ((keep_out.to_light, MAY_BE_LIT), (keep_out.to_swept, MAY_BE_SWEPT))
    )
    obstacles = ("light of the balls", "balls and base as they swing")
    for obstacle, distances in zip(obstacles, (light, swept), strict=True):
        name, distance = min(distances.items(), key=lambda item: item[1])
        if distance < clearance:
            raise SpecError(
                f"{name.replace('_', ' ')}: {distance:.1f} mm from the {obstacle}, less than "
                f"prototype.frame.clearance_mm {clearance:g}: make {_remedy(name)}"
            )
    return light, swept


def _remedy(name: str) -> str:
    """What to change so that a part has more clearance."""
    if name.startswith("camera"):
        return "prototype.frame.camera_screw_mm larger or prototype.camera_diameter_mm smaller"
    if name in ("plate", "stage_foot"):
        return "prototype.frame.floor_mm less"
    if name in ("motor", "pinion"):
        return (
            "prototype.largest_ball_mm smaller, or use a drive with a longer belt or a direct one"
        )
    return "prototype.frame.uprights_mm or prototype.largest_ball_mm smaller"

"""The frame: base plate, two uprights with the bearing head, and all brackets.

Head, uprights and feet are behind the base, where neither its swing nor any light comes.
"""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Component, Cylinder, Primitive, box
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import FrameSpec, PrototypeSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.balance import home_angles
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.camera_mount import CameraMount, camera_mount
from tbcad.prototype.frame.feet import stage_foot, upright_foot
from tbcad.prototype.frame.head import BearingHead, bearing_head
from tbcad.prototype.frame.purchased import (
    EXTRUSION_MM,
    TAPPED_M5_MM,
    THROUGH_MM,
    Bracket,
    drilled_holes,
    frame_axes,
    plate_fasteners,
)
from tbcad.prototype.homing import HomingLayout, homing_layout
from tbcad.prototype.keepout import KeepOut, min_distance
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.light.lamps import lamp_layout
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_part, of_kind
from tbcad.prototype.stage.layout import StageLayout
from tbcad.types import Floats

SLOT_DEPTH_MM = 6.1  # of an extrusion of 20 mm; no list gives it
PLATE_BORDER_MM = 10.0  # of the plate beyond the brackets' feet
MAY_BE_LIT = ("camera",)  # light goes into it
HEAD_PARTS = ("bearing_front", "bearing_rear", "collar", "shaft")


@dataclass(frozen=True)
class FrameLayout:
    """The frame, in the frame of the shell."""

    axes: Floats  # of the frame, as rows: level under the axis w, across it, up, (3, 3)
    head: BearingHead  # bearings and motor
    homing: HomingLayout  # zero disc, and switch with its bracket
    mount: CameraMount | None  # of the camera; None without one
    lamps: LampLayout | None  # that light the object, None without any
    printed: tuple[Component, ...]  # brackets to print
    purchased: tuple[Component, ...]  # simple bodies of purchased parts, for the assembly
    holes: Floats  # tapped M5 holes of the base plate, (x, y) along the frame's axes, mm, (h, 2)
    holds: tuple[str, ...]  # bracket that each hole holds
    corner: Floats  # the plate's, from where its holes are measured, (x, y) as the holes, mm, (2,)
    plate: PurchasedPart  # part of the base plate
    upright: PurchasedPart  # part that the uprights are cut from
    length: float  # of the uprights, mm
    fasteners: tuple[Fastener, ...]  # of the frame, without those that hold the drive to the hub
    light: dict[str, float]  # smallest distance of each to the light in use, mm
    swept: dict[str, float]  # smallest distance of each to what the base sweeps, mm

    @property
    def floor(self) -> float:
        """Height (z) of the base plate's upper face, which the uprights stand on, mm."""
        return self.head.top - self.length


def frame_layout(
    spec: PrototypeSpec,
    prototype: PrototypeLayout,
    base: BaseLayout,
    stage: StageLayout,
    drive: Drive,
    keep_out: KeepOut,
    parts: Parts,
) -> FrameLayout:
    """The frame round a base and a stage; SpecError names what to change where it does not fit."""
    axes = frame_axes(base.frame[0])
    head = bearing_head(spec.frame, base, drive, axes, parts)
    homing = homing_layout(base, head.plate, home_angles(prototype, spec.motion), parts)
    camera, view = [], prototype.array.camera
    if spec.camera_diameter_mm:
        size = spec.camera_diameter_mm / 2, spec.camera_length_mm
        body = Cylinder(view.pinhole, -view.forward, *size)
        camera = [Component("camera", "camera behind its pinhole", (body,))]
    mount = camera_mount(spec, axes, view, parts) if camera else None
    brackets = [upright_foot(spec.frame, axes, head.face, side, parts) for side in (1, -1)]
    brackets += [stage_foot(spec.frame, axes, stage, parts), *([mount.bracket] if mount else ())]
    of_camera = (mount.plate, mount.fence) if mount else ()
    bought = (*head.purchased, homing.switch, *camera)
    beside = (head.component, homing.bracket, *(one.component for one in brackets), *of_camera)
    lamps = lamp_layout(spec, head.face, view, keep_out, parts, (*beside, *bought))
    brackets += lamps.stands if lamps else ()
    upright, length, bars = _uprights(spec.frame, axes, head, parts)
    plate, plate_body, corner = _plate(spec.frame, axes, brackets, parts)
    purchased = (plate_body, *bars, *bought, *(lamps.bodies if lamps else ()))
    printed = (
        *(head.component, homing.bracket, *(bracket.component for bracket in brackets)),
        *of_camera,
        *(lamps.holders if lamps else ()),
    )
    light, swept = _check_clearances((*printed, *purchased), keep_out, spec.frame.clearance_mm)
    return FrameLayout(
        axes=axes,
        head=head,
        homing=homing,
        mount=mount,
        lamps=lamps,
        printed=printed,
        purchased=purchased,
        holes=np.vstack([bracket.holes for bracket in brackets]),
        holds=tuple(bracket.component.name for bracket in brackets for _ in bracket.holes),
        corner=corner,
        plate=plate,
        upright=upright,
        length=length,
        fasteners=(
            *head.fasteners,
            *(one for bracket in brackets for one in bracket.fasteners),
            *plate_fasteners(spec.frame, brackets, axes, parts),
            *homing.fasteners,
            *(mount.fasteners if mount else ()),
            *(lamps.fasteners if lamps else ()),
        ),
        light=light,
        swept=swept,
    )


def frame_purchased_parts(frame: FrameLayout) -> dict[str, int]:
    """Quantity of purchased parts of the frame by name, without the drive and fasteners."""
    in_head = [item.part for item in frame.purchased if item.name in HEAD_PARTS and item.part]
    counts = Counter(in_head)
    counts.update({frame.plate.name: 1, frame.upright.name: 2})
    if frame.lamps:
        counts[frame.lamps.strip.name] = math.ceil(frame.lamps.metres)
    counts.update([frame.homing.pin, str(frame.homing.switch.part)])
    return dict(sorted(counts.items()))


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
        slots = _slots(part["slot_mm"], (head.face - half, y), (spec.floor_mm, head.top), axes)
        uprights.append(Component(name, what, (body,), slots, part=part.name))
    return part, length, uprights


def _slots(
    width: float, middle: tuple[float, float], heights: tuple[float, float], axes: Floats
) -> tuple[Primitive, ...]:
    """The four slots of an extrusion, simplified: as wide inside as at its face."""
    half, inner, outer = width / 2, EXTRUSION_MM / 2 - SLOT_DEPTH_MM, EXTRUSION_MM / 2 + THROUGH_MM
    low, high = (np.array([*middle, z]) for z in (heights[0] - THROUGH_MM, heights[1] + THROUGH_MM))
    ends = ((inner, outer), (-outer, -inner))
    sides = [((a, -half, 0.0), (b, half, 0.0)) for a, b in ends]
    sides += [((-half, a, 0.0), (half, b, 0.0)) for a, b in ends]
    return tuple(box(low + one, high + other, axes) for one, other in sides)


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


def _check_clearances(
    components: tuple[Component, ...], keep_out: KeepOut, clearance: float
) -> tuple[dict[str, float], dict[str, float]]:
    """Smallest distances of all static parts to light and to what the base sweeps."""
    static = {component.name: component.added for component in components if not component.rotates}
    light = {
        name: min_distance(keep_out.to_light, bodies)
        for name, bodies in static.items()
        if name not in MAY_BE_LIT
    }
    swept = {name: min_distance(keep_out.to_swept, bodies) for name, bodies in static.items()}
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

"""The frame in numbers: base plate, two uprights with the bearings' head, and all brackets.

Head, uprights and feet stand behind the base, where neither its swing nor any light comes.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import Component, Cylinder, box
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.frame.brackets import (
    EXTRUSION_MM,
    TAPPED_M5_MM,
    Bracket,
    drilled,
    fitting,
    rig_axes,
    screw,
)
from tbcad.prototype.frame.feet import camera_bracket, stage_foot, upright_foot
from tbcad.prototype.frame.head import Head, head
from tbcad.prototype.frame.purchased import PLATE_MM
from tbcad.prototype.keepout import Room, least
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import FrameSpec as FrameKeys
from tbcad.spec.prototype import PrototypeSpec
from tbcad.types import Floats

ROUND_MM = 10.0  # plate beyond the brackets' feet
TIGHT_MM = 4.0  # least of a screw beyond what it holds
MOTOR_THREAD_MM = 3.0
CAMERA_SCREW = "UNC1/4-20x12.7"
TNUT, POST_SCREW = "TNUT-M5-6", "SET-M3x6"
LIT = ("camera",)  # light goes into it
HELD = ("rotary_stage",)  # the hub is bolted on it


@dataclass(frozen=True)
class FrameLayout:
    """The frame, in the frame of the shell.

    Attributes:
        axes: of the frame, as rows: level under the axis w, across it, up, (3, 3).
        head: bearings and motor.
        printed: brackets to print.
        bought: bodies of purchased parts, for the assembly.
        holes: tapped M5 holes of the base plate, (x, y) along the frame's axes, mm, (h, 2).
        holds: bracket that each hole holds.
        corner: the plate's, from where its holes are measured, (x, y) as the holes, mm, (2,).
        plate: part of the base plate.
        upright: part that the uprights are cut from.
        length: of the uprights, mm.
        screws: quantity of screws and nuts, by name.
        light: least distance of each to the light in use, mm.
        swept: least distance of each to what the base sweeps, mm.
    """

    axes: Floats
    head: Head
    printed: tuple[Component, ...]
    bought: tuple[Component, ...]
    holes: Floats
    holds: tuple[str, ...]
    corner: Floats
    plate: PurchasedPart
    upright: PurchasedPart
    length: float
    screws: dict[str, int]
    light: dict[str, float]
    swept: dict[str, float]


def frame(
    spec: tuple[FrameKeys, PrototypeSpec],
    made: PrototypeLayout,
    base: BaseLayout,
    stage: StageLayout,
    drive: Drive,
    space: Room,
    parts: Parts,
) -> FrameLayout:
    """The frame round a base and a stage.

    Args:
        spec: the sections of frame and prototype.
        made: the prototype.
        base: that turns.
        stage: that the object stands on.
        drive: chosen for the base.
        space: room that is left.
        parts: purchased parts.

    Raises:
        SpecError: when something does not fit; it says what to change.
    """
    keys, own = spec
    axes = rig_axes(base.frame[0])
    top = head(keys, base, drive, axes, parts)
    brackets = _brackets(keys, own, made, axes, stage, top, parts)
    upright, length, bars = _uprights(keys, axes, top, parts)
    plate, ground, corner = _plate(keys, axes, brackets, parts)
    bought = (ground, *bars, *top.bought, *_camera(own, made))
    printed = (top.item, *(bracket.item for bracket in brackets))
    light, swept = _clear(keys, (*printed, *bought), space)
    return FrameLayout(
        axes=axes,
        head=top,
        printed=printed,
        bought=bought,
        holes=np.vstack([bracket.holes for bracket in brackets]),
        holds=tuple(bracket.item.name for bracket in brackets for _ in bracket.holes),
        corner=corner,
        plate=plate,
        upright=upright,
        length=length,
        screws=_screws(keys, own, drive, brackets, parts),
        light=light,
        swept=swept,
    )


def bought_parts(numbers: FrameLayout, stage: StageLayout) -> dict[str, int]:
    """Quantity of purchased parts of stage and frame by name, without the drive and the LEDs."""
    kinds = ("bearing_front", "bearing_rear", "collar", "shaft")
    found = Counter(item.part for item in numbers.bought if item.name in kinds and item.part)
    found.update(numbers.screws)
    found.update({numbers.plate.name: 1, numbers.upright.name: 2})
    found.update({POST_SCREW: 1} if stage.items else {})
    return dict(sorted(found.items()))


def _brackets(
    keys: FrameKeys,
    own: PrototypeSpec,
    made: PrototypeLayout,
    axes: Floats,
    stage: StageLayout,
    top: Head,
    parts: Parts,
) -> list[Bracket]:
    found = [upright_foot(keys, axes, top.face, side) for side in (1, -1)]
    found.append(stage_foot(keys, axes, stage, parts["INSERT-M4"]))
    if own.camera_diameter_mm > 0:
        found.append(camera_bracket(keys, axes, own, made.half.camera))
    return found


def _uprights(
    keys: FrameKeys, axes: Floats, top: Head, parts: Parts
) -> tuple[PurchasedPart, float, list[Component]]:
    """Part and length of the uprights, and their bodies."""
    length = top.top - keys.floor_mm
    hint = "make prototype.frame.floor_mm greater, or add a longer one"
    part = fitting(parts, "extrusions", "prototype.frame.floor_mm", hint, length_mm=length)
    half, items = EXTRUSION_MM / 2, []
    for name, sign in (("upright_left", 1), ("upright_right", -1)):
        y = sign * keys.uprights_mm / 2
        low = np.array([top.face - EXTRUSION_MM, y - half, keys.floor_mm])
        body = box(low, np.array([top.face, y + half, top.top]), axes)
        what = f"{part.what}, cut to {length:.1f} mm"
        items.append(Component(name, what, (body,), part=part.name))
    return part, length, items


def _plate(
    keys: FrameKeys, axes: Floats, brackets: list[Bracket], parts: Parts
) -> tuple[PurchasedPart, Component, Floats]:
    """The least plate under all feet, its middle under theirs, with tapped holes; its corner."""
    feet = np.vstack([bracket.foot for bracket in brackets])
    low, high = feet.min(axis=0) - ROUND_MM, feet.max(axis=0) + ROUND_MM
    middle = (low + high) / 2
    fit = [
        part
        for part in parts.values()
        if part.kind == "plates"
        and part["length_mm"] >= high[0] - low[0]
        and part["width_mm"] >= high[1] - low[1]
    ]
    if not fit:
        raise SpecError(
            f"no base plate in plates.csv is {high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} mm: "
            "add one, or make prototype.camera_diameter_mm smaller"
        )
    part = min(fit, key=lambda one: one["length_mm"] * one["width_mm"])
    half = np.array([part["length_mm"], part["width_mm"]]) / 2
    bottom = keys.floor_mm - part["thickness_mm"]
    corners = np.array([*(middle - half), bottom]), np.array([*(middle + half), keys.floor_mm])
    places = [np.array([*p, bottom]) @ axes for b in brackets for p in b.holes]
    holes = drilled(places, part["thickness_mm"] * axes[2], TAPPED_M5_MM)
    item = Component("plate", part.what, (box(*corners, axes),), tuple(holes), part=part.name)
    return part, item, middle - half


def _camera(own: PrototypeSpec, made: PrototypeLayout) -> list[Component]:
    if own.camera_diameter_mm == 0:
        return []
    view, radius = made.half.camera, own.camera_diameter_mm / 2
    body = Cylinder(view.pinhole, -view.forward, radius, own.camera_length_mm)
    return [Component("camera", "camera behind its pinhole", (body,))]


def _screws(
    keys: FrameKeys, own: PrototypeSpec, drive: Drive, brackets: list[Bracket], parts: Parts
) -> dict[str, int]:
    """Screws and nuts: on the uprights with T-nuts, in the plate, of motor, clamp and camera."""
    on_uprights = 4 + 2 * 2
    in_plate = sum(len(bracket.holes) for bracket in brackets)
    found = Counter({TNUT: on_uprights, "INSERT-M4": 1, screw(parts, 4.0, 20.0): 1})
    found[screw(parts, 5.0, keys.flange_mm + TIGHT_MM)] += on_uprights
    found[screw(parts, 5.0, keys.flange_mm + 2 * TIGHT_MM)] += in_plate
    if drive.motor.kind == "motors":
        found[screw(parts, 3.0, PLATE_MM + MOTOR_THREAD_MM)] += 4
    else:
        found[screw(parts, 6.0, PLATE_MM + 2 * MOTOR_THREAD_MM)] += 4
    if own.camera_diameter_mm > 0:
        found[CAMERA_SCREW] += 1
    return dict(found)


def _clear(
    keys: FrameKeys, items: tuple[Component, ...], space: Room
) -> tuple[dict[str, float], dict[str, float]]:
    """Least distances to light and to what the base sweeps, of all that stands still.

    Raises:
        SpecError: when one is less than the spec's.
    """
    still = [item for item in items if not item.turns]
    swept = {item.name: least(space.swept, item.added) for item in still if item.name not in HELD}
    light = {item.name: least(space.light, item.added) for item in still if item.name not in LIT}
    for of, found in (("light of the balls", light), ("balls and base as they swing", swept)):
        name = min(found, key=lambda one: found[one])
        if found[name] < keys.clearance_mm:
            raise SpecError(
                f"{name.replace('_', ' ')}: {found[name]:.1f} mm from the {of}, less than "
                f"prototype.frame.clearance_mm {keys.clearance_mm:g}: make {_remedy(name)}"
            )
    return light, swept


def _remedy(name: str) -> str:
    """What to change so that a part has more room."""
    if name.startswith("camera"):
        return "prototype.frame.camera_screw_mm larger or prototype.camera_diameter_mm smaller"
    if name in ("plate", "stage_foot"):
        return "prototype.frame.floor_mm less"
    if name in ("motor", "pinion"):
        return (
            "prototype.largest_ball_mm smaller, or use a drive with a longer belt or a direct one"
        )
    return "prototype.frame.uprights_mm or prototype.largest_ball_mm smaller"

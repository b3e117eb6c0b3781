"""The stage: the object's room is free, its LEDs are in the light, and mirrors see them past it."""

from __future__ import annotations

import math

import numpy as np

from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.bodies import body_scene, placed_meshes
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    informative,
    short_list,
    worst_offenders,
)
from tbcad_verify.types import Bools, Floats

FILE = ("stage", "frame")
CHECKS = {"object room": "mm^3", "leds seen": "LEDs", "leds inside": "outside the capture sphere"}
NEEDED = 2  # LEDs, for the three coordinates of a centre
ROOM_MM3 = 0.1  # of parts in the room: facets of the arms' rounding
LIFT_MM = 0.01  # of the room above the disc
ROOM_SIDES = 180


def checks(
    names: list[CheckName], context: PrototypeContext, parts: list[MeasuredPart]
) -> list[Check]:
    """Room and LEDs against the parts of stage and frame.

    Every LED is inside the capture sphere.
    """
    room, seen, inside = names
    fixed = of_roles(parts, *FILE)
    leds = context.prototype.leds
    volume, filled = _volume_in_room(context, fixed)
    empty = at_most(room, volume, ROOM_MM3, f"in the object's room: {short_list(filled)}")
    if not leds:
        return [empty, *(informative(name, 0, "no LEDs") for name in names[1:])]
    counted = (~_hidden_by_room(context) & ~_hidden_by_parts(context, fixed)).sum(axis=0)
    ids, few = context.mirror_ids, counted < NEEDED
    few_text = worst_offenders(ids, counted.astype(np.float64), "", few, ".0f")
    beyond = [led.name for led in leds if np.linalg.norm(led.position) > context.radius]
    return [
        empty,
        at_least(seen, int(counted.min()), NEEDED, f"seen past an object in its room: {few_text}"),
        at_most(inside, len(beyond), 0, f"the camera may not see {short_list(beyond)}"),
    ]


def _room(context: PrototypeContext) -> tuple[float, float, float]:
    """Radius, lower and upper end of the upright cylinder that the object may fill, mm."""
    stage = context.export.spec.prototype.stage
    radius = stage.object_diameter_mm / 2
    high = math.sqrt(max(context.radius**2 - radius**2, 0.0))
    return radius, stage.top_mm, high


def _volume_in_room(
    context: PrototypeContext, fixed: list[MeasuredPart]
) -> tuple[float, list[str]]:
    """Volume of parts in the room, mm^3, and which parts and LEDs are in it."""
    import manifold3d

    radius, low, high = _room(context)
    height = max(high - low - LIFT_MM, LIFT_MM)
    room = manifold3d.Manifold.cylinder(height, radius, radius, ROOM_SIDES)
    room = room.translate([0.0, 0.0, low + LIFT_MM])
    volumes = {}
    for part in fixed:
        least, most = (end(part.placed_mesh.points, axis=0) for end in (np.min, np.max))
        if (least[:2] < radius).all() and (most[:2] > -radius).all() and most[2] > low:
            volumes[part.part.name] = (part.solid ^ room).volume()
    leds = [led.name for led in context.prototype.leds if np.hypot(*led.position[:2]) < radius]
    names = [name for name, volume in volumes.items() if volume > ROOM_MM3 / max(len(volumes), 1)]
    return float(sum(volumes.values())) + len(leds), names + leds


def _sights(context: PrototypeContext) -> tuple[Floats, Floats]:
    """(l, 3) LEDs, and (l, 3, m) ways from them to the virtual cameras, mm."""
    mirrors = context.export.mirrors.take(context.mirror_rows)
    semi_major = math.hypot(
        context.export.semi_minor_mm, float(np.linalg.norm(context.pinhole)) / 2
    )
    cameras = 2 * semi_major * mirrors.columns("ux", 3)
    leds = np.stack([led.position for led in context.prototype.leds])
    return leds, cameras[None] - leds[:, :, None]


def _hidden_by_room(context: PrototypeContext) -> Bools:
    """(l, m) whether the way passes through the room, by the part of it within its height."""
    radius, low, high = _room(context)
    leds, sight = _sights(context)
    rise = np.where(np.abs(sight[:, 2]) < 1e-12, 1e-12, sight[:, 2])
    ends = np.stack([(level - leds[:, 2, None]) / rise for level in (low, high)])
    first, last = np.clip(np.sort(ends, axis=0), 0.0, 1.0)
    flat, across = sight[:, :2], leds[:, :2, None]
    nearest = -(flat * across).sum(axis=1) / np.maximum((flat**2).sum(axis=1), 1e-12)
    share = np.clip(nearest, first, last)
    distance = np.hypot(*np.moveaxis(across + share[:, None] * flat, 1, 0))
    return np.asarray((distance < radius) & (first < last))


def _hidden_by_parts(context: PrototypeContext, fixed: list[MeasuredPart]) -> Bools:
    """(l, m) whether a facet of a part is on the way to the mirror; beyond it is no light."""
    apex = context.export.mirrors.take(context.mirror_rows).columns("px", 3)
    scene, (leds, sight) = body_scene(placed_meshes(fixed)), _sights(context)
    starts = np.repeat(leds[:, :, None], sight.shape[2], axis=2)
    reach = [scene.first(*rays)[1] for rays in zip(starts, map(unit, sight), strict=True)]
    return np.asarray(reach < np.linalg.norm(apex - starts, axis=1))

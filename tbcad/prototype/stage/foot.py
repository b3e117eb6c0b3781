"""The clamp of the stage's post on the base plate, and how the stage is put together."""

import numpy as np

from tbcad.core.geometry.primitives import Component, Cylinder, Primitive, box, cylinder_between
from tbcad.prototype.assembly_steps.machine import (
    AssembledMachine,
    Words,
    planned,
    told_words,
    when,
)
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.shared import CLEARANCE_HOLE_MM, THROUGH_MM, drilled_holes
from tbcad.prototype.part import Bracket, FrameLayout, Mounted, Part, Site
from tbcad.prototype.purchased.parts import Parts, choose_screw
from tbcad.prototype.stage.layout import StageLayout
from tbcad.types import Floats

M5_HEAD_MM = 8.5
# Clamp of the post.
COLLAR_HEIGHT_MM, COLLAR_WALL_MM = 34.0, 8.0  # of the collar round the post, from the plate
SLIT_MM = 2.0
EAR_MM, EAR_LENGTH_MM = 11.0, 14.0  # half width and length of the clamp's ears
EAR_ROOT_MM = 3.0  # from the post to where ears begin within the collar
HEAD_TO_COLLAR_MM, HEAD_TO_EAR_MM = 2.0, 1.0  # between a screw's head and collar, ear
CLAMP_EDGE_MM = 9.0  # from a screw to the foot's edge
BEYOND_EAR_MM = 1.0  # of foot and slit beyond the ears
SLIT_FLOOR_MM = 1.0  # material below the slit
CLAMP_INSERT, CLAMP_SCREW_MM = "INSERT-M4", (4.0, 20.0)  # thread, length
INSERT_PLAY_MM = 0.4  # of the insert's hole beyond it
WIRE_WALL_MM, MAX_WIRE_MM = 3.0, 4.0  # post beside the wires' hole, and its largest radius
CHANNEL_WIDTH_MM, CHANNEL_HEIGHT_MM = 6.0, 4.5
CHANNEL_ROOF_MM = 3.0  # material above the channel


def stage_foot(site: Site, _: FrameLayout) -> Mounted:
    """A clamp round the post, with a channel for the wires below."""
    spec, axes, stage = site.spec.prototype.frame, site.axes, site.stage
    low, radius, up = spec.floor_mm, stage.sizes.post + COLLAR_WALL_MM, axes[2]
    ear, top = radius + EAR_LENGTH_MM, low + COLLAR_HEIGHT_MM
    # Screws on the diagonals clear the collar, and beside the ears these.
    beside_collar = (radius + M5_HEAD_MM / 2 + HEAD_TO_COLLAR_MM) / np.sqrt(2)
    screw = max(beside_collar, EAR_MM + M5_HEAD_MM / 2 + HEAD_TO_EAR_MM)
    half = screw + CLAMP_EDGE_MM
    end = max(half, ear + BEYOND_EAR_MM)
    base, middle = np.array([0.0, 0.0, low]), np.array([0.0, 0.0, stage.foot])
    added = (
        box((-half, -half, low), (end, half, stage.foot), axes),
        Cylinder(base, up, radius, COLLAR_HEIGHT_MM),
        box((stage.sizes.post + EAR_ROOT_MM, -EAR_MM, low), (ear, EAR_MM, top), axes),
    )
    holes = screw * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    places = [np.array([*hole, low]) @ axes for hole in holes]
    wire = min(stage.sizes.post - WIRE_WALL_MM, MAX_WIRE_MM)
    width = CHANNEL_WIDTH_MM / 2
    height = min(CHANNEL_HEIGHT_MM, spec.flange_mm - CHANNEL_ROOF_MM)
    channel = -width, -half - THROUGH_MM, low - THROUGH_MM
    clamp, fasteners = _clamp(axes, stage, ear, top, site.parts)
    removed = (
        Cylinder(middle, up, stage.sizes.post + spec.post_play_mm / 2, COLLAR_HEIGHT_MM),
        Cylinder(base - THROUGH_MM * up, up, wire, COLLAR_HEIGHT_MM),
        *clamp,
        *drilled_holes(places, spec.flange_mm * up, CLEARANCE_HOLE_MM[5.0]),
        box(channel, (width, 0.0, low + height), axes),
    )
    component = Component("stage_foot", "clamp of the stage's post", added, removed, (-up, up))
    foot = np.array([[-half, -half], [end, half]])
    return Mounted(brackets=(Bracket(component, holes, foot, fasteners),))


def _clamp(
    axes: Floats, stage: StageLayout, ear: float, top: float, parts: Parts
) -> tuple[list[Primitive], tuple[Fastener, ...]]:
    """Slit, holes of screw and insert across it; the screw in one ear, its insert in the other."""
    insert, low = parts[CLAMP_INSERT], stage.foot + SLIT_FLOOR_MM
    slit = 0.0, -SLIT_MM / 2, low
    end = ear + BEYOND_EAR_MM, SLIT_MM / 2, top + THROUGH_MM
    middle = np.array([ear - EAR_LENGTH_MM / 2, 0.0, (low + top) / 2 + SLIT_FLOOR_MM])
    side, outside, inside = (
        np.array([0.0, across, 0.0])
        for across in (
            *(EAR_MM, EAR_MM + THROUGH_MM),
            EAR_MM - insert["length_mm"] - INSERT_PLAY_MM,
        )
    )
    through, outer = CLEARANCE_HOLE_MM[insert["thread_mm"]] / 2, (middle + outside) @ axes
    removed: list[Primitive] = [
        box(slit, end, axes),
        cylinder_between((middle - outside) @ axes, outer, through),
        cylinder_between((middle + inside) @ axes, outer, insert["hole_mm"] / 2),
    ]
    screw, name = choose_screw(parts, *CLAMP_SCREW_MM), ("stage_foot",)
    return removed, (
        Fastener(screw, (middle - side) @ axes, axes[1], name),
        Fastener(insert, (middle + side) @ axes, -axes[1], name),
    )


@planned("Object stage", "stage_*", loose=("WIRE-28", "WIRE-30"))
def stage_step(machine: AssembledMachine) -> Words:
    """The object's stage with its LEDs; x is toward the camera, y to its right as it looks back."""
    leds = [_led_place(k, *one.position_mm) for k, one in enumerate(machine.record.leds, 1)]
    return told_words(
        __name__,
        "stage",
        leds=leds,
        count=len(leds),
        wired=when(leds, "Wires through the post. "),
        turned=when(leds, ", turned so that the LEDs stand as the checks say"),
        plugged=when(leds, " A plug on the wires lets it be taken out."),
    )


def _led_place(number: int, x: float, y: float, z: float) -> dict[str, object]:
    """Where an LED is, seen from the camera."""
    return {
        "number": number,
        **{"away": abs(x), "toward": "toward" if x > 0 else "away from"},
        **{"aside": abs(y), "side": "right" if y > 0 else "left"},
        **{"height": abs(z), "above": "above" if z > 0 else "below"},
    }


STAGE = Part((stage_step,), stage_foot, remedies={"stage_foot": "prototype.frame.floor_mm less"})

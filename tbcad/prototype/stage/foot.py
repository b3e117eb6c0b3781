"""The stage's post and its clamp on the base plate, and how the stage is put together."""

import numpy as np

from tbcad.core.geometry.primitives import Component, Cylinder, box
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.frame.shared import THROUGH_MM, drilled_holes
from tbcad.prototype.part import Bracket, FrameLayout, Mounted, Part, Site
from tbcad.prototype.stage.crown import PLUG_MM, WIRES_MM
from tbcad.prototype.stage.layout import StageLayout, wires_up
from tbcad.types import Floats

FLANGE_OF_COLLAR = 0.6  # width of a clamp's flange, simplified, in that of its collar
SLIT_MM = 2.0


def stage_foot(site: Site, _: FrameLayout) -> Mounted:
    """The post, and the bought clamp round it on the plate; its screw is its own."""
    stage, part = site.stage, site.stage.clamp
    place = np.array([part["holes_mm"] / 2, 0.0])
    half = np.array([part["length_mm"], part["width_mm"]]) / 2
    return Mounted(
        brackets=(
            Bracket(
                _clamp(stage, site.axes),
                np.array([place, -place]),
                np.array([-half, half]),
                thickness=part["flange_mm"],
            ),
        ),
        purchased=(stage.post,),
        listed={str(stage.post.part): 1, part.name: 1},
    )


def _clamp(stage: StageLayout, axes: Floats) -> Component:
    """Flange, collar, bore, two holes, and the slit in the collar."""
    part, up, low = stage.clamp, axes[2], stage.foot
    half, radius, height = part["length_mm"] / 2, part["width_mm"] / 2, part["height_mm"]
    side, base = FLANGE_OF_COLLAR * radius, np.array([0.0, 0.0, low])
    below, through = base - THROUGH_MM * up, height + 2 * THROUGH_MM
    holes = [np.array([sign * part["holes_mm"] / 2, 0.0, low]) @ axes for sign in (1, -1)]
    slit = (-SLIT_MM / 2, 0.0, low - THROUGH_MM), (SLIT_MM / 2, radius + THROUGH_MM, low + through)
    return Component(
        "stage_foot",
        part.what,
        (
            box((-half, -side, low), (half, side, low + part["flange_mm"]), axes),
            Cylinder(base, up, radius, height),
        ),
        (
            Cylinder(below, up, stage.sizes.post, through),
            *drilled_holes(holes, part["flange_mm"] * up, part["hole_mm"]),
            box(*slit, axes),
        ),
        part=part.name,
    )


@planned("Object stage", "stage_*", loose=("WIRE-28", "WIRE-30"))
def stage_step(machine: AssembledMachine) -> Values:
    """The object's stage with its LEDs; x is toward the camera, y to its right as it looks back."""
    leds = [_led_place(k, *one.position_mm) for k, one in enumerate(machine.record.leds, 1)]
    post = next(one for one in machine.record.bought if one.name == "stage_post")
    clamp = machine.parts[machine.bodies["stage_foot"]]
    return {
        "tube": machine.ref(post.part or ""),
        "cut": post.what.rpartition(", ")[2],
        "below": PLUG_MM / 2,
        "above": wires_up(clamp),
        "wires": min(WIRES_MM, clamp["bore_mm"] / 2),
        "leds": leds,
        "count": len(leds),
        "wired": when(leds, "Wires through the post. "),
        "turned": when(leds, ", turned so that the LEDs stand as the checks say"),
        "braked": when(machine.has("brake"), " (with 24 V on the brake)"),
        "plugged": when(leds, " A plug on the wires lets it be taken out."),
    }


def _led_place(number: int, x: float, y: float, z: float) -> dict[str, object]:
    """Where an LED is, seen from the camera."""
    return {
        "number": number,
        **{"away": abs(x), "toward": "toward" if x > 0 else "away from"},
        **{"aside": abs(y), "side": "right" if y > 0 else "left"},
        **{"height": abs(z), "above": "above" if z > 0 else "below"},
    }


STAGE = Part((stage_step,), stage_foot, remedies={"stage_foot": "prototype.frame.floor_mm less"})

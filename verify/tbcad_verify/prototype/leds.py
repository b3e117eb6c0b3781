"""The LEDs of the stage: inside the capture sphere, free of the stage, and in its pockets."""

from __future__ import annotations

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import (
    MeasuredPart,
    distance_to_facets,
    joined_meshes,
)
from tbcad_verify.report.checks import Check, CheckName, at_most, informative, short_list
from tbcad_verify.types import Floats

CUBE_MM = 0.02  # edge of the cube that represents an LED
CHECKS = {
    "leds inside": "outside the capture sphere",
    "leds free": "in the stage",
    "leds to stage": "mm",
}


def checks(
    names: list[CheckName], context: PrototypeContext, stage: list[MeasuredPart]
) -> list[Check]:
    """Every LED is inside the capture sphere and not in the stage's material.

    The distance of the farthest from the stage informs: an LED in its pocket has a wall close by.
    """
    inside, free, on_stage = names
    leds = context.prototype.leds
    beyond = [led.name for led in leds if np.linalg.norm(led.position) > context.radius]
    sphere = at_most(inside, len(beyond), 0, f"the camera may not see {short_list(beyond)}")
    if not leds or not stage:
        return [sphere, informative(free, 0), informative(on_stage, 0, "no LED, or no stage")]
    mesh, facet = joined_meshes(stage)
    distance = [distance_to_facets(led.position, mesh, np.arange(facet.size)) for led in leds]
    sunk = [led.name for led in leds if _is_in_material(stage, led.position)]
    k = int(np.argmax(distance))
    return [
        sphere,
        at_most(free, len(sunk), 0, f"in the material of the stage: {short_list(sunk)}"),
        informative(on_stage, distance[k], f"{leds[k].name} is farthest from the stage"),
    ]


def _is_in_material(stage: list[MeasuredPart], point: Floats) -> bool:
    """Whether a small cube about a point is in the material of a part."""
    import manifold3d

    cube = manifold3d.Manifold.cube([CUBE_MM] * 3, center=True).translate(point)
    return any((part.solid ^ cube).volume() > cube.volume() / 2 for part in stage)

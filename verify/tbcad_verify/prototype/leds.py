"""The lights of the stage: in the object's place, free of the stage, and in its pockets."""

from __future__ import annotations

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, joined_meshes, of_roles
from tbcad_verify.prototype.swing import solid_of
from tbcad_verify.prototype.triangle_distances import distances
from tbcad_verify.report.checks import Check, at_most, informative, short_list
from tbcad_verify.types import Floats

POINT_MM = 0.02  # edge of the cube that stands for a light
CHECKS = {
    "leds inside": "outside the capture sphere",
    "leds free": "in the stage",
    "leds held": "mm",
}


def checks(context: PrototypeContext, bodies: list[MeasuredPart], files: str) -> list[Check]:
    """Every light is inside the capture sphere and not in the stage's material.

    How far the farthest is from the stage is told: a light in its pocket has a wall close by.
    """
    inside, free, held = ((name, files, unit) for name, unit in CHECKS.items())
    leds = context.prototype.leds
    position = np.array([led.position for led in leds]).reshape(-1, 3)
    beyond = np.linalg.norm(position, axis=1) > context.radius
    odd = [leds[k].name for k in np.flatnonzero(beyond).tolist()]
    made = [at_most(inside, len(odd), 0, f"the camera may not see {short_list(odd)}")]
    stage = of_roles(bodies, "stage")
    if not leds or not stage:
        return [*made, informative(free, 0), informative(held, 0, "no light, or no stage")]
    mesh, _ = joined_meshes(stage)
    a, b, c = (mesh.points[mesh.faces[:, k]].T for k in range(3))
    away = np.array([float(distances(point, (a, b, c)).min()) for point in position])
    sunk = [led.name for led, point in zip(leds, position, strict=True) if _in(stage, point)]
    worst = int(away.argmax())
    return [
        *made,
        at_most(free, len(sunk), 0, f"in the material of the stage: {short_list(sunk)}"),
        informative(held, float(away[worst]), f"{leds[worst].name} is farthest from the stage"),
    ]


def _in(stage: list[MeasuredPart], point: Floats) -> bool:
    """Whether a small cube about a point is in the material of a part."""
    import manifold3d

    cube = manifold3d.Manifold.cube([POINT_MM] * 3, center=True).translate(point)
    return any((solid_of(one.placed_mesh) ^ cube).volume() > cube.volume() / 2 for one in stage)

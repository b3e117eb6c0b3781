"""Background of the mirrors: the sensor sees bodies listed as matt black, nothing else."""

from __future__ import annotations

from collections import Counter

import numpy as np

from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.bodies import OWN, AssembledBodies, some_angles
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import GLB
from tbcad_verify.report.checks import Check, CheckName, at_most, informative, short_list
from tbcad_verify.types import Floats

FILE = GLB
CHECKS = {"dark background": "rays"}
GRID = 160  # rays across the columns of the picture
BLACK = "matt black"
NOTHING = "nothing"
MIRRORS = ("ball_", "cap_")


def checks(
    names: list[CheckName], context: PrototypeContext, bodies: AssembledBodies
) -> list[Check]:
    """Rays of the whole sensor, at some stops: what they meet is a mirror or listed as black."""
    if context.prototype.shroud is None:
        return [informative(names[0], 0, "there is no shroud")]
    black, rays = _black_bodies(context), _sensor_rays(context)
    origin, others = np.broadcast_to(context.pinhole, rays.shape), bodies.without(OWN)
    seen = Counter[str]()
    for angle in some_angles(context).tolist():
        for name, count in others.count_first(origin, rays, angle).items():
            if name not in black and not name.startswith(MIRRORS):
                seen[name or NOTHING] += count
    texts = [f"{count} rays end on {name}" for name, count in sorted(seen.items())]
    return [at_most(names[0], seen.total(), 0, short_list(texts))]


def _black_bodies(context: PrototypeContext) -> set[str]:
    """Names of all bodies that the record lists as matt black."""
    record = context.prototype
    listed = {part.name for part in record.parts if part.finish == BLACK}
    listed |= {one.name for one in record.bought if one.finish == BLACK}
    listed |= {one.name for one in record.fasteners if one.finish == BLACK}
    if record.shroud and record.shroud.finish == BLACK:
        listed |= {panel.name for panel in record.shroud.panels}
    return listed


def _sensor_rays(context: PrototypeContext) -> Floats:
    """(N, 3) unit directions through evenly spaced places of the sensor, its edges included."""
    camera = context.camera
    half = np.tan(camera.hfov / 2)
    across = np.linspace(-half, half, GRID)
    ratio = camera.height / camera.width
    down = np.linspace(-half, half, max(2, round(GRID * ratio))) * ratio
    x, y = np.meshgrid(across, down)
    rays = camera.forward + x[..., None] * camera.right + y[..., None] * camera.down
    return np.ascontiguousarray(unit(rays.reshape(-1, 3).T).T)

"""What the camera sees beside the object: matt black everywhere, and how often a lamp.

A lamp below the horizon is seen by the mirrors opposite, past the object, where no object hides it.
Lamps that light the object alike before and after its half turn cannot be anywhere else.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.bodies import Bodies, some_angles
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.report.checks import Check, CheckName, at_most, informative, short_list
from tbcad_verify.types import Floats

GRID = 160  # rays across the columns of the picture
BLACK = "matt black"
NOTHING = "nothing"
MIRRORS = ("ball_", "cap_")
CHECKS = {"dark background": "rays"}


def checks(names: list[CheckName], context: PrototypeContext, bodies: Bodies) -> list[Check]:
    """Rays of the whole sensor, at some stops: what they meet is a mirror or listed as black."""
    if context.prototype.shroud is None:
        return [informative(names[0], 0, "there is no shroud")]
    black = black_bodies(context)
    rays = _sensor_rays(context)
    origin = np.broadcast_to(context.pinhole, rays.shape)
    seen = Counter[str]()
    for angle in some_angles(context).tolist():
        for name, count in bodies.count_first(origin, rays, angle).items():
            seen[name or NOTHING] += count
    bright = {
        name: count
        for name, count in seen.items()
        if name not in black and not name.startswith(MIRRORS)
    }
    texts = [f"{count} rays end on {name}" for name, count in sorted(bright.items())]
    return [at_most(names[0], sum(bright.values()), 0, short_list(texts))]


def black_bodies(context: PrototypeContext) -> frozenset[str]:
    """Names of all bodies that the record lists as matt black."""
    prototype = context.prototype
    listed = {part.name for part in prototype.parts if part.finish == BLACK}
    listed |= {one.name for one in prototype.bought if one.finish == BLACK}
    listed |= {one.name for one in prototype.fasteners if one.finish == BLACK}
    if prototype.shroud and prototype.shroud.finish == BLACK:
        listed |= {panel.name for panel in prototype.shroud.panels}
    return frozenset(listed)


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

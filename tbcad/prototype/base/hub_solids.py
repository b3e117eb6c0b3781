"""The hub's solids and what is drilled out of them, about z."""

import numpy as np
from OCP.TopoDS import TopoDS_Shape

from tbcad.cad.solids import cylinder, polygon, prism
from tbcad.prototype.base.hub import SCREW_MM, SLIT_MM, Hub
from tbcad.spec.prototype import BaseSpec
from tbcad.types import Floats

UP = np.array([0.0, 0.0, 1.0])
THROUGH = 1.0  # tools stick out this far, so that no faces coincide
# Azimuths of the set screws: on the side without ribs, at a right angle to each other.
SCREWS = np.radians([135.0, 225.0])


def hub_bodies(hub: Hub) -> list[TopoDS_Shape]:
    """Disc and boss."""
    disc = cylinder(hub.back * UP, UP, hub.disc, hub.front - hub.back)
    if not hub.boss:
        return [disc]
    return [disc, cylinder(hub.face * UP, UP, hub.boss, hub.back - hub.face + THROUGH)]


def hub_holes(hub: Hub, keys: BaseSpec) -> list[TopoDS_Shape]:
    """Bore, the drive's holes, and those of the lock."""
    start, length = hub.face - THROUGH, hub.front - hub.face + 2 * THROUGH
    found = [cylinder(start * UP, UP, hub.bore, length)]
    for place in hub.holes:
        at = np.array([*place, start])
        through = hub.depth >= hub.front - hub.face
        found.append(cylinder(at, UP, hub.hole / 2, length if through else hub.depth + THROUGH))
        if hub.head[0]:
            top = np.array([*place, hub.front + THROUGH])
            found.append(cylinder(top, -UP, hub.head[0] / 2, hub.head[1] + THROUGH))
    locks = {"set-screws": _set_screws, "clamp": _clamp}
    return found + (locks[hub.lock](hub, keys) if hub.lock else [])


def _set_screws(hub: Hub, keys: BaseSpec) -> list[TopoDS_Shape]:
    found = []
    for turn in SCREWS.tolist():
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        found += _insert(hub.cross * UP, out, hub.boss, keys)
    return found


def _insert(at: Floats, out: Floats, end: float, keys: BaseSpec) -> list[TopoDS_Shape]:
    """A screw's hole from a point outward, and the insert's hole at its end."""
    insert = at + (end + THROUGH) * out
    return [
        cylinder(at, out, SCREW_MM / 2, end + THROUGH),
        cylinder(insert, -out, keys.insert_hole_mm / 2, keys.insert_depth_mm + THROUGH),
    ]


def _clamp(hub: Hub, keys: BaseSpec) -> list[TopoDS_Shape]:
    """A slit away from the ribs, and a screw across it."""
    half, far, top = SLIT_MM / 2, -hub.boss - THROUGH, hub.back - SLIT_MM
    corners = [[0, half], [far, half], [far, -half], [0, -half]]
    base = np.array([[x, y, hub.face - THROUGH] for x, y in corners])
    slit = prism(polygon(base), (top - hub.face + THROUGH) * UP)
    # Above the slit a cut half round the bore, or the disc would hold the jaws apart.
    low, high = np.array([0, 0, top - SLIT_MM]), np.array([0, 0, top])
    ring = np.array(
        [[0, -hub.boss - 1], [0, hub.boss + 1], [far, hub.boss + 1], [far, -hub.boss - 1]]
    )
    free = prism(polygon(np.column_stack([ring, np.full(4, low[2])])), high - low)
    across = np.array([0.0, 1.0, 0.0])
    at = np.array([-(hub.bore + hub.boss) / 2, 0.0, hub.cross])
    end = float(np.sqrt(hub.boss**2 - at[0] ** 2))
    back = cylinder(at, -across, SCREW_MM / 2, end + THROUGH)
    return [slit, free, back, *_insert(at, across, end, keys)]

"""The hub's solids and the holes in it, about z."""

import numpy as np
from OCP.TopoDS import TopoDS_Shape

from tbcad.cad.solids import cylinder, polygon, prism
from tbcad.prototype.base.hub import (
    KEY_DEPTH_MM,
    KEY_HOLE_MM,
    SCREW_MM,
    SET_SCREW_AZIMUTHS,
    SLIT_MM,
    Hub,
)
from tbcad.prototype.base.profile import meridian
from tbcad.spec.prototype import BaseSpec
from tbcad.types import Floats

UP = np.array([0.0, 0.0, 1.0])
THROUGH_MM = 1.0  # tools stick out this far, so that no faces coincide


def hub_bodies(hub: Hub) -> list[TopoDS_Shape]:
    """Disc and boss."""
    disc = cylinder(hub.back * UP, UP, hub.disc, hub.front - hub.back)
    if not hub.boss:
        return [disc]
    return [disc, cylinder(hub.face * UP, UP, hub.boss, hub.back - hub.face + THROUGH_MM)]


def hub_holes(hub: Hub, spec: BaseSpec) -> list[TopoDS_Shape]:
    """Bore, the drive's holes, the key's, and those of the lock."""
    start, through = hub.face - THROUGH_MM, hub.front - hub.face + 2 * THROUGH_MM
    blind = hub.depth < hub.front - hub.face
    holes = [cylinder(start * UP, UP, hub.bore, through)]
    key = np.array([*hub.key, start])
    holes.append(cylinder(key, UP, KEY_HOLE_MM / 2, KEY_DEPTH_MM + THROUGH_MM))
    for place in hub.holes:
        length = hub.depth + THROUGH_MM if blind else through
        holes.append(cylinder(np.array([*place, start]), UP, hub.hole / 2, length))
        if hub.head[0]:
            top = np.array([*place, hub.front + THROUGH_MM])
            holes.append(cylinder(top, -UP, hub.head[0] / 2, hub.head[1] + THROUGH_MM))
    locks = {"set-screws": _set_screw_holes, "clamp": _clamp_cuts}
    return holes + (locks[hub.lock](hub, spec) if hub.lock else [])


def _set_screw_holes(hub: Hub, spec: BaseSpec) -> list[TopoDS_Shape]:
    return [
        hole
        for azimuth in SET_SCREW_AZIMUTHS.tolist()
        for hole in _screw_with_insert(hub.lock_z * UP, meridian(azimuth)[0], hub.boss, spec)
    ]


def _screw_with_insert(
    start: Floats, out: Floats, length: float, spec: BaseSpec
) -> list[TopoDS_Shape]:
    """A screw's hole from a point outward, and the insert's hole at its end."""
    end = start + (length + THROUGH_MM) * out
    return [
        cylinder(start, out, SCREW_MM / 2, length + THROUGH_MM),
        cylinder(end, -out, spec.insert_hole_mm / 2, spec.insert_depth_mm + THROUGH_MM),
    ]


def _clamp_cuts(hub: Hub, spec: BaseSpec) -> list[TopoDS_Shape]:
    """A slit away from the ribs, and a screw across it."""
    far, bottom, top = -hub.boss - THROUGH_MM, hub.face - THROUGH_MM, hub.back - SLIT_MM
    slit = _block(far, SLIT_MM / 2, bottom, top)
    # Above the slit a cut half round the bore, or the disc would hold the jaws apart.
    relief = _block(far, hub.boss + THROUGH_MM, top - SLIT_MM, top)
    across = np.array([0.0, 1.0, 0.0])
    middle = np.array([-(hub.bore + hub.boss) / 2, 0.0, hub.lock_z])
    half = float(np.sqrt(hub.boss**2 - middle[0] ** 2))
    head_side = cylinder(middle, -across, SCREW_MM / 2, half + THROUGH_MM)
    return [slit, relief, head_side, *_screw_with_insert(middle, across, half, spec)]


def _block(far: float, half: float, low: float, high: float) -> TopoDS_Shape:
    """A block from the axis to x = far, to half a width on both sides, between two z."""
    corners = [[0, half, low], [far, half, low], [far, -half, low], [0, -half, low]]
    return prism(polygon(np.array(corners)), (high - low) * UP)

"""How far the camera's mount moves it, from holes and faces of the solids in the assembly.

Lengths are behind the pinhole along the optical axis, across, and out from the axis.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import RECORD
from tbcad_verify.report.checks import Check, CheckName, informative, no_faults, require
from tbcad_verify.step.solids_text import TextSolid, holes
from tbcad_verify.types import Floats

M5_MM, M5_HOLE_MM, M5_INSERT_MM, TRIPOD_HOLE_MM = 5.0, 5.5, 6.4, 6.6
TWO_NUTS_MM = 2 * 4.7 + 1.0  # with a washer, between plate and bracket
GRIP_MM, WASHER_MM = 4.0, 1.0
LIP_MM, LIP_WIDTH_MM = 5.0, 30.0  # least height and width of the fence at the camera's back
# Least travel to either side: printed brackets are off by half a millimetre and a degree.
LEAST = {"across_mm": 4.0, "out_mm": 2.5, "along_plate_mm": 4.0}
LEAST |= {"yaw_deg": 2.0, "roll_deg": 0.9, "pitch_deg": 0.9}
SAME_MM = 1e-6
SHARE = 1e-6
FILE = RECORD
CHECKS = {"camera mount": "faults"}


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """Travel as needed; the camera is held where the design has it."""
    if context.export.spec.prototype.camera_diameter_mm == 0:
        return [informative(names[0], 0, "no camera")]
    return [no_faults(names[0], _faults(context, solids))]


def _faults(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    spec, axes = context.export.spec.prototype, _axes(context)
    bracket, plate, fence = (
        require(solids.get(name), f"the assembly has no {name}")
        for name in ("camera_bracket", "camera_plate", "camera_fence")
    )
    inserts = _places(context, plate, M5_INSERT_MM, 2)
    if len(inserts) != 3:
        yield f"{len(inserts)} screws hold the camera plate"
        return
    tripod = _places(context, plate, TRIPOD_HOLE_MM, 2)
    along = float(np.ptp(tripod[:, 0])) / 2
    screw = np.array([spec.frame.camera_screw_mm, 0.0])
    if np.abs(tripod.mean(axis=0)[:2] - screw).max() > SAME_MM:
        yield "the tripod slot is elsewhere"
    travel = {"along_axis_mm": along}
    travel["across_mm"] = _least_reach(inserts, _places(context, bracket, M5_HOLE_MM, 2), 1)
    near = (bracket.corners - context.pinhole) @ axes[2]
    outs = (plate.corners - context.pinhole) @ axes[2]
    face, back = float(outs.min()), float(outs.max())
    yield from _camera_faults(context, solids, face)
    gap = float(near[near > back - SAME_MM].min()) - back
    # As far as there is room for the nuts, and as the screws are long.
    beyond = _longest_m5(context) - WASHER_MM - spec.frame.flange_mm - gap - GRIP_MM
    travel["out_mm"] = min(gap - TWO_NUTS_MM, beyond)
    yield from _fence_faults(context, fence, face)
    held = _places(context, fence, M5_HOLE_MM, 2)
    reach = _least_reach(held, _places(context, plate, M5_HOLE_MM, 2), 0)
    lever = float(np.abs(held[:, 1]).max(initial=SAME_MM))
    travel["yaw_deg"] = math.degrees(math.atan((reach - along) / lever))
    play = math.degrees(math.atan((M5_HOLE_MM - M5_MM) / spec.frame.flange_mm))
    for name, axis in (("roll_deg", 1), ("pitch_deg", 0)):
        half = float(np.ptp(inserts[:, axis])) / 2
        travel[name] = min(math.degrees(math.atan(travel["out_mm"] / half)), play)
    travel["along_plate_mm"] = _foot_travel(context, bracket)
    least = {**LEAST, "along_axis_mm": spec.frame.camera_travel_mm / 2}
    for name, value in travel.items():
        if value < least[name] - SHARE * max(1.0, least[name]):
            yield f"{name} is {value:.3f}, {least[name]:.2f} are needed"


def _axes(context: PrototypeContext) -> Floats:
    """(3, 3) rows: behind the pinhole, across, and out from the optical axis."""
    back = -context.camera.forward
    level, across, _ = context.level_axes
    out = level - (level @ back) * back
    return np.stack([back, across, out / np.linalg.norm(out)])


def _places(context: PrototypeContext, solid: TextSolid, diameter: float, along: int) -> Floats:
    """(n, 3) places of holes along one of the mount's axes, sorted."""
    return _holes(solid, diameter, _axes(context), along, context.pinhole)


def _holes(solid: TextSolid, diameter: float, axes: Floats, along: int, at: Floats) -> Floats:
    """(n, 3) places of holes along one of three axes, on them from a point, sorted."""
    found = [
        tuple(axes @ (hole.point - at))
        for hole in holes(solid.faces, diameter / 2, SAME_MM)
        if abs(hole.axis @ axes[along]) > 1 - SAME_MM
    ]
    return np.array(sorted(found)).reshape(-1, 3)


def _least_reach(screws: Floats, ends: Floats, along: int) -> float:
    """Least distance of screws from their slots' ends along an axis, mm; 0 without a slot."""
    other = 1 - along
    reach = []
    for screw in screws:
        off = (ends - screw)[np.abs(ends[:, other] - screw[other]) < SAME_MM, along]
        sides = [np.abs(off[sign * off > 0]).min(initial=np.inf) for sign in (1, -1)]
        reach.append(min(sides) if np.isfinite(sides).all() else 0.0)
    return float(min(reach, default=0.0))


def _foot_travel(context: PrototypeContext, bracket: TextSolid) -> float:
    """Half of what the bracket's foot can be moved along the base plate, mm."""
    ends = _holes(bracket, M5_HOLE_MM, context.level_axes, 2, np.zeros(3))
    travel = []
    for side in np.unique(np.round(ends[:, 1], 6)):
        row = np.sort(ends[np.abs(ends[:, 1] - side) < 1e-5, 0])
        travel += [(b - a) / 2 for a, b in zip(row[::2], row[1::2], strict=False)]
    return float(min(travel, default=0.0))


def _camera_faults(
    context: PrototypeContext, solids: Mapping[str, TextSolid], face: float
) -> Iterator[str]:
    """The camera stands on its plate, whose face is so far out, or on a step of the fence."""
    frame, axes = context.export.spec.prototype.frame, _axes(context)
    stands = frame.camera_axis_mm
    fence = (solids["camera_fence"].corners - context.pinhole) @ axes.T
    step = fence[fence[:, 0] < frame.camera_back_mm - SAME_MM, 2]
    heights = step if len(step) else np.array([face])
    if abs(heights.min() - stands) > SAME_MM or abs(heights.max() - face) > SAME_MM:
        yield f"the camera plate is {face:.3f} mm from the optical axis, without a step that fits"
    camera = solids.get("camera")
    if camera and "camera_lens" in solids:  # else a cylinder stands in for it
        ends = ((camera.corners - context.pinhole) @ axes.T).max(axis=0)
        if abs(ends[2] - stands) > SAME_MM:
            yield f"the camera stands {ends[2]:.2f} mm from its axis"
        if abs(ends[0] - frame.camera_back_mm) > SAME_MM:
            yield f"the camera's back is {ends[0]:.2f} mm behind the pinhole"


def _fence_faults(context: PrototypeContext, fence: TextSolid, face: float) -> Iterator[str]:
    """The fence lies on the plate, at the camera's back, high and wide enough to hold it."""
    frame = context.export.spec.prototype.frame
    corners = (fence.corners - context.pinhole) @ _axes(context).T
    lip = corners[corners[:, 2] < frame.camera_axis_mm - SAME_MM]  # beside the camera, over a step
    if not len(lip):
        yield "the fence does not reach the camera"
        return
    low, high = lip.min(axis=0), lip.max(axis=0)
    if abs(low[0] - frame.camera_back_mm) > SAME_MM:
        yield f"the fence is {low[0]:.2f} mm behind the pinhole"
    if abs(corners[:, 2].max() - face) > SAME_MM:
        yield "the fence does not lie on the camera plate"
    if frame.camera_axis_mm - low[2] < LIP_MM or high[1] - low[1] < LIP_WIDTH_MM:
        yield "the fence does not keep the camera from turning"


def _longest_m5(context: PrototypeContext) -> float:
    some = [one.part for one in context.prototype.fasteners if "camera_plate" in one.through]
    found = [re.fullmatch(r"M5x([\d.]+)", part) for part in some]
    return max((float(one[1]) for one in found if one), default=0.0)

"""Parts on the base plate: feet of the uprights, clamp of the post."""

import numpy as np

from tbcad.core.geometry.primitives import (
    Component,
    Cylinder,
    Primitive,
    box,
    cylinder_between,
    rectangle,
)
from tbcad.core.spec.prototype import FrameSpec
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.purchased import (
    CLEARANCE_HOLE_MM,
    EXTRUSION_MM,
    HALF_FLANGE_MM,
    OVERLAP_MM,
    THROUGH_MM,
    Bracket,
    drilled_holes,
    level_prism,
    on_uprights,
    webs,
)
from tbcad.prototype.purchased.parts import Parts, choose_screw
from tbcad.prototype.stage.layout import StageLayout
from tbcad.types import Floats

M5_HOLE_MM = CLEARANCE_HOLE_MM[5.0]
M5_HEAD_MM = 8.5

# Feet of the uprights.
FOOT_HEIGHT_MM, FOOT_DEPTH_MM = 50.0, 48.0
FOOT_WEB_MM = 15.0  # from the middle to the webs
FOOT_SCREW_MM = 13.0  # from the foot's ends to its screws
WEB_SETBACK_MM = 4.0  # of webs from the ends of their flanges

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


def upright_foot(spec: FrameSpec, axes: Floats, face: float, side: int, parts: Parts) -> Bracket:
    """A foot on the front (side 1) or the back (side -1) of both uprights.

    face is the level coordinate of the uprights' front; axes (3, 3) are the frame's, as rows.
    """
    low, thick, half = spec.floor_mm, spec.flange_mm, spec.uprights_mm / 2 + HALF_FLANGE_MM
    start = face if side > 0 else face - EXTRUSION_MM

    def at(depth: float, height: float) -> tuple[float, float]:
        return start + side * depth, low + height

    def plate(depth: float, height: float) -> Primitive:
        (x0, z0), (x1, z1) = at(0.0, 0.0), at(depth, height)
        return level_prism(rectangle((min(x0, x1), z0), (max(x0, x1), z1)), -half, half, axes)

    inside = thick - OVERLAP_MM
    corners = np.array(
        [
            at(inside, inside),
            at(FOOT_DEPTH_MM - WEB_SETBACK_MM, inside),
            at(inside, FOOT_HEIGHT_MM - WEB_SETBACK_MM),
        ]
    )
    added = [plate(thick, FOOT_HEIGHT_MM), plate(FOOT_DEPTH_MM, thick)]
    added += webs(corners, FOOT_WEB_MM, spec.web_mm, axes)
    screw, _ = at(FOOT_DEPTH_MM - FOOT_SCREW_MM, 0.0)
    _, height = at(0.0, FOOT_HEIGHT_MM - FOOT_SCREW_MM)
    across = (-spec.uprights_mm / 2, spec.uprights_mm / 2)
    under = [np.array([screw, y, low]) @ axes for y in across]
    in_uprights = [np.array([start, y, height]) @ axes for y in across]
    removed = drilled_holes(under, thick * axes[2], M5_HOLE_MM)
    removed += drilled_holes(in_uprights, side * thick * axes[0], M5_HOLE_MM)
    component = Component(
        "upright_foot_front" if side > 0 else "upright_foot_back",
        "foot of the uprights",
        tuple(added),
        tuple(removed),
        (-axes[2], -side * axes[0]),
    )
    ends = (start, start + side * FOOT_DEPTH_MM)
    foot = np.array([[x, y] for x in ends for y in (-half, half)])
    in_plate = np.array([[screw, y] for y in across])
    inward = -side * axes[0]
    fasteners = on_uprights(component.name, in_uprights, inward, thick, parts)
    return Bracket(component, in_plate, foot, fasteners)


def stage_foot(spec: FrameSpec, axes: Floats, stage: StageLayout, parts: Parts) -> Bracket:
    """A clamp round the post, with a channel for the wires below."""
    low, radius, up = spec.floor_mm, stage.sizes.post + COLLAR_WALL_MM, axes[2]
    ear, top = radius + EAR_LENGTH_MM, low + COLLAR_HEIGHT_MM
    # Screws on the diagonals clear the collar, and beside the ears these.
    beside_collar = (radius + M5_HEAD_MM / 2 + HEAD_TO_COLLAR_MM) / np.sqrt(2)
    screw = max(beside_collar, EAR_MM + M5_HEAD_MM / 2 + HEAD_TO_EAR_MM)
    half = screw + CLAMP_EDGE_MM
    end = max(half, ear + BEYOND_EAR_MM)
    base, middle = np.array([0.0, 0.0, low]), np.array([0.0, 0.0, stage.foot])
    added = (
        box(np.array([-half, -half, low]), np.array([end, half, stage.foot]), axes),
        Cylinder(base, up, radius, COLLAR_HEIGHT_MM),
        box(
            np.array([stage.sizes.post + EAR_ROOT_MM, -EAR_MM, low]),
            np.array([ear, EAR_MM, top]),
            axes,
        ),
    )
    holes = screw * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    places = [np.array([*hole, low]) @ axes for hole in holes]
    wire = min(stage.sizes.post - WIRE_WALL_MM, MAX_WIRE_MM)
    width = CHANNEL_WIDTH_MM / 2
    height = min(CHANNEL_HEIGHT_MM, spec.flange_mm - CHANNEL_ROOF_MM)
    channel = np.array([-width, -half - THROUGH_MM, low - THROUGH_MM])
    clamp, fasteners = _clamp(axes, stage, ear, top, parts)
    removed = (
        Cylinder(middle, up, stage.sizes.post + spec.post_play_mm / 2, COLLAR_HEIGHT_MM),
        Cylinder(base - THROUGH_MM * up, up, wire, COLLAR_HEIGHT_MM),
        *clamp,
        *drilled_holes(places, spec.flange_mm * up, M5_HOLE_MM),
        box(channel, np.array([width, 0.0, low + height]), axes),
    )
    component = Component(
        "stage_foot",
        "clamp of the stage's post",
        added,
        removed,
        (-up, up),
    )
    foot = np.array([[-half, -half], [end, half]])
    return Bracket(component, holes, foot, fasteners)


def _clamp(
    axes: Floats, stage: StageLayout, ear: float, top: float, parts: Parts
) -> tuple[list[Primitive], tuple[Fastener, ...]]:
    """Slit, holes of screw and insert across it; the screw in one ear, its insert in the other."""
    insert, low = parts[CLAMP_INSERT], stage.foot + SLIT_FLOOR_MM
    slit = np.array([0.0, -SLIT_MM / 2, low])
    end = np.array([ear + BEYOND_EAR_MM, SLIT_MM / 2, top + THROUGH_MM])
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

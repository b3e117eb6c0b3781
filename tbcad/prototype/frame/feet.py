"""Parts on the base plate: feet of the uprights, clamp of the post, bracket of the camera."""

import numpy as np

from tbcad.geometry.primitives import (
    Component,
    Cylinder,
    Primitive,
    box,
    cylinder_between,
    rectangle,
    slot,
)
from tbcad.geometry.vectors import unit
from tbcad.optics.camera import Camera
from tbcad.prototype.frame.brackets import (
    CLEARANCE_HOLE_MM,
    EXTRUSION_MM,
    HALF_FLANGE_MM,
    OVERLAP_MM,
    THROUGH_MM,
    Bracket,
    drilled_holes,
    level_prism,
    webs,
)
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import FrameSpec, PrototypeSpec
from tbcad.types import Floats

M5_HOLE_MM = CLEARANCE_HOLE_MM[5.0]
M5_HEAD_MM = 8.5
TRIPOD_HOLE_MM = CLEARANCE_HOLE_MM[6.35]

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
INSERT_PLAY_MM = 0.4  # of the insert's hole beyond it
WIRE_WALL_MM, MAX_WIRE_MM = 3.0, 4.0  # post beside the wires' hole, and its largest radius
CHANNEL_WIDTH_MM, CHANNEL_HEIGHT_MM = 6.0, 4.5
CHANNEL_ROOF_MM = 3.0  # material above the channel

# Bracket of the camera.
MOUNT_HALF_MM = 25.0  # half width of the plate that carries the camera
MOUNT_START_MM = 15.0  # of plate beyond the slot
MOUNT_WEB_MM = 10.0  # from the plate's upper end to the webs
BRACKET_FOOT_MM = 70.0  # length of the foot beyond the plate
FOOT_BORDER_MM = 18.0  # of the foot beside the plate
FOOT_TRAVEL_MM = 10.0
SLOT_SIDE_MM, SLOT_INNER_MM, SLOT_OUTER_MM = 9.0, 20.0, 14.0  # from the foot's edges to its slots
AXIAL = 1e-6  # largest part of the camera's direction out of the frame's plane


def upright_foot(spec: FrameSpec, axes: Floats, face: float, side: int) -> Bracket:
    """A foot on the front (side 1) or the back (side -1) of both uprights.

    Args:
        spec: section of the frame.
        axes: of the frame, as rows, (3, 3).
        face: level coordinate of the uprights' front.
        side: on which the foot is.
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
    in_plate = [np.array([screw, y, low]) @ axes for y in across]
    in_uprights = [np.array([start, y, height]) @ axes for y in across]
    removed = drilled_holes(in_plate, thick * axes[2], M5_HOLE_MM)
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
    return Bracket(component, np.array([[screw, y] for y in across]), foot)


def stage_foot(spec: FrameSpec, axes: Floats, stage: StageLayout, insert: PurchasedPart) -> Bracket:
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
    removed = (
        Cylinder(middle, up, stage.sizes.post + spec.post_play_mm / 2, COLLAR_HEIGHT_MM),
        Cylinder(base - THROUGH_MM * up, up, wire, COLLAR_HEIGHT_MM),
        *_clamp(axes, stage, ear, top, insert),
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
    return Bracket(component, holes, np.array([[-half, -half], [end, half]]))


def _clamp(
    axes: Floats, stage: StageLayout, ear: float, top: float, insert: PurchasedPart
) -> list[Primitive]:
    """Slit, screw's hole across it, and the insert's hole."""
    low = stage.foot + SLIT_FLOOR_MM
    slit = np.array([0.0, -SLIT_MM / 2, low])
    end = np.array([ear + BEYOND_EAR_MM, SLIT_MM / 2, top + THROUGH_MM])
    screw = np.array([ear - EAR_LENGTH_MM / 2, 0.0, (low + top) / 2 + SLIT_FLOOR_MM])
    outside = np.array([0.0, EAR_MM + THROUGH_MM, 0.0])
    inside = np.array([0.0, EAR_MM - insert["length_mm"] - INSERT_PLAY_MM, 0.0])
    hole = CLEARANCE_HOLE_MM[insert["thread_mm"]] / 2
    return [
        box(slit, end, axes),
        cylinder_between((screw - outside) @ axes, (screw + outside) @ axes, hole),
        cylinder_between((screw + inside) @ axes, (screw + outside) @ axes, insert["hole_mm"] / 2),
    ]


def camera_bracket(spec: PrototypeSpec, axes: Floats, camera: Camera) -> Bracket:
    """A plate along the camera's axis, on its outer side, with a slot for its tripod thread.

    Raises:
        SpecError: when the camera does not look along the frame's plane, its thread lies beyond
            its end, or it reaches the base plate.
    """
    _check_camera(spec, axes, camera)
    frame, back, radius = spec.frame, -(axes @ camera.forward), spec.camera_diameter_mm / 2
    out = unit(np.array([1.0, 0.0, 0.0]) - back[0] * back)
    pinhole, low = axes @ camera.pinhole, frame.floor_mm

    def at(along: float, away: float) -> Floats:
        """Point (level, up) behind the pinhole, away from the camera's axis."""
        return np.asarray((pinhole + along * back + away * out)[[0, 2]])

    def at_height(height: float, away: float) -> Floats:
        """Point (level, up) of a line along the camera's axis."""
        start = at(0.0, away)
        return np.asarray(start + (height - start[1]) / back[2] * back[[0, 2]])

    first = frame.camera_screw_mm - frame.camera_travel_mm / 2 - MOUNT_START_MM
    near, far = radius, radius + frame.flange_mm
    mount = np.array([at(first, near), at_height(low, near), at_height(low, far), at(first, far)])
    start, end = float(mount[1, 0]), float(mount[2, 0]) + BRACKET_FOOT_MM
    inside, high = far - OVERLAP_MM, low + frame.flange_mm - OVERLAP_MM
    web = np.array(
        [at(first + MOUNT_WEB_MM, inside), at_height(high, inside), [end - WEB_SETBACK_MM, high]]
    )
    half = MOUNT_HALF_MM + FOOT_BORDER_MM
    foot = rectangle((start, low), (end, low + frame.flange_mm))
    added = [
        level_prism(mount, -MOUNT_HALF_MM, MOUNT_HALF_MM, axes),
        level_prism(foot, -half, half, axes),
        *webs(web, MOUNT_HALF_MM - frame.web_mm, frame.web_mm, axes),
    ]
    beside = half - SLOT_SIDE_MM
    ends = (start + SLOT_INNER_MM, end - SLOT_OUTER_MM)
    holes = np.array([[x, y] for x in ends for y in (-beside, beside)])
    component = Component(
        "camera_bracket",
        "bracket of the camera",
        tuple(added),
        (*_camera_slot(frame, axes, camera, out, radius), *_foot_slots(frame, axes, holes)),
        (-out @ axes, -axes[2], out @ axes, axes[1]),
    )
    return Bracket(component, holes, np.array([[start, -half], [end, half]]))


def _camera_slot(
    spec: FrameSpec, axes: Floats, camera: Camera, out: Floats, radius: float
) -> tuple[Primitive, ...]:
    away = out @ axes
    on_axis = camera.pinhole - spec.camera_screw_mm * camera.forward
    start, depth = on_axis + (radius - THROUGH_MM) * away, (spec.flange_mm + 2 * THROUGH_MM) * away
    return slot(start, camera.forward, spec.camera_travel_mm, TRIPOD_HOLE_MM / 2, depth)


def _foot_slots(spec: FrameSpec, axes: Floats, holes: Floats) -> list[Primitive]:
    low, depth = spec.floor_mm - THROUGH_MM, (spec.flange_mm + 2 * THROUGH_MM) * axes[2]
    starts = [np.array([*hole, low]) @ axes for hole in holes]
    return [
        body
        for start in starts
        for body in slot(start, axes[0], FOOT_TRAVEL_MM, M5_HOLE_MM / 2, depth)
    ]


def _check_camera(spec: PrototypeSpec, axes: Floats, camera: Camera) -> None:
    frame, travel = spec.frame, spec.frame.camera_travel_mm / 2
    if abs(float(camera.forward @ axes[1])) > AXIAL:
        raise SpecError(
            "the camera does not look along the plane of the frame, so there is no bracket for it: "
            "set the second number of optics.camera_mm to 0, or prototype.camera_diameter_mm to 0"
        )
    if frame.camera_screw_mm - travel < MOUNT_START_MM:
        raise SpecError(
            f"prototype.frame.camera_screw_mm {frame.camera_screw_mm:g} is too near to the "
            f"pinhole: make it {MOUNT_START_MM + travel:g} or more, or camera_travel_mm smaller"
        )
    if frame.camera_screw_mm > spec.camera_length_mm:
        raise SpecError(
            f"prototype.frame.camera_screw_mm {frame.camera_screw_mm:g} lies beyond the camera's "
            f"end: make it less than prototype.camera_length_mm {spec.camera_length_mm:g}"
        )
    end = camera.pinhole - spec.camera_length_mm * camera.forward
    lowest = end[2] - spec.camera_diameter_mm / 2 * np.hypot(*camera.forward[:2]) - travel
    if lowest < frame.floor_mm:
        raise SpecError(
            f"the camera reaches down to {lowest:.0f} mm, below the base plate: make "
            f"prototype.frame.floor_mm less than {lowest:.0f}"
        )

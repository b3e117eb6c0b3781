"""What stands on the base plate: feet of the uprights, clamp of the post, bracket of the camera."""

import numpy as np

from tbcad.geometry.primitives import Component, Cylinder, Primitive, box, cylinder_between, slot
from tbcad.geometry.vectors import unit
from tbcad.optics.camera import Camera
from tbcad.prototype.frame.brackets import (
    EXTRUSION_MM,
    HOLES_MM,
    SUNK_MM,
    THROUGH_MM,
    Bracket,
    drilled,
    slab,
    webs,
)
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import FrameSpec
from tbcad.spec.prototype import PrototypeSpec as ProtoKeys
from tbcad.types import Floats

TALL_MM, DEEP_MM = 50.0, 48.0  # of the uprights' feet
WEB_MM = 15.0  # from the middle to the feet's webs
COLLAR_MM, COLLAR_WALL_MM = 34.0, 8.0  # of the post's clamp, its height from the plate
SLIT_MM = 2.0
EAR_MM, EAR_LONG_MM = 11.0, 14.0  # half width and length of the clamp's ears
CHANNEL_MM = (6.0, 4.5)  # width and height
SCREW_HEAD_MM = 8.5  # M5
CAMERA_HALF_MM = 25.0  # of the camera's plate
CAMERA_FOOT_MM = 70.0
CAMERA_START_MM = 15.0  # of plate beyond the slot
FOOT_TRAVEL_MM = 10.0
AXIAL_MM = 1e-6


def upright_foot(keys: FrameSpec, axes: Floats, face: float, side: int) -> Bracket:
    """A foot on the front (side 1) or the back (side -1) of both uprights.

    Args:
        keys: section of the frame.
        axes: of the frame, as rows, (3, 3).
        face: level coordinate of the uprights' front.
        side: that it stands on.
    """
    low, thick = keys.floor_mm, keys.flange_mm
    start = face if side > 0 else face - EXTRUSION_MM
    half = keys.uprights_mm / 2 + 10

    def wide(near: float, far: float, bottom: float, top: float) -> Primitive:
        x0, x1 = sorted((start + side * near, start + side * far))
        return slab(np.array([[x0, bottom], [x1, bottom], [x1, top], [x0, top]]), -half, half, axes)

    inside = start + side * (thick - SUNK_MM)
    corners = np.array(
        [
            [inside, low + thick - SUNK_MM],
            [start + side * (DEEP_MM - 4), low + thick - SUNK_MM],
            [inside, low + TALL_MM - 4],
        ]
    )
    added = [wide(0, thick, low, low + TALL_MM), wide(0, DEEP_MM, low, low + thick)]
    added += webs(corners, WEB_MM, keys.web_mm, axes)
    out = start + side * (DEEP_MM - 13)
    across = [sign * keys.uprights_mm / 2 for sign in (-1, 1)]
    down = [np.array([out, y, low]) @ axes for y in across]
    sideways = [np.array([start, y, low + TALL_MM - 13]) @ axes for y in across]
    removed = drilled(down, thick * axes[2], HOLES_MM[5.0])
    removed += drilled(sideways, side * thick * axes[0], HOLES_MM[5.0])
    name = "upright_foot_front" if side > 0 else "upright_foot_back"
    item = Component(
        name,
        "foot of the uprights",
        tuple(added),
        tuple(removed),
        (_down(-axes[2]), _down(-side * axes[0])),
    )
    ends = (start, start + side * DEEP_MM)
    foot = np.array([[x, y] for x in ends for y in (-half, half)])
    return Bracket(item, np.array([[out, y] for y in across]), foot)


def stage_foot(keys: FrameSpec, axes: Floats, stage: StageLayout, insert: PurchasedPart) -> Bracket:
    """A clamp round the post, with a channel for the wires below."""
    low, radius = keys.floor_mm, stage.post + COLLAR_WALL_MM
    reach = max((radius + SCREW_HEAD_MM / 2 + 2) / np.sqrt(2), EAR_MM + SCREW_HEAD_MM / 2 + 1)
    half, ear, top = reach + 9, radius + EAR_LONG_MM, low + COLLAR_MM
    wire = min(stage.post - 3.0, 4.0)
    base = np.array([-half, -half, low]), np.array([max(half, ear + 1), half, stage.foot])
    ears = np.array([stage.post + 3, -EAR_MM, low]), np.array([ear, EAR_MM, top])
    middle = np.array([0.0, 0.0, low])
    added = (box(*base, axes), Cylinder(middle, axes[2], radius, COLLAR_MM), box(*ears, axes))
    places = reach * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    removed = [
        Cylinder(
            np.array([0, 0, stage.foot]), axes[2], stage.post + keys.post_play_mm / 2, COLLAR_MM
        ),
        Cylinder(middle - THROUGH_MM * axes[2], axes[2], wire, COLLAR_MM),
        *_clamp(axes, stage, ear, top, insert),
        *drilled([np.array([*p, low]) @ axes for p in places], keys.flange_mm * axes[2], 5.5),
    ]
    width, height = CHANNEL_MM[0] / 2, min(CHANNEL_MM[1], keys.flange_mm - 3)
    channel = np.array([-width, -half - 1, low - 1]), np.array([width, 0.0, low + height])
    removed.append(box(*channel, axes))
    item = Component(
        "stage_foot",
        "clamp of the stage's post",
        added,
        tuple(removed),
        (_down(-axes[2]), _down(axes[2])),
    )
    corners = np.array([[-half, -half], [max(half, ear + 1), half]])
    return Bracket(item, places, corners)


def _clamp(
    axes: Floats, stage: StageLayout, ear: float, top: float, insert: PurchasedPart
) -> list[Primitive]:
    """Slit, screw's hole across it, and the insert's hole."""
    low = stage.foot + 1
    slit = np.array([0.0, -SLIT_MM / 2, low]), np.array([ear + 1, SLIT_MM / 2, top + 1])
    at = np.array([ear - EAR_LONG_MM / 2, 0.0, (low + top) / 2 + 1])
    side = np.array([0.0, EAR_MM + THROUGH_MM, 0.0])
    deep = np.array([0.0, EAR_MM - insert["length_mm"] - 0.4, 0.0])
    return [
        box(*slit, axes),
        cylinder_between((at - side) @ axes, (at + side) @ axes, HOLES_MM[insert["thread_mm"]] / 2),
        cylinder_between((at + deep) @ axes, (at + side) @ axes, insert["hole_mm"] / 2),
    ]


def camera_bracket(keys: FrameSpec, axes: Floats, own: ProtoKeys, view: Camera) -> Bracket:
    """A plate along the camera's axis, on its outer side, with a slot for its tripod thread.

    Raises:
        SpecError: when the camera does not look along the frame's plane, its thread lies beyond
            its end, or it reaches the base plate.
    """
    _check_camera(keys, axes, own, view)
    back, radius = -(axes @ view.forward), own.camera_diameter_mm / 2
    out = unit(np.array([1.0, 0.0, 0.0]) - back[0] * back)
    pinhole, low, thick = axes @ view.pinhole, keys.floor_mm, keys.flange_mm

    def at(along: float, away: float) -> Floats:
        return np.asarray((pinhole + along * back + away * out)[[0, 2]])

    def down_to(height: float, away: float) -> Floats:
        start = at(0.0, away)
        return np.asarray(start + (height - start[1]) / back[2] * back[[0, 2]])

    first = keys.camera_screw_mm - keys.camera_travel_mm / 2 - CAMERA_START_MM
    near, far = radius, radius + thick
    mount = np.array([at(first, near), down_to(low, near), down_to(low, far), at(first, far)])
    start, end = float(mount[1, 0]), float(mount[2, 0]) + CAMERA_FOOT_MM
    inner = CAMERA_HALF_MM - keys.web_mm
    web = np.array(
        [
            at(first + 10, far - SUNK_MM),
            down_to(low + thick - SUNK_MM, far - SUNK_MM),
            [end - 4, low + thick - SUNK_MM],
        ]
    )
    half = CAMERA_HALF_MM + 18
    foot = np.array([[start, low], [end, low], [end, low + thick], [start, low + thick]])
    added = [
        slab(mount, -CAMERA_HALF_MM, CAMERA_HALF_MM, axes),
        slab(foot, -half, half, axes),
        *webs(web, inner, keys.web_mm, axes),
    ]
    places = np.array([[x, y] for x in (start + 20, end - 14) for y in (9 - half, half - 9)])
    item = Component(
        "camera_bracket",
        "bracket of the camera",
        tuple(added),
        (*_camera_slot(keys, axes, view, out, radius), *_foot_slots(keys, axes, places)),
        (_down(-out @ axes), _down(-axes[2]), _down(out @ axes), _down(axes[1])),
    )
    return Bracket(item, places, np.array([[start, -half], [end, half]]))


def _camera_slot(
    keys: FrameSpec, axes: Floats, view: Camera, out: Floats, radius: float
) -> tuple[Primitive, ...]:
    away = out @ axes
    start = view.pinhole - keys.camera_screw_mm * view.forward + (radius - THROUGH_MM) * away
    depth = (keys.flange_mm + 2 * THROUGH_MM) * away
    return slot(start, view.forward, keys.camera_travel_mm, HOLES_MM[6.35] / 2, depth)


def _foot_slots(keys: FrameSpec, axes: Floats, places: Floats) -> list[Primitive]:
    depth = (keys.flange_mm + 2 * THROUGH_MM) * axes[2]
    found: list[Primitive] = []
    for place in places:
        start = np.array([*place, keys.floor_mm - THROUGH_MM]) @ axes
        found += slot(start, axes[0], FOOT_TRAVEL_MM, HOLES_MM[5.0] / 2, depth)
    return found


def _check_camera(keys: FrameSpec, axes: Floats, own: ProtoKeys, view: Camera) -> None:
    if abs(float(view.forward @ axes[1])) > AXIAL_MM:
        raise SpecError(
            "the camera does not look along the plane of the frame, so there is no bracket for it: "
            "set the second number of optics.camera_mm to 0, or prototype.camera_diameter_mm to 0"
        )
    if keys.camera_screw_mm - keys.camera_travel_mm / 2 < CAMERA_START_MM:
        raise SpecError(
            f"prototype.frame.camera_screw_mm {keys.camera_screw_mm:g} is too near to the pinhole: "
            f"make it {CAMERA_START_MM + keys.camera_travel_mm / 2:g} or more, or "
            "camera_travel_mm smaller"
        )
    if keys.camera_screw_mm > own.camera_length_mm:
        raise SpecError(
            f"prototype.frame.camera_screw_mm {keys.camera_screw_mm:g} lies beyond the camera's "
            f"end: make it less than prototype.camera_length_mm {own.camera_length_mm:g}"
        )
    end = view.pinhole - own.camera_length_mm * view.forward
    lowest = end[2] - own.camera_diameter_mm / 2 * np.hypot(*view.forward[:2])
    travel = keys.camera_travel_mm / 2
    if lowest - travel < keys.floor_mm:
        raise SpecError(
            f"the camera reaches down to {lowest - travel:.0f} mm, below the base plate: make "
            f"prototype.frame.floor_mm less than {lowest - travel:.0f}"
        )


def _down(direction: Floats) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in direction)
    return x, y, z

"""The camera's mount: a bracket on the base plate, a plate on three screws, a fence.

Six ways to move, each with screws of its own. The bracket's foot slides along the plate; three
screws between bracket and camera plate set the distance, roll and pitch; their slots in the bracket
let it slide across. On the camera plate the camera slides along its optical axis, and turns (yaw)
about the tripod screw. The fence below the camera, with two slots of its own, holds both, and keeps
the camera from turning on a screw that does not. Where the lens is wider than the camera's foot is
high, the fence has a step that the camera stands on, and slides with it.

Lengths are behind the pinhole along the optical axis, across, and out from the axis.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import (
    Component,
    Cylinder,
    Primitive,
    cylinder_between,
    enclosing_triangles,
    rectangle,
    slot,
)
from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.chosen_camera import ChosenCamera, chosen_camera, with_camera
from tbcad.prototype.frame.mount_place import (
    FENCE_HALF_MM,
    FENCE_MM,
    FENCE_SCREW_MM,
    GAP_MM,
    M5_HOLE_MM,
    M5_MM,
    PLATE_MM,
    TOP_MM,
    TRIPOD_HOLE_MM,
    YAW_DEG,
    MountPlace,
)
from tbcad.prototype.frame.shared import OVERLAP_MM, THROUGH_MM, level_prism, webs
from tbcad.prototype.part import Bracket, FrameLayout, Mounted, Part, Site, frame_axes
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_screw
from tbcad.records.prototype import CameraTravel
from tbcad.types import Floats

NUT, WASHER, INSERT = "NUT-M5", "WASHER-5", "INSERT-M5"
NUT_MM, WASHER_MM = 4.7, 1.0

# Travel to either side. Printed brackets are off by 0.5 mm and a degree; the rest is for cameras.
ALONG_PLATE_MM, ACROSS_MM, OUT_MM = 5.0, 5.0, 3.0
ROLL_DEG, PITCH_DEG = 3.0, 2.0  # as far as the screws' play in the bracket lets it

# The tripod screw: thread, least of the plate below its head, and in the camera (ISO 1222).
TRIPOD_THREAD_MM, TRIPOD_MM, IN_CAMERA_MM = 6.35, 6.0, 4.7
RISER_HALF_MM, RISER_END_MM = 15.0, 1.0  # half width, and from the lens's flange to its end
HALF_PLATE_MM = 30.0
MIN_ENGAGEMENT_MM = 4.0  # of a screw in its insert at the farthest
RECESS_MM = 9.0  # half width of the recess and the window for the tripod screw's head and its key
WINDOW_WALL_MM = 2.0  # between window and the upper screws' slots
HEAD_HOLE_MM, HEAD_DEPTH_MM = 9.0, 8.0  # counterbore of the fence's screws

# The bracket's foot.
MOUNT_WEB_MM = 10.0  # from the bracket's upper end to the webs
BRACKET_FOOT_MM = 70.0  # length of the foot beyond the bracket
FOOT_BORDER_MM = 15.0  # of the foot beside the bracket: washers clear the webs by 1 mm
WEB_SETBACK_MM = 4.0  # of webs from the ends of their flanges
SLOT_SIDE_MM, SLOT_INNER_MM, SLOT_OUTER_MM = 9.0, 20.0, 14.0  # from the foot's edges to its slots
REMEDY = "prototype.frame.camera another, or auto, or prototype.camera_diameter_mm smaller"
SAME_MM = 1e-6
AXIAL = 1e-6  # largest part of the camera's direction out of the frame's plane


@dataclass(frozen=True, kw_only=True)
class CameraMount(Mounted):
    """The bracket on the base plate, the camera's plate on three screws, and the fence on that."""

    travel: CameraTravel  # how far the camera moves to either side
    chosen: ChosenCamera | None  # camera that it is made for; None: a cylinder stands in for it
    riser: float  # height of the fence's step, between camera and camera plate, mm


def camera_mount(site: Site, _: FrameLayout) -> CameraMount | None:
    """Bracket, plate and fence for a camera, and its bodies; None without a camera.

    SpecError when there is no such camera, it does not look along the frame's plane, its thread
    lies beyond its end, or camera or mount reach the base plate.
    """
    array, parts = site.layout.array, site.parts
    place = _checked_place(site.spec, array, site.axes, parts)
    if place is None:
        return None
    spec = place.spec
    play = float(np.degrees(np.arctan((M5_HOLE_MM - M5_MM) / spec.frame.flange_mm)))
    return CameraMount(
        brackets=(_bracket(place),),
        printed=(_plate(place, parts), _fence(place)),
        purchased=_camera(place),
        fasteners=_fasteners(place, parts),
        travel=CameraTravel(
            along_axis_mm=place.along,
            across_mm=ACROSS_MM,
            out_mm=OUT_MM,
            along_plate_mm=ALONG_PLATE_MM,
            yaw_deg=YAW_DEG,
            roll_deg=min(ROLL_DEG, play),
            pitch_deg=min(PITCH_DEG, play),
        ),
        chosen=place.chosen,
        riser=place.riser,
    )


def check_camera(spec: Spec, array: MirrorArray, parts: Parts) -> None:
    """Refuse a camera that no arrangement of balls has room for; SpecError as of `camera_mount`."""
    _checked_place(spec, array, frame_axes(unit(array.camera.pinhole)), parts)


def _checked_place(spec: Spec, array: MirrorArray, axes: Floats, parts: Parts) -> MountPlace | None:
    if not spec.prototype.camera_diameter_mm:
        return None
    keys, chosen = with_camera(spec, array).prototype, chosen_camera(spec, array)
    place = MountPlace(keys, axes, array.camera, parts[INSERT], chosen)
    _check_camera(place, _camera(place))
    return place


def _camera(place: MountPlace) -> tuple[Component, ...]:
    """The camera's outline and its lens, or a cylinder in their place."""
    camera, chosen = place.camera, place.chosen
    if chosen is None:
        stand_in = Cylinder(camera.pinhole, -camera.forward, place.axis, place.back)
        return (Component("camera", "camera behind its pinhole", (stand_in,)),)
    body, lens, wide = chosen.best.camera, chosen.best.lens, chosen.half_width
    top = place.axis - (body.body_height_mm or 0.0)
    outline = place.block((chosen.flange, -wide, top), (chosen.back, wide, place.axis))
    start, end = (place.point(back, 0.0, 0.0) for back in (chosen.front, chosen.flange))
    barrel = cylinder_between(start, end, chosen.lens_radius)
    return (
        Component("camera", body.name, (outline,)),
        Component("camera_lens", lens.name, (barrel,)),
    )


def _fasteners(place: MountPlace, parts: Parts) -> tuple[Fastener, ...]:
    """Three screws with two nuts and two washers each, two of the fence, the tripod screw."""
    screws = [
        *(_tilting_screw(place, back, across, parts) for back, across in place.screws.tolist()),
        *(_fence_screw(place, side * FENCE_SCREW_MM, parts) for side in (-1, 1)),
    ]
    screw, below = _tripod_screw(place, parts)
    at = place.point(place.tripod, 0.0, place.radius + below)
    step = ("camera_fence",) if _has_step(place) else ()
    through = ("camera_plate", *step, "camera")
    tripod = Fastener(screw, at, -place.own[2], through)
    return (*(one for some in screws for one in some), tripod)


def _tripod_screw(place: MountPlace, parts: Parts) -> tuple[PurchasedPart, float]:
    """The tripod screw, and what its head leaves of the plate."""
    length = TRIPOD_MM + place.riser + IN_CAMERA_MM
    screw = choose_screw(parts, TRIPOD_THREAD_MM, length)
    return screw, screw["length_mm"] - place.riser - IN_CAMERA_MM


def _tilting_screw(
    place: MountPlace, back: float, across: float, parts: Parts
) -> tuple[Fastener, ...]:
    """A screw through the bracket into the plate's insert, with a nut against either."""
    flange, out = place.spec.frame.flange_mm, place.own[2]
    length = WASHER_MM + flange + GAP_MM + OUT_MM + MIN_ENGAGEMENT_MM
    screw, washer, nut = choose_screw(parts, M5_MM, length), parts[WASHER], parts[NUT]
    bracket, plate = ("camera_bracket",), ("camera_plate",)
    face, inner = place.bracket_at + flange, place.bracket_at

    def at(away: float) -> Floats:
        return place.point(back, across, away)

    return (
        Fastener(washer, at(face), -out, bracket),
        Fastener(screw, at(face + WASHER_MM), -out, bracket + plate),
        Fastener(washer, at(inner), out, bracket),
        Fastener(nut, at(inner - WASHER_MM), -out, bracket),
        Fastener(nut, at(place.radius + PLATE_MM), out, plate),
        Fastener(place.insert, at(place.radius + PLATE_MM), -out, plate),
    )


def _fence_screw(place: MountPlace, across: float, parts: Parts) -> tuple[Fastener, ...]:
    """A screw from the fence through the plate into a nut on a washer."""
    out, plate = place.own[2], ("camera_plate",)
    length = place.fence_height - HEAD_DEPTH_MM + PLATE_MM + WASHER_MM + NUT_MM
    head, face = place.radius - place.fence_height + HEAD_DEPTH_MM, place.radius + PLATE_MM

    def at(away: float) -> Floats:
        return place.point(place.fence_screws, across, away)

    return (
        Fastener(choose_screw(parts, M5_MM, length), at(head), out, ("camera_fence", *plate)),
        Fastener(parts[WASHER], at(face), -out, plate),
        Fastener(parts[NUT], at(face + WASHER_MM), out, plate),
    )


def _plate(place: MountPlace, parts: Parts) -> Component:
    """The plate that carries the camera: inserts for three screws, slots for tripod and fence."""
    near, far = place.radius, place.radius + PLATE_MM
    through = (near - THROUGH_MM, far + THROUGH_MM)
    screw, recess, (_, below) = place.tripod, place.recess, _tripod_screw(place, parts)
    tripod = place.point(screw, 0.0, through[0])
    depth = (through[1] - through[0]) * place.own[2]
    removed: list[Primitive] = [
        place.hole(back, across, through, place.insert["hole_mm"])
        for back, across in place.screws.tolist()
    ]
    removed.append(slot(tripod, place.own[0], 2 * place.along, TRIPOD_HOLE_MM / 2, depth))
    removed.append(
        place.block(
            (screw - recess, -RECESS_MM, near + below), (screw + recess, RECESS_MM, through[1])
        )
    )
    for across in (-FENCE_SCREW_MM, FENCE_SCREW_MM):
        at = (place.fence_screws, across)
        removed.append(place.slot(at, 0, place.fence_travel, through))
    body = place.block((TOP_MM, -HALF_PLATE_MM, near), (place.plate_end, HALF_PLATE_MM, far))
    out = place.own[2]
    what = "plate of the camera, on three screws"
    return Component("camera_plate", what, (body,), tuple(removed), (-out, out))


def _has_step(place: MountPlace) -> bool:
    return place.chosen is not None and place.riser > 0


def _step(place: MountPlace) -> tuple[Primitive, Primitive]:
    """The step that keeps the lens clear of the plate, and the hole of the tripod screw in it."""
    assert place.chosen is not None
    start, half = place.chosen.flange + RISER_END_MM, max(RISER_HALF_MM, place.chosen.half_width)
    end = place.back + OVERLAP_MM
    body = place.block((start, -half, place.axis), (end, half, place.radius))
    ends = place.axis - THROUGH_MM, place.radius + THROUGH_MM
    return body, place.hole(place.tripod, 0.0, ends, TRIPOD_HOLE_MM)


def _fence(place: MountPlace) -> Component:
    """The bar below the camera that its back lies against, with its step where it needs one."""
    near, far = place.radius - place.fence_height, place.radius
    start = place.back
    added: list[Primitive] = [
        place.block((start, -FENCE_HALF_MM, near), (start + FENCE_MM, FENCE_HALF_MM, far))
    ]
    removed: list[Primitive] = []
    for across in (-FENCE_SCREW_MM, FENCE_SCREW_MM):
        at, head = (place.fence_screws, across), near + HEAD_DEPTH_MM
        removed.append(place.hole(*at, (near, far + THROUGH_MM), M5_HOLE_MM))
        removed.append(place.hole(*at, (near - THROUGH_MM, head), HEAD_HOLE_MM))
    if _has_step(place):
        body, hole = _step(place)
        added.append(body)
        removed.append(hole)
    what = "fence that keeps the camera from turning"
    out = place.own[2]
    return Component("camera_fence", what, tuple(added), tuple(removed), (out, -out))


def _bracket(place: MountPlace) -> Bracket:
    """The bracket on the base plate: slots across for three screws, a window for the key."""
    frame, axes, low = place.spec.frame, place.axes, place.spec.frame.floor_mm
    near, far = place.bracket_at, place.bracket_at + frame.flange_mm

    def at(back: float, out: float) -> Floats:
        """Point (level, up) of the camera's own axes."""
        return (axes @ place.point(back, 0.0, out))[[0, 2]]

    def at_height(height: float, out: float) -> Floats:
        """Point (level, up) of a line along the camera's axis."""
        start, back = at(0.0, out), (axes @ place.own[0])[[0, 2]]
        return np.asarray(start + (height - start[1]) / back[1] * back)

    mount = np.array([at(TOP_MM, near), at_height(low, near), at_height(low, far), at(TOP_MM, far)])
    first, end = float(mount[1, 0]), float(mount[2, 0]) + BRACKET_FOOT_MM
    inside, high = far - OVERLAP_MM, low + frame.flange_mm - OVERLAP_MM
    web = np.array(
        [at(TOP_MM + MOUNT_WEB_MM, inside), at_height(high, inside), [end - WEB_SETBACK_MM, high]]
    )
    half = HALF_PLATE_MM + FOOT_BORDER_MM
    foot = rectangle((first, low), (end, low + frame.flange_mm))
    added = [
        level_prism(mount, -HALF_PLATE_MM, HALF_PLATE_MM, axes),
        level_prism(foot, -half, half, axes),
        *webs(web, HALF_PLATE_MM - frame.web_mm, frame.web_mm, axes),
    ]
    beside, ends = half - SLOT_SIDE_MM, (first + SLOT_INNER_MM, end - SLOT_OUTER_MM)
    holes = np.array([[x, y] for x in ends for y in (-beside, beside)])
    through, out = (near - THROUGH_MM, far + THROUGH_MM), place.own[2]
    depth = (frame.flange_mm + 2 * THROUGH_MM) * axes[2]
    starts = [np.array([*hole, low - THROUGH_MM]) @ axes for hole in holes]
    key, window = place.tripod, place.window
    removed = (
        *(place.slot((x, y), 1, ACROSS_MM, through) for x, y in place.screws.tolist()),
        # Through a window the tripod screw is turned.
        place.block((key - window, -RECESS_MM, through[0]), (key + window, RECESS_MM, through[1])),
        *(slot(start, axes[0], 2 * ALONG_PLATE_MM, M5_HOLE_MM / 2, depth) for start in starts),
    )
    component = Component(
        "camera_bracket",
        "bracket of the camera",
        tuple(added),
        removed,
        (-out, -axes[2], out, axes[1]),
    )
    return Bracket(component, holes, np.array([[first, -half], [end, half]]))


def _check_camera(place: MountPlace, bodies: tuple[Component, ...]) -> None:
    frame, along, chosen = place.spec.frame, place.along, place.chosen
    if abs(float(place.camera.forward @ place.axes[1])) > AXIAL:
        raise SpecError(
            "the camera does not look along the plane of the frame, so there is no bracket for it: "
            "set the second number of optics.camera_mm to 0, or prototype.camera_diameter_mm to 0"
        )
    nearest = place.screws[0, 0] + M5_HOLE_MM / 2 + WINDOW_WALL_MM + place.window
    if place.tripod < nearest:
        raise SpecError(
            f"prototype.frame.camera_screw_mm {place.tripod:g} is too near to the "
            f"pinhole: make it {np.ceil(nearest):g} or more, or camera_travel_mm smaller"
        )
    if place.tripod > place.back:
        raise SpecError(
            f"prototype.frame.camera_screw_mm {place.tripod:g} lies beyond the camera's "
            f"end: make it less than {place.back:g}, where prototype.frame.camera_back_mm has it"
        )
    if chosen and place.back < chosen.back - SAME_MM:
        raise SpecError(
            f"the fence would stand in the camera, whose back is {chosen.back:g} mm behind the "
            "pinhole: set prototype.frame.camera_back_mm to that, or to auto"
        )
    ends = [place.point(place.plate_end, 0.0, out) for out in (place.radius, place.bracket_at)]
    points = [enclosing_triangles(one).reshape(-1, 3) for body in bodies for one in body.added]
    lowest = float((np.vstack(points) + along * place.own[0])[:, 2].min())
    lowest = min(lowest, *(float(end[2]) for end in ends))
    if lowest < frame.floor_mm:
        raise SpecError(
            f"the camera reaches down to {lowest:.0f} mm, below the base plate: make "
            f"prototype.frame.floor_mm less than {lowest:.0f}"
        )


@planned(
    "Bracket, plate and fence of the camera",
    *("camera_bracket", "camera_plate", "camera_fence", "camera", "camera_lens"),
)
def camera_step(machine: AssembledMachine) -> Values:
    """The camera's mount."""
    stands = any({"camera_fence", "camera"} <= {*one.through} for one in machine.fasteners)
    named = " The mount is made for the camera and the lens that the picture names."
    return {
        "gap": GAP_MM,
        "made_for": when(machine.has("camera_lens"), named),
        "step": when(stands, " on the fence's step"),
    }


CAMERA = Part((camera_step,), camera_mount, remedies={"camera*": REMEDY})

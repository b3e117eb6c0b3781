"""What brackets of the frame share, and purchased parts of its head in their places."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import (
    Component,
    Cylinder,
    Primitive,
    Prism,
    box,
    cylinder_between,
)
from tbcad.core.geometry.rotations import bolt_circle
from tbcad.core.spec.prototype import FrameSpec
from tbcad.prototype.base.fasteners import COUPLING_FLANGE_MM
from tbcad.prototype.base.hub import SCREW_MM
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive, pitch_diameter
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_screw
from tbcad.types import Floats

PLATE_MM = 9.0  # so that M3x12 screws go 3 mm into a motor
COUPLING_MM = 14.0  # length of a flange coupling with its gap to the motor; no list gives it
COUPLING_COLLAR_MM = 10.0  # diameter of its collar; see tbcad.prototype.base.hub
COUPLING_GAP_MM = 2.0  # between coupling and motor
PULLEY_RIM_MM = 1.5
SHAFT_END_MM = 2.0  # of the collar's bore beyond the shaft
# A stage of the 60 mm class; assumed: its height, its top's, and the gap below the top.
STAGE_HEIGHT_MM, STAGE_TOP_MM, STAGE_GAP_MM = 40.0, 12.0, 0.5
ENGAGEMENT_MM = 4.0  # smallest length of a screw beyond what it holds
MOTOR_THREAD_MM = 3.0  # length of a screw in the motor
TNUT, WASHER = "TNUT-M5-6", "WASHER-5"
# Diameters of clearance holes by ISO 273, medium, by thread (1/4 inch: 6.35).
CLEARANCE_HOLE_MM = {3.0: 3.4, 4.0: 4.5, 5.0: 5.5, 6.0: 6.6, 6.35: 6.6}
TAPPED_M5_MM = 4.2
EXTRUSION_MM = 20.0  # side of the uprights
HALF_FLANGE_MM = 10.0  # of flanges and feet beyond the middles of the uprights
THROUGH_MM = 1.0  # by which a removed body extends beyond the part
OVERLAP_MM = 2.0  # by which added bodies overlap, so that no faces coincide


@dataclass(frozen=True)
class Bracket:
    """A printed part that is screwed on."""

    component: Component  # the part itself
    # tapped holes that it needs in the base plate, (x, y) along the frame's axes, (h, 2)
    holes: Floats
    foot: Floats  # corners of its foot on the plate, the same, (f, 2)
    fasteners: tuple[Fastener, ...] = ()  # of it, but for those in the base plate


def frame_axes(axis: Floats) -> Floats:
    """Axes of the frame, as rows: level under the axis w (3,), across it, up, (3, 3)."""
    level = np.array([axis[0], axis[1], 0.0]) / np.hypot(*axis[:2])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([level, np.cross(up, level), up])


def level_prism(corners: Floats, low: float, high: float, axes: Floats) -> Prism:
    """A convex polygon (n, 2) of (level, up) between two places across, mm."""
    x, z = corners.T
    at = np.column_stack([x, np.full(len(x), low), z])
    return Prism(at @ axes, (high - low) * axes[1])


def webs(corners: Floats, inner: float, thickness: float, axes: Floats) -> list[Primitive]:
    """Two webs of a polygon (n, 2) of (level, up), from inner outward to either side."""
    return [
        level_prism(corners, inner, inner + thickness, axes),
        level_prism(corners, -inner - thickness, -inner, axes),
    ]


def drilled_holes(places: Sequence[Floats], depth: Floats, diameter: float) -> list[Primitive]:
    """Holes from points (3,) along a vector (3,), a little longer to both sides."""
    beyond = THROUGH_MM * depth / np.linalg.norm(depth)
    return [
        cylinder_between(place - beyond, place + depth + beyond, diameter / 2) for place in places
    ]


@dataclass(frozen=True)
class HeadPlate:
    """The head's plate, mm."""

    front: float  # of its face toward the hub, along the axis
    low: float  # of its lower edge, out from the axis
    high: float  # of its upper edge
    half_width: float  # of the plate

    @property
    def back(self) -> float:
        """Of the plate's other face."""
        return self.front - PLATE_MM


@dataclass(frozen=True)
class ShaftParts:
    """Parts on the shaft, where the tube round them ends along the axis, and its radius, mm."""

    bearing: PurchasedPart
    shaft: PurchasedPart
    collar: PurchasedPart
    rear: float
    tube: float


def hub_point(base: BaseLayout, along: float, out: float = 0.0, side: float = 0.0) -> Floats:
    """A point along the axis, out from it at azimuth zero, and across, in the shell's frame."""
    return np.asarray(np.array([along, out, side]) @ base.frame)


def axial_cylinder(
    base: BaseLayout, start: float, end: float, radius: float, out: float = 0.0
) -> Cylinder:
    """A cylinder between two places along the axis, or beside it, mm."""
    return cylinder_between(hub_point(base, start, out), hub_point(base, end, out), radius)


def purchased_components(
    base: BaseLayout, drive: Drive, plate: HeadPlate, shaft_parts: ShaftParts | None
) -> tuple[Component, ...]:
    """Simple bodies of all purchased parts of the head."""
    if drive.motor.kind == "stages":
        return _rotary_stage(base, drive.motor, plate)
    components = [_motor(base, drive, plate)]
    if drive.wheel and drive.pinion:
        # The holes that are drilled into the wheel for the screws into the hub.
        holes = _hub_screw_holes(base, drive.wheel["width_mm"], SCREW_MM)
        components += [
            _wheel("wheel", base, drive.wheel, 0.0, *holes, rotates=True),
            _wheel("pinion", base, drive.pinion, drive.centre_mm),
        ]
    if drive.coupling:
        components.append(_coupling(base, drive.coupling))
    return (*components, *(_on_shaft(base, plate, shaft_parts) if shaft_parts else ()))


def _hub_screw_holes(base: BaseLayout, length: float, diameter: float) -> list[Cylinder]:
    """Holes for the screws into the hub, through a body behind it."""
    start, end = base.hub.mount + THROUGH_MM, base.hub.mount - length - THROUGH_MM
    return [
        cylinder_between(hub_point(base, start, x, y), hub_point(base, end, x, y), diameter / 2)
        for x, y in base.hub.holes.tolist()
    ]


def _coupling(base: BaseLayout, part: PurchasedPart) -> Component:
    """A flange on the hub's face, and its collar, which keys of the flange's screws pass."""
    face = base.hub.mount
    flange = axial_cylinder(base, face, face - COUPLING_FLANGE_MM, part["flange_mm"] / 2)
    end = face - COUPLING_MM + COUPLING_GAP_MM
    collar = axial_cylinder(base, face, end, COUPLING_COLLAR_MM / 2)
    bore = axial_cylinder(base, face + THROUGH_MM, end - THROUGH_MM, part["bore_mm"] / 2)
    holes = (bore, *_hub_screw_holes(base, COUPLING_FLANGE_MM, part["hole_mm"]))
    return Component("coupling", part.what, (flange, collar), holes, part=part.name, rotates=True)


def _component(
    name: str, part: PurchasedPart, body: Cylinder, *bores: Cylinder, rotates: bool = False
) -> Component:
    return Component(name, part.what, (body,), bores, part=part.name, rotates=rotates)


def _on_shaft(base: BaseLayout, plate: HeadPlate, shaft_parts: ShaftParts) -> list[Component]:
    """Shaft, bearings and the collar that bears what the base weighs along the axis."""
    bearing, shaft, collar = shaft_parts.bearing, shaft_parts.shaft, shaft_parts.collar
    front, rear, width = base.hub.socket, shaft_parts.rear, bearing["width_mm"]
    end = front - shaft["length_mm"]
    body = axial_cylinder(base, front, end, shaft["diameter_mm"] / 2)
    components = [_component("shaft", shaft, body, rotates=True)]
    for name, start in (("bearing_front", plate.front), ("bearing_rear", rear + width)):
        stop = start - width
        bore = axial_cylinder(base, start + THROUGH_MM, stop - THROUGH_MM, bearing["bore_mm"] / 2)
        ring = axial_cylinder(base, start, stop, bearing["outer_mm"] / 2)
        components.append(_component(name, bearing, ring, bore))
    bore = axial_cylinder(base, rear + THROUGH_MM, end - SHAFT_END_MM, collar["bore_mm"] / 2)
    ring = axial_cylinder(base, rear, rear - collar["width_mm"], collar["outer_mm"] / 2)
    return [*components, _component("collar", collar, ring, bore, rotates=True)]


def wheel_radius(part: PurchasedPart) -> float:
    """Radius of a toothed wheel over its rims, mm."""
    return pitch_diameter(part) / 2 + PULLEY_RIM_MM


def _wheel(
    name: str,
    base: BaseLayout,
    part: PurchasedPart,
    out: float,
    *holes: Cylinder,
    rotates: bool = False,
) -> Component:
    """A toothed wheel behind the hub's face, on the axis or out from it, and its other holes."""
    start, end = base.hub.mount, base.hub.mount - part["width_mm"]
    bore = axial_cylinder(base, start + THROUGH_MM, end - THROUGH_MM, part["bore_mm"] / 2, out)
    body = axial_cylinder(base, start, end, wheel_radius(part), out)
    return _component(name, part, body, bore, *holes, rotates=rotates)


def _rotary_stage(
    base: BaseLayout, stage: PurchasedPart, plate: HeadPlate
) -> tuple[Component, Component]:
    """A stage before the plate, and its top, which rotates with the hub."""
    start, radius = base.hub.mount, stage["top_mm"] / 2
    end = start - STAGE_TOP_MM
    top = axial_cylinder(base, start, end, radius)
    body = axial_cylinder(base, end - STAGE_GAP_MM, plate.front, radius)
    return (
        _component("rotary_stage", stage, body),
        Component("rotary_stage_top", "top of the rotary stage", (top,), rotates=True),
    )


def _motor(base: BaseLayout, drive: Drive, plate: HeadPlate) -> Component:
    """A motor behind the plate with its pilot and shaft."""
    motor = drive.motor
    half_width, out = motor["frame_mm"] / 2, drive.centre_mm
    low = np.array([plate.back - motor["length_mm"], out - half_width, -half_width])
    pilot = plate.back - OVERLAP_MM, plate.back + motor["pilot_height_mm"]
    tip = plate.back + motor["shaft_length_mm"]
    added = (
        box(low, np.array([plate.back, out + half_width, half_width]), base.frame),
        axial_cylinder(base, *pilot, motor["pilot_mm"] / 2, out),
        axial_cylinder(base, plate.back, tip, motor["shaft_mm"] / 2, out),
    )
    return Component("motor", motor.what, added, part=motor.name)


def on_uprights(
    name: str, places: Sequence[Floats], along: Floats, flange: float, parts: Parts
) -> tuple[Fastener, ...]:
    """Screws through a body's flange (mm thick) into T-nuts of the uprights.

    Places (3,) are on a face of the uprights, mm; the unit vector along points into them.
    """
    screw, fasteners = choose_screw(parts, 5.0, flange + ENGAGEMENT_MM), list[Fastener]()
    for place in places:
        upright = "upright_left" if place[1] > 0 else "upright_right"
        fasteners.append(Fastener(screw, place - flange * along, along, (name, upright)))
        fasteners.append(Fastener(parts[TNUT], place, along, (upright,)))
    return tuple(fasteners)


def plate_fasteners(
    spec: FrameSpec, brackets: Iterable[Bracket], axes: Floats, parts: Parts
) -> Iterator[Fastener]:
    """Screws with washers through the brackets' feet into the base plate's threads."""
    screw = choose_screw(parts, 5.0, spec.flange_mm + 2 * ENGAGEMENT_MM)
    washer, down = parts[WASHER], -axes[2]
    for bracket in brackets:
        through = (bracket.component.name, "plate")
        for x, y in bracket.holes.tolist():
            place = np.array([x, y, spec.floor_mm + spec.flange_mm]) @ axes
            yield Fastener(washer, place, down, through[:1])
            yield Fastener(screw, place - washer["thickness_mm"] * down, down, through)


def motor_screw_places(drive: Drive) -> list[tuple[float, float]]:
    """Places (out, side) of the motor's screws on the head's plate, mm."""
    motor, centre = drive.motor, drive.centre_mm
    if motor.kind == "stages":
        return [(out, side) for out, side in bolt_circle(motor["hole_circle_mm"] / 2).tolist()]
    half = motor["hole_square_mm"] / 2
    return [(out, side) for out in (centre - half, centre + half) for side in (-half, half)]


def motor_fasteners(
    base: BaseLayout, drive: Drive, plate: HeadPlate, parts: Parts
) -> Iterator[Fastener]:
    """Screws through the head's plate into the motor behind it, or into the stage before it."""
    w = base.frame[0]
    if drive.motor.kind == "motors":
        screw = choose_screw(parts, 3.0, PLATE_MM + MOTOR_THREAD_MM)
        start, along, body = plate.front, -w, "motor"
    else:
        screw = choose_screw(parts, 6.0, PLATE_MM + 2 * MOTOR_THREAD_MM)
        start, along, body = plate.back, w, "rotary_stage"
    for out, side in motor_screw_places(drive):
        yield Fastener(screw, hub_point(base, start, out, side), along, ("bearing_head", body))

"""The drive in its place: motor, wheels, coupling, shaft and rotary stage."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tbcad.cad.drafting.dimensions import across, centre_cross, diameter
from tbcad.cad.drafting.sheet import A4, BESIDE_MM, Sheet, drawing_room, notes, placed
from tbcad.cad.formats.entities import Circle, Layer, Point
from tbcad.core.geometry.primitives import Component, Cylinder, box
from tbcad.core.geometry.rotations import bolt_circle
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.base.fasteners import COUPLING_FLANGE_MM
from tbcad.prototype.base.hub import PATTERNS, SCREW_MM, SOCKET_MM
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive, pitch_diameter
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.files.bom import PartsList
from tbcad.prototype.frame.shared import GAP_MM, OVERLAP_MM, PLATE_MM, THROUGH_MM, HeadPlate
from tbcad.prototype.part import FrameLayout, Part, Site
from tbcad.prototype.purchased.parts import PurchasedPart, choose_screw
from tbcad.prototype.sheets import ASIDE_MM, fitted, title_block

COUPLING_MM = 14.0  # length of a flange coupling with its gap to the motor; no list gives it
COUPLING_COLLAR_MM = 10.0  # diameter of its collar; see tbcad.prototype.base.hub
COUPLING_GAP_MM = 2.0  # between coupling and motor
PULLEY_RIM_MM = 1.5
AXIAL_PLAY_MM, PLAY_STEP_MM = 0.1, 0.1  # of the collar, by feeler gauges
SHAFT_END_MM = 2.0  # of the collar's bore beyond the shaft
# A stage of the 60 mm class; assumed: its height, its top's, and the gap below the top.
STAGE_HEIGHT_MM, STAGE_TOP_MM, STAGE_GAP_MM = 40.0, 12.0, 0.5
MOTOR_THREAD_MM = 3.0  # length of a screw in the motor
WHEEL = "drawing_wheel"
REMEDY = "prototype.largest_ball_mm smaller, or use a drive with a longer belt or a direct one"
NOTES_MM = 85.0  # width of the notes' column on A4
NEAR_SHAFT = ("carrier", "bearing_head", "wheel")


@dataclass(frozen=True)
class ShaftParts:
    """Parts on the shaft, where the tube round them ends along the axis, and its radius, mm."""

    bearing: PurchasedPart
    shaft: PurchasedPart
    collar: PurchasedPart
    spacer: PurchasedPart
    rear: float
    tube: float

    @property
    def listed(self) -> dict[str, int]:
        """Pieces by name."""
        others = (self.shaft, self.collar, self.spacer)
        return {self.bearing.name: 2} | {one.name: 1 for one in others}


def purchased_components(
    site: Site, plate: HeadPlate, shaft_parts: ShaftParts | None
) -> tuple[Component, ...]:
    """Simple bodies of all purchased parts of the head."""
    base, drive = site.base, site.drive
    if drive.motor.kind == "stages":
        return _rotary_stage(base, drive.motor, plate)
    components, face = [*_motor(base, drive, plate)], base.hub.mount
    for name, part, out in (("wheel", drive.wheel, 0.0), ("pinion", drive.pinion, drive.centre_mm)):
        if part:
            # The holes that are drilled into the wheel for the screws into the hub.
            holes = () if out else _hub_screw_holes(base, part["width_mm"], SCREW_MM)
            ends, outer = (face, face - part["width_mm"]), 2 * wheel_radius(part)
            ring = _ring(base, name, part, ends, (outer, part["bore_mm"]), holes, out)
            components.append(replace(ring, rotates=not out))
    if drive.coupling:
        components.append(_coupling(base, drive.coupling))
    return (*components, *(_on_shaft(base, plate, shaft_parts) if shaft_parts else ()))


def _hub_screw_holes(base: BaseLayout, length: float, diameter: float) -> tuple[Cylinder, ...]:
    """Holes for the screws into the hub, through a body behind it."""
    start, end = base.hub.mount + THROUGH_MM, base.hub.mount - length - THROUGH_MM
    return tuple(base.cylinder(start, end, diameter / 2, x, y) for x, y in base.hub.holes.tolist())


def _ring(
    base: BaseLayout,
    name: str,
    part: PurchasedPart,
    ends: tuple[float, float],
    diameters: tuple[float, float],
    holes: tuple[Cylinder, ...] = (),
    out: float = 0.0,
) -> Component:
    """A part about the axis, or out from it, by its ends along it, outer diameter and bore."""
    (start, end), (outer, bore) = ends, diameters
    body = base.cylinder(start, end, outer / 2, out)
    through = base.cylinder(start + THROUGH_MM, end - THROUGH_MM, bore / 2, out)
    return Component(name, part.what, (body,), (through, *holes), part=part.name)


def _coupling(base: BaseLayout, part: PurchasedPart) -> Component:
    """A flange on the hub's face, and its collar, which keys of the flange's screws pass."""
    face = base.hub.mount
    flange = base.cylinder(face, face - COUPLING_FLANGE_MM, part["flange_mm"] / 2)
    ends = face, face - COUPLING_MM + COUPLING_GAP_MM
    holes = _hub_screw_holes(base, COUPLING_FLANGE_MM, part["hole_mm"])
    ring = _ring(base, "coupling", part, ends, (COUPLING_COLLAR_MM, part["bore_mm"]), holes)
    return replace(ring, added=(flange, *ring.added), rotates=True)


def _on_shaft(base: BaseLayout, plate: HeadPlate, shaft_parts: ShaftParts) -> list[Component]:
    """Shaft and bearings; spacer and collar, on either side of them, keep the base along its axis.

    The spacer is between the wheel and the inner ring of the front bearing.
    """
    bearing, shaft, collar = shaft_parts.bearing, shaft_parts.shaft, shaft_parts.collar
    spacer = shaft_parts.spacer
    apart = (plate.front + spacer["width_mm"], plate.front)
    sleeve = _ring(base, "spacer", spacer, apart, (spacer["outer_mm"], spacer["bore_mm"]))
    front, rear, width = base.hub.socket, shaft_parts.rear, bearing["width_mm"]
    end = front - shaft["length_mm"]
    body = base.cylinder(front, end, shaft["diameter_mm"] / 2)
    rings = [
        _ring(base, name, bearing, (at, at - width), (bearing["outer_mm"], bearing["bore_mm"]))
        for name, at in (("bearing_front", plate.front), ("bearing_rear", rear + width))
    ]
    bore = base.cylinder(rear + THROUGH_MM, end - SHAFT_END_MM, collar["bore_mm"] / 2)
    ring = base.cylinder(rear, rear - collar["width_mm"], collar["outer_mm"] / 2)
    return [
        Component("shaft", shaft.what, (body,), part=shaft.name, rotates=True),
        *rings,
        replace(sleeve, rotates=True),
        Component("collar", collar.what, (ring,), (bore,), part=collar.name, rotates=True),
    ]


def wheel_radius(part: PurchasedPart) -> float:
    """Radius of a toothed wheel over its rims, mm."""
    return pitch_diameter(part) / 2 + PULLEY_RIM_MM


def _rotary_stage(
    base: BaseLayout, stage: PurchasedPart, plate: HeadPlate
) -> tuple[Component, Component]:
    """A stage before the plate, and its top, which rotates with the hub."""
    start, radius = base.hub.mount, stage["top_mm"] / 2
    end = start - STAGE_TOP_MM
    top = base.cylinder(start, end, radius)
    body = base.cylinder(end - STAGE_GAP_MM, plate.front, radius)
    return (
        Component("rotary_stage", stage.what, (body,), part=stage.name),
        Component("rotary_stage_top", "top of the rotary stage", (top,), rotates=True),
    )


def _motor(base: BaseLayout, drive: Drive, plate: HeadPlate) -> Iterator[Component]:
    """A motor behind the plate with its pilot and shaft, and the brake behind it."""
    motor, out, back = drive.motor, drive.centre_mm, plate.back
    half, pilot = motor["frame_mm"] / 2, (back - OVERLAP_MM, back + motor["pilot_height_mm"])
    added = (
        box((back - motor["length_mm"], out - half, -half), (back, out + half, half), base.frame),
        base.cylinder(*pilot, motor["pilot_mm"] / 2, out),
        base.cylinder(back, back + motor["shaft_length_mm"], motor["shaft_mm"] / 2, out),
    )
    yield Component("motor", motor.what, added, part=motor.name)
    if brake := drive.brake:
        half, end = brake["frame_mm"] / 2, back - motor["length_mm"]
        low = end - brake["length_mm"], out - half, -half
        body = box(low, (end, out + half, half), base.frame)
        yield Component("brake", brake.what, (body,), part=brake.name)


def motor_screw_places(drive: Drive) -> list[tuple[float, float]]:
    """Places (out, side) of the motor's screws on the head's plate, mm."""
    motor, centre = drive.motor, drive.centre_mm
    if motor.kind == "stages":
        return [(out, side) for out, side in bolt_circle(motor["hole_circle_mm"] / 2).tolist()]
    half = motor["hole_square_mm"] / 2
    return [(out, side) for out in (centre - half, centre + half) for side in (-half, half)]


def motor_fasteners(site: Site, plate: HeadPlate) -> Iterator[Fastener]:
    """Screws through the head's plate into the motor behind it, or into the stage before it."""
    base, drive, parts, w = site.base, site.drive, site.parts, site.base.frame[0]
    if drive.motor.kind == "motors":
        screw = choose_screw(parts, 3.0, PLATE_MM + MOTOR_THREAD_MM)
        start, along, body = plate.front, -w, "motor"
    else:
        screw = choose_screw(parts, 6.0, PLATE_MM + 2 * MOTOR_THREAD_MM)
        start, along, body = plate.back, w, "rotary_stage"
    for out, side in motor_screw_places(drive):
        yield Fastener(screw, base.point(start, out, side), along, ("bearing_head", body))


@planned("Rotary stage on the head", "rotary_stage*")
def table_step(machine: AssembledMachine) -> Values:
    """The rotary stage."""
    return {}


@planned("Zero disc on the hub", "zero_disc", "wheel", "coupling")
def hub_step(machine: AssembledMachine) -> Values:
    """Zero disc, and what drives it, on the hub."""
    part = sheet = None
    if wheel := machine.bodies.get("wheel"):
        part, sheet = machine.listed(wheel), machine.record.drawing_of(wheel)
    centred = machine.has("shaft") and (
        f" The shaft {machine.body_ref('shaft')} through wheel, disc and hub centres them while "
        "the screws are tightened; pull it out again."
    )
    return {
        "disc": machine.body_ref("zero_disc"),
        "drill": when(sheet, f"Drill the wheel as {sheet} shows. "),
        "centred": centred or "",
        "wheel": wheel and (f"the wheel of {part['teeth']:.0f} teeth" if part else "the wheel"),
        "no_wheel": not wheel,
        "coupling": machine.has("coupling"),
        "stage": machine.has("rotary_stage"),
    }


@planned("Base on its shaft", "shaft", "spacer", "collar", loose=("belts",), near=NEAR_SHAFT)
def shaft_step(machine: AssembledMachine) -> Values:
    """The base on its shaft."""
    shaft, wheel = machine.body_ref("shaft"), machine.has("wheel")
    return {
        "shaft": shaft,
        "spacer": machine.body_ref("spacer"),
        "socket_mm": SOCKET_MM,
        "wheel": wheel,
        "play": AXIAL_PLAY_MM,
        "most": AXIAL_PLAY_MM + PLAY_STEP_MM,
    }


@planned("Motor", "motor", "brake", "pinion", near=("wheel",))
def motor_step(machine: AssembledMachine) -> Values:
    """The motor, with belt, or straight on the shaft."""
    belt, brake = machine.has("pinion"), machine.has("brake") and machine.body_ref("brake")
    coupling = machine.has("coupling")
    values: Values = {"belt": belt, "direct": not belt, "brake": brake, "coupling": coupling}
    values |= {"drive": machine.record.drive}
    wheel, motor = (machine.listed(machine.bodies.get(body, "")) for body in ("wheel", "motor"))
    if not (belt and wheel and motor):
        return values | {"parts": False}
    front = PLATE_MM + GAP_MM + wheel["width_mm"]
    shaft = motor["shaft_length_mm"]
    return values | {
        "parts": True,
        "pinion": machine.body_ref("pinion"),
        "front": front,  # so that the pinion's teeth are in line with the wheel's
        "shaft_mm": shaft,
        "apart": abs(shaft - front),
        "beyond": "beyond" if shaft > front else "before",
    }


def wheel_sheet(base: BaseLayout, part: PurchasedPart, bill: PartsList) -> Sheet:
    """The driven wheel from behind the hub, x toward azimuth zero; the origin is its middle."""
    paper, radius = A4, wheel_radius(part)
    left, low, right, high = drawing_room(paper)
    circle = PATTERNS[base.spec.drive].circle
    corner = right - NOTES_MM, high
    scale, origin = fitted(
        (2 * radius, 2 * radius), (left, low, corner[0] - BESIDE_MM, high), (radius, radius)
    )
    places: list[Point] = [(float(x), float(y)) for x, y in base.hub.holes]
    holes = [Circle(Layer.CUT, place, SCREW_MM / 2) for place in places]
    outline = [Circle(Layer.CUT, (0, 0), radius), Circle(Layer.CUT, (0, 0), part["bore_mm"] / 2)]
    on_circle = Circle(Layer.CENTRE, (0, 0), circle / 2)
    drawn = placed([*outline, *holes, on_circle], origin, scale)
    circles = [one for one in drawn if isinstance(one, Circle) and one.layer == Layer.CUT]
    angle = float(np.degrees(np.arctan2(places[0][1], places[0][0])))
    on_holes = f"{len(holes)} x Ø<> on Ø{circle:g}"
    text = (
        f"{part['teeth']:g} teeth, pitch {part['pitch_mm']:g}, {part['width_mm']:g} over the rims.",
        f"{len(holes)} x Ø{SCREW_MM:g} through on a circle of Ø{circle:g} ± 0.1,",
        f"the first at {angle:.0f}°, the others {360 / len(holes):g}° apart.",
        "Drill from the flat side that lies against the",
        "zero disc; the bore stays as bought.",
        "In brackets: over the rims, as bought.",
        f"Turn off a hub: the head's plate is {GAP_MM:g} mm behind.",
    )
    ring, bore, first = circles[0], circles[1], circles[2]
    right, top = origin[0] + ring.radius, ring.centre[1] + ring.radius
    block = title_block(bill, "driven wheel", part, "on the face at the zero disc")
    entities = [
        *drawn,
        *(line for one in (ring, *circles[2:]) for line in centre_cross(one)),
        across(
            (origin[0] - ring.radius, origin[1]),
            (right, origin[1]),
            origin[1] - ring.radius - ASIDE_MM / 2,
            f"{2 * radius:.1f}",
            "(Ø<>)",
        ),
        diameter(first, *_called(first, (right, top)), f"{SCREW_MM:g}", on_holes),
        diameter(bore, *_called(bore, (right, origin[1])), f"{part['bore_mm']:g}", "Ø<>"),
        *notes(corner, NOTES_MM - BESIDE_MM, text),
    ]
    return Sheet.framed((WHEEL, part.name), block, paper, scale, origin, entities)


def _called(circle: Circle, corner: Point) -> tuple[Point, Point]:
    """Both ends of a leader: on a circle, and beside a place."""
    place = corner[0] + BESIDE_MM, corner[1] + BESIDE_MM
    x, y = place[0] - circle.centre[0], place[1] - circle.centre[1]
    share = circle.radius / float(np.hypot(x, y))
    tip = circle.centre[0] + share * x, circle.centre[1] + share * y
    return tip, place


def _sheets(site: Site, _: FrameLayout, bill: PartsList) -> tuple[Sheet, ...]:
    return (wheel_sheet(site.base, site.drive.wheel, bill),) if site.drive.wheel else ()


DRIVE = Part(
    (table_step, hub_step, shaft_step, motor_step),
    sheets=_sheets,
    remedies={"motor": REMEDY, "pinion": REMEDY},
)

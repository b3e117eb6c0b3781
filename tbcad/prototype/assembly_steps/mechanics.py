"""Steps of the mechanics: seats, carrier, frame, drive and zero switch."""

import numpy as np

from tbcad.prototype.assembly_steps.machine import AssembledMachine, Words, planned, when
from tbcad.prototype.base.hub import PIN_MM, SOCKET_MM
from tbcad.prototype.frame.head import GAP_MM
from tbcad.prototype.frame.purchased import PLATE_MM
from tbcad.records.prototype import MATT_BLACK

HOLES = "plate_holes.csv"
UPRIGHTS = 2


@planned("Try the seats", "coupon_*")
def coupon(machine: AssembledMachine) -> Words:
    """The coupons, before the carrier is printed."""
    names = [machine.body_ref(body) for body in machine.bodies if body.startswith("coupon_")]
    black = sum(part.finish == MATT_BLACK for part in machine.record.parts)
    does = [
        f"Print {', '.join(names)} before the carrier: it has the seats of the largest, a middle "
        "and the smallest ball, as designed and offset, in the pose of the carrier's worst seat. "
        "Supports on the build plate only, as for the carrier.",
        "Put the balls in. The seat fits in which the ball touches its three pads and nothing "
        "else.",
        "Set prototype.base.pad_offset_mm to the offset of that seat and build the design again. "
        "Then print the carrier.",
        when(
            black,
            "Print all parts as they lie in their files, with solid walls. All but coupon, gauge "
            f"and caps ({black} parts) must be matt black: use black PETG, and paint what shines.",
        ),
    ]
    return does, ["In the seat chosen, the ball does not rock when it is pushed at its edge."]


@planned("Drill the plate, cut the uprights", "plate")
def shop(machine: AssembledMachine) -> Words:
    """Plate and uprights as drawn; what must be matt black is blackened before it is mounted."""
    stock = machine.record.frame_stock
    plate, upright = map(machine.record.drawing_of, (stock.plate, stock.upright))
    black = ", ".join(one.name.replace("_", " ") for one in machine.record.bought if one.finish)
    does = [
        f"Drill the plate {machine.ref(stock.plate)} by {plate or HOLES} and tap M5 through.",
        f"Saw both uprights {machine.ref(stock.upright)} to {stock.uprights_cut_to_mm:.1f} mm"
        f"{when(upright, f' ({upright})')}: they are mounted later.",
        "Deburr all edges.",
        when(
            black,
            f"Paint, blacken or tape matt black what is not yet: {black}, heads of screws. Mask "
            "threads, slots, bores, teeth and what bearings sit on.",
        ),
    ]
    checks = [
        f"An M5 screw turns by hand into each of the plate's holes ({HOLES} lists them).",
        "Stood next to each other, both uprights are equally long to 0.2 mm.",
    ]
    return does, checks


@planned("The carrier", "carrier", "carrier_*", loose=("GLUE-EPOXY",))
def carrier(machine: AssembledMachine) -> Words:
    """What is glued and pressed into the carrier, and its joints."""
    cut, shaft = machine.has("carrier_1"), machine.has("shaft")
    magnets = [one for one in machine.record.holding.balls if one.by == "magnet"]
    part = machine.listed(machine.bodies["shaft"]) if shaft else None
    size = f" {part['diameter_mm']:g} H7" if part else ""
    does = [
        "Remove supports. Pads are the three small flats in each cup: clean them, but do not sand "
        "them round.",
        when(
            shaft,
            f"Ream the hub's bore with a hand reamer{size}, turned one way only: printed holes "
            "come out 0.1 to 0.3 mm narrower than drawn.",
        ),
        f"Press the inserts into the holes of the {'hub and the joints' if cut else 'hub'}.",
        when(
            cut,
            "Join the pieces in the order of the numbers at their joints: dowels first, then "
            "screws, all of them loosely, then tight.",
        ),
        "Stack the magnets and mark the same pole of all with a pen. Glue one into each pocket, "
        "below the pads, never above. The marked poles all face the same way: north toward the "
        "ball."
        if magnets
        else "Balls are glued later: roughen the wells of the seats.",
        "Let the glue harden for a day.",
    ]
    checks = [
        when(shaft, "The shaft slides into the bore by hand."),
        "A screw turns by hand into each insert, and stands square.",
        *(f"Seat {one.ball}: {machine.ref(one.magnet or '')}." for one in magnets),
        when(
            magnets,
            "No magnet stands above the pads: a straight edge across the pads does not touch it.",
        ),
        when(cut, "No joint opens when the carrier is held by its hub and shaken."),
    ]
    return does, checks


@planned("Make the caps", "cap_*")
def caps(machine: AssembledMachine) -> Words:
    """Mirrors that are printed or turned."""
    caps = machine.record.caps
    drawings = ", ".join(str(one.pdf) for one in caps)
    does = [
        "Print the caps front up in resin, or have them turned; polish and coat them as "
        f"{drawings} ask{'s' if len(caps) == 1 else ''}.",
        "Glue a magnet into each spigot, its north pole toward the front, so that the seat's "
        "magnet attracts it.",
        "Fit the spigot into the pocket of its seat.",
    ]
    checks = [
        f"Cap {one.ball}: the spigot of {one.spigot_mm:.1f} mm slides into seat {one.ball} and "
        f"tilts by at most {one.tilt_deg:.1f} degrees."
        for one in caps
    ]
    return does, checks


@planned("Feet and uprights on the plate", "upright_*")
def frame(machine: AssembledMachine) -> Words:
    """Feet and uprights; how many T-nuts each upright has in its front slot and in its back one."""
    axis = np.array(machine.record.frame.axis)
    nuts = [one.along @ axis for one in machine.fasteners if machine.kind(one.part) == "tnuts"]
    # Screws go in from the front against the axis, which leans from the uprights to the camera.
    front = sum(along < 0 for along in nuts)
    does = [
        f"Slide all T-nuts into the slots of the uprights, {front // UPRIGHTS} in the front one "
        f"(toward the camera) of each and {(len(nuts) - front) // UPRIGHTS} in the back one: one "
        "at the lower end of each slot for a foot, the others for what comes later (the picture "
        "shows which).",
        "Stand the uprights between the two feet, the feet's flanges against them. Screws through "
        "the feet into the T-nuts, loosely.",
        "Screw the feet down on the plate, a washer under each head. Then tighten the T-nuts' "
        "screws.",
    ]
    checks = [
        "A square shows both uprights at a right angle to the plate in both directions.",
        "The distance between them is the same at both ends to 0.5 mm.",
    ]
    return does, checks


@planned("Bearing head on the uprights", "bearing_*")
def head(machine: AssembledMachine) -> Words:
    """Bearings and head."""
    bearings = machine.has("bearing_front")
    seat = "Press a bearing into either side of the head, until it sits on its shoulder."
    turns = "The shaft slides through both bearings by hand and turns without a rough spot."
    does = [
        "Press the inserts into the head's side.",
        when(bearings, seat),
        "Screw the head on the uprights with the T-nuts, its upper edge flush with their ends.",
    ]
    checks = [
        "A straight edge across both uprights' ends touches the head.",
        when(bearings, turns),
    ]
    return does, checks


@planned("Rotary stage on the head", "rotary_stage*")
def table(machine: AssembledMachine) -> Words:
    """The rotary stage."""
    does = "Screw the rotary stage on the head's front from behind, its turning side toward the "
    check = "The stage turns by its knob or motor, and its top does not move when it is pushed."
    return [f"{does}object."], [check]


@planned("Zero disc on the hub", "zero_disc", "wheel", "coupling")
def hub(machine: AssembledMachine) -> Words:
    """Zero disc, and what drives it, on the hub."""
    wheel = machine.has("wheel")
    part = machine.listed(machine.bodies["wheel"]) if wheel else None
    turns = f"the wheel of {part['teeth']:.0f} teeth" if part else "the wheel"
    does = [
        "Press the dowel half into the hole in the hub's face.",
        f"Put the {machine.body_ref('zero_disc')} on it, arrow toward the hub: there is only one "
        "way.",
        _drilled(machine) if wheel else "",
        when(machine.has("coupling"), "Fasten the coupling's flange behind the disc."),
        when(
            machine.has("rotary_stage"),
            "Hold hub and disc against the top of the rotary stage, and screw them on from the "
            "object's side.",
        ),
    ]
    checks = [
        "Hub and disc touch all round: no gap is seen.",
        f"Turned by hand in front of a fixed pencil, {turns} does not wobble."
        if wheel
        else "The disc does not wobble when it is turned.",
    ]
    return does, checks


def _drilled(machine: AssembledMachine) -> str:
    sheet = machine.record.drawing_of(machine.bodies["wheel"])
    drill = when(sheet, f"Drill the wheel as {sheet} shows. ")
    text = f"{drill}Screw it on through its four holes: wheel, disc, inserts of the hub."
    if not machine.has("shaft"):
        return text
    return (
        f"{text} The shaft {machine.body_ref('shaft')} through wheel, disc and hub centres them "
        "while the screws are tightened; pull it out again."
    )


NEAR_SHAFT = ("carrier", "bearing_head", "wheel")


@planned("Base on its shaft", "shaft", "collar", loose=("belts",), near=NEAR_SHAFT)
def shaft(machine: AssembledMachine) -> Words:
    """The base on its shaft."""
    does = [
        f"Push the shaft {machine.body_ref('shaft')} into the hub from behind until it ends in "
        f"the bore. The last {SOCKET_MM:g} mm of the bore stay free: the gauge of the camera is "
        "plugged in there later.",
        "Tighten the screws of the hub in turn.",
        when(
            machine.has("wheel"),
            "Lay the belt round the wheel now: once the shaft is in its bearings, it gets neither "
            "past the base nor past the head.",
        ),
        "Push the shaft through both bearings, hub in front, the loop of the belt toward the "
        "motor's place. Collar on its rear end, against the bearing; its set screw points down, "
        "where the key reaches it.",
    ]
    checks = [
        "The base turns freely by hand and falls back to where it is heaviest.",
        "Pushed up along the axis and let go, the base slides back until the collar touches the "
        "bearing: its weight keeps it there.",
    ]
    return does, checks


@planned("Motor", "motor", "pinion", near=("wheel",))
def motor(machine: AssembledMachine) -> Words:
    """The motor, with belt, or straight on the shaft."""
    if machine.has("pinion"):
        return _belt(machine)
    does = [
        "Motor behind the head's plate, screws from the front.",
        when(
            machine.has("coupling"),
            "Push the base with the coupling on the motor's shaft; tighten the set screws of the "
            "coupling and of the hub.",
        ),
    ]
    return does, ["Turned by hand, the base takes the motor's shaft along and does not slip on it."]


def _belt(machine: AssembledMachine) -> Words:
    drive = machine.record.drive
    does = [
        _pinion(machine),
        "Motor behind the head's plate, the pinion through its hole and into the belt's loop. "
        "Screws from the front, loosely in their slots.",
        "Belt on both wheels. Pull the motor away from the shaft until the belt has its tone, then "
        "tighten the screws in turn.",
    ]
    checks = [
        f"The axes of motor and base are {drive.belt_centre_mm:.1f} mm apart.",
        f"A free side of the belt, plucked like a string, sounds at {drive.belt_tone_hz:.0f} Hz (a "
        f"tuner app; a pull of {drive.belt_tension_n:.0f} N).",
        f"{drive.ratio:g} turns of the motor turn the base once.",
    ]
    return does, checks


def _pinion(machine: AssembledMachine) -> str:
    """Where the pinion is on the motor's shaft: its teeth in line with the wheel's."""
    part, motor = (machine.listed(machine.bodies[body]) for body in ("pinion", "motor"))
    if not (part and motor):
        return ""
    front = PLATE_MM + GAP_MM + part["width_mm"]
    beyond = motor["shaft_length_mm"] - front
    return (
        f"Pinion {machine.body_ref('pinion')} on the motor's shaft, its hub with the set screws "
        f"toward the motor, the end of its teeth {front:g} mm from the motor's face: they are then "
        f"in line with the wheel's. A shaft of {motor['shaft_length_mm']:g} mm ends "
        f"{abs(beyond):g} mm {'beyond' if beyond > 0 else 'before'} it. Tighten one set screw on "
        "the shaft's flat, then the other: later the head's plate is round them."
    )


@planned("Switch and zero pin", "home_*", loose=("shafts",), near=("zero_disc",))
def homing(machine: AssembledMachine) -> Words:
    """Switch, bracket and the zero pin."""
    home = machine.record.home
    does = [
        "Screw the switch on its bracket, the roller toward the axis. Screw the bracket on the "
        "head's side.",
        "Turn the base by hand until the marks of disc and head are in line, and push the zero pin "
        f"{machine.ref(home.pin)} from behind through the head into the disc. That is base angle "
        "zero.",
        "Leave the zero pin in until the motor holds the base: without both, the base turns down "
        "and its balls strike what stands below."
        if machine.has("motor")
        else "Pull the zero pin out again.",
    ]
    checks = [
        f"The zero pin of {PIN_MM:g} mm goes through head and disc without force.",
        "Turned by hand against the arrow, the base clicks the switch at about "
        f"{abs(home.switch_deg):.0f} degrees from zero.",
    ]
    return does, checks

"""Words of the steps of the frame and the drive."""

import numpy as np

from tbcad.prototype.assembly_steps.machine import Machine, Text, lines
from tbcad.prototype.base.hub import SOCKET_MM
from tbcad.prototype.frame.head import GAP_MM
from tbcad.prototype.frame.purchased import PLATE_MM
from tbcad.prototype.homing.sizes import PIN_MM

HOLES = "plate_holes.csv"


def shop(machine: Machine) -> Text:
    """Plate and uprights as drawn."""
    stock = machine.record.frame_stock
    plate, upright = map(machine.record.drawing_of, (stock.plate, stock.upright))
    length = stock.uprights_cut_to_mm
    return Text(
        lines(
            f"Drill the plate {machine.ref(stock.plate)} by {plate or HOLES} and tap M5 through.",
            f"Saw both uprights {machine.ref(stock.upright)} to {length:.1f} mm"
            + (f" ({upright})" if upright else "")
            + ": they are mounted later.",
            "Deburr all edges.",
            _blackened(machine),
        ),
        lines(
            f"An M5 screw turns by hand into each of the plate's holes ({HOLES} lists them).",
            "Stood next to each other, both uprights are equally long to 0.2 mm.",
        ),
    )


def _blackened(machine: Machine) -> str:
    """Which purchased parts must be matt black; it is done before they are mounted."""
    named = [one.name for one in machine.record.bought if one.finish]
    if not named:
        return ""
    words = ", ".join(name.replace("_", " ") for name in named)
    return (
        f"Paint, blacken or tape matt black what is not yet: {words}, heads of screws. Mask "
        "threads, slots, bores, teeth and what bearings sit on."
    )


def frame(machine: Machine) -> Text:
    """Feet and uprights."""
    return Text(
        lines(
            f"Slide all T-nuts into the slots of the uprights, {_nuts_by_slot(machine)}: one at "
            "the lower end of each slot for a foot, the others for what comes later (the picture "
            "shows which).",
            "Stand the uprights between the two feet, the feet's flanges against them. Screws "
            "through the feet into the T-nuts, loosely.",
            "Screw the feet down on the plate, a washer under each head. Then tighten the T-nuts' "
            "screws.",
        ),
        lines(
            "A square shows both uprights at a right angle to the plate in both directions.",
            "The distance between them is the same at both ends to 0.5 mm.",
        ),
    )


def _nuts_by_slot(machine: Machine) -> str:
    """How many T-nuts each upright has in its front slot and in its back one."""
    nuts = [
        np.array(one.along) @ machine.record.frame.axis
        for one in machine.fasteners
        if machine.kind(one.part) == "tnuts"
    ]
    # Screws go in from the front against the axis, which leans from the uprights to the camera.
    front = sum(along < 0 for along in nuts)
    uprights = 2
    return (
        f"{front // uprights} in the front one (toward the camera) of each and "
        f"{(len(nuts) - front) // uprights} in the back one"
    )


def head(machine: Machine) -> Text:
    """Bearings and head."""
    bearings = machine.has("bearing_front")
    return Text(
        lines(
            "Press the inserts into the head's side.",
            "Press a bearing into either side of the head, until it sits on its shoulder."
            if bearings
            else "",
            "Screw the head on the uprights with the T-nuts, its upper edge flush with their ends.",
        ),
        lines(
            "A straight edge across both uprights' ends touches the head.",
            "The shaft slides through both bearings by hand and turns without a rough spot."
            if bearings
            else "",
        ),
    )


def table(machine: Machine) -> Text:
    """The rotary stage."""
    return Text(
        lines(
            "Screw the rotary stage on the head's front from behind, its turning side toward the "
            "object."
        ),
        lines("The stage turns by its knob or motor, and its top does not move when it is pushed."),
    )


def shaft(machine: Machine) -> Text:
    """The base on its shaft."""
    return Text(
        lines(
            f"Push the shaft {machine.body_ref('shaft')} into the hub from behind until it ends "
            f"in the bore. The last {SOCKET_MM:g} mm of the bore stay free: the gauge of the "
            "camera is plugged in there later.",
            "Tighten the screws of the hub in turn.",
            "Lay the belt round the wheel now: once the shaft is in its bearings, it gets neither "
            "past the base nor past the head."
            if machine.has("wheel")
            else "",
            "Push the shaft through both bearings, hub in front, the loop of the belt toward the "
            "motor's place. Collar on its rear end, against the bearing; its set screw points "
            "down, where the key reaches it.",
        ),
        lines(
            "The base turns freely by hand and falls back to where it is heaviest.",
            "Pushed up along the axis and let go, the base slides back until the collar touches "
            "the bearing: its weight keeps it there.",
        ),
    )


def motor(machine: Machine) -> Text:
    """The motor, with belt, or straight on the shaft."""
    drive = machine.record.drive
    pinion = machine.has("pinion")
    return Text(
        lines(
            _pinion(machine) if pinion else "",
            "Motor behind the head's plate, the pinion through its hole and into the belt's loop. "
            "Screws from the front, loosely in their slots."
            if pinion
            else "Motor behind the head's plate, screws from the front.",
            "Belt on both wheels. Pull the motor away from the shaft until the belt has its tone, "
            "then tighten the screws in turn."
            if pinion
            else "",
            "Push the base with the coupling on the motor's shaft; tighten the set screws of the "
            "coupling and of the hub."
            if machine.has("coupling")
            else "",
        ),
        lines(
            f"The axes of motor and base are {drive.belt_centre_mm:.1f} mm apart."
            if pinion
            else "",
            f"A free side of the belt, plucked like a string, sounds at {drive.belt_tone_hz:.0f} "
            f"Hz (a tuner app; a pull of {drive.belt_tension_n:.0f} N)."
            if pinion
            else "",
            f"{drive.ratio:g} turns of the motor turn the base once."
            if pinion
            else "Turned by hand, the base takes the motor's shaft along and does not slip on it.",
        ),
    )


def _pinion(machine: Machine) -> str:
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


def homing(machine: Machine) -> Text:
    """Switch, bracket and the zero pin."""
    home = machine.record.home
    return Text(
        lines(
            "Screw the switch on its bracket, the roller toward the axis. Screw the bracket on "
            "the head's side.",
            "Turn the base by hand until the marks of disc and head are in line, and push the "
            f"zero pin {machine.ref(home.pin)} from behind through the head into the disc. That "
            "is base angle zero.",
            "Leave the zero pin in until the motor holds the base: without both, the base turns "
            "down and its balls strike what stands below."
            if machine.has("motor")
            else "Pull the zero pin out again.",
        ),
        lines(
            f"The zero pin of {PIN_MM:g} mm goes through head and disc without force.",
            f"Turned by hand against the arrow, the base clicks the switch at about "
            f"{abs(home.switch_deg):.0f} degrees from zero.",
        ),
    )

"""Words of the steps of the base: seats, carrier, caps, hub and balls."""

from tbcad.prototype.assembly_steps.machine import Machine, Text, lines
from tbcad.records.prototype import MATT_BLACK

G_PER_KG = 1000.0


def coupon(machine: Machine) -> Text:
    """The coupons, before the carrier is printed."""
    names = [machine.body_ref(body) for body in machine.bodies if body.startswith("coupon_")]
    return Text(
        lines(
            f"Print {', '.join(names)} before the carrier: it has the seats of the largest, a "
            "middle and the smallest ball, as designed and offset, in the pose of the carrier's "
            "worst seat. Supports on the build plate only, as for the carrier.",
            "Put the balls in. The seat fits in which the ball touches its three pads and nothing "
            "else.",
            "Set prototype.base.pad_offset_mm to the offset of that seat and build the design "
            "again. Then print the carrier.",
            _black_prints(machine),
        ),
        lines("In the seat chosen, the ball does not rock when it is pushed at its edge."),
    )


def _black_prints(machine: Machine) -> str:
    """How all other parts are printed."""
    black = [part for part in machine.record.parts if part.finish == MATT_BLACK]
    if not black:
        return ""
    return (
        "Print all parts as they lie in their files, with solid walls. All but coupon, gauge and "
        f"caps ({len(black)} parts) must be matt black: use black PETG, and paint what shines."
    )


def carrier(machine: Machine) -> Text:
    """What is glued and pressed into the carrier, and its joints."""
    cut = machine.has("carrier_1")
    magnets = [one for one in machine.record.holding.balls if one.by == "magnet"]
    return Text(
        lines(
            "Remove supports. Pads are the three small flats in each cup: clean them, but do not "
            "sand them round.",
            _reamed(machine),
            f"Press the inserts into the holes of the {'hub and the joints' if cut else 'hub'}.",
            "Join the pieces in the order of the numbers at their joints: dowels first, then "
            "screws, all of them loosely, then tight."
            if cut
            else "",
            "Stack the magnets and mark the same pole of all with a pen. Glue one into each "
            "pocket, below "
            "the pads, never above. The marked poles all face the same way: north toward the ball."
            if magnets
            else "Balls are glued later: roughen the wells of the seats.",
            "Let the glue harden for a day.",
        ),
        lines(
            "The shaft slides into the bore by hand." if machine.has("shaft") else "",
            "A screw turns by hand into each insert, and stands square.",
            *(f"Seat {one.ball}: {machine.ref(one.magnet or '')}." for one in magnets),
            "No magnet stands above the pads: a straight edge across the pads does not touch it."
            if magnets
            else "",
            "No joint opens when the carrier is held by its hub and shaken." if cut else "",
        ),
    )


def _reamed(machine: Machine) -> str:
    """What is done to the hub's bore; printed holes come out narrower than they are drawn."""
    if not machine.has("shaft"):
        return ""
    part = machine.listed(machine.bodies["shaft"])
    size = f" {part['diameter_mm']:g} H7" if part else ""
    return (
        f"Ream the hub's bore with a hand reamer{size}, turned one way only: printed holes come "
        "out 0.1 to 0.3 mm narrower than drawn."
    )


def caps(machine: Machine) -> Text:
    """Mirrors that are printed or turned."""
    caps = machine.record.caps
    drawings = ", ".join(str(one.pdf) for one in caps)
    return Text(
        lines(
            "Print the caps front up in resin, or have them turned; polish and coat them as "
            f"{drawings} ask{'s' if len(caps) == 1 else ''}.",
            "Glue a magnet into each spigot, its north pole toward the front, so that the seat's "
            "magnet attracts it.",
            "Fit the spigot into the pocket of its seat.",
        ),
        lines(
            *(
                f"Cap {one.ball}: the spigot of {one.spigot_mm:.1f} mm slides into seat "
                f"{one.ball} and tilts by at most {one.tilt_deg:.1f} degrees."
                for one in caps
            )
        ),
    )


def hub(machine: Machine) -> Text:
    """Zero disc, and what drives it, on the hub."""
    return Text(
        lines(
            "Press the dowel half into the hole in the hub's face.",
            f"Put the {machine.body_ref('zero_disc')} on it, arrow toward the hub: there is only "
            f"one way.",
            _drilled(machine),
            "Fasten the coupling's flange behind the disc." if machine.has("coupling") else "",
            "Hold hub and disc against the top of the rotary stage, and screw them on from the "
            "object's side."
            if machine.has("rotary_stage")
            else "",
        ),
        lines(
            "Hub and disc touch all round: no gap is seen.",
            f"Turned by hand in front of a fixed pencil, {_wheel_words(machine)} does not wobble."
            if machine.has("wheel")
            else "The disc does not wobble when it is turned.",
        ),
    )


def _drilled(machine: Machine) -> str:
    if not machine.has("wheel"):
        return ""
    sheet = machine.record.drawing_of(machine.bodies["wheel"])
    drill = f"Drill the wheel as {sheet} shows. " if sheet else ""
    shaft = (
        f" The shaft {machine.body_ref('shaft')} through wheel, disc and hub centres them while "
        "the screws are tightened; pull it out again."
        if machine.has("shaft")
        else ""
    )
    return f"{drill}Screw it on through its four holes: wheel, disc, inserts of the hub.{shaft}"


def _wheel_words(machine: Machine) -> str:
    part = machine.listed(machine.bodies["wheel"])
    return f"the wheel of {part['teeth']:.0f} teeth" if part else "the wheel"


def balls(machine: Machine) -> Text:
    """Balls in their seats, by what holds them."""
    held = machine.record.holding.balls
    magnets = [one for one in held if one.by == "magnet" and one.ball in machine.sizes]
    strongest = max(magnets, default=None, key=lambda one: one.force_available_n)
    mass = machine.record.drive.mass_g / G_PER_KG
    return Text(
        lines(
            "Clean the balls with alcohol. Touch them only with gloves from now on.",
            "Push the caps into their seats, too." if machine.record.caps else "",
            "Put each into the seat with its number on the back, in any order. balls.csv lists "
            "the balls by number."
            if strongest
            else "Put a small drop of glue into the well of each seat, none on the pads, and the "
            "ball on it.",
            f"The magnet of ball {strongest.ball} pulls with {strongest.force_available_n:.0f} N: "
            "let the ball down by hand, and keep fingers off the edge of the cup."
            if strongest
            else "",
        ),
        lines(
            *(
                f"{_ball(machine, one.ball)} in seat {one.ball}."
                for one in held
                if one.ball in machine.sizes
            ),
            "Each touches its three pads and does not rock. It stays in its seat when the base is "
            f"turned through its whole travel; the base weighs {mass:.1f} kg now.",
        ),
    )


def _ball(machine: Machine, number: int) -> str:
    return machine.ref(f"ball {machine.sizes[number]}").capitalize()

"""Steps of light, object, camera and electronics, and of the first run."""

from tbcad.prototype.assembly_steps.machine import AssembledMachine, Words, planned, when
from tbcad.prototype.frame.camera_mount import GAP_MM

DIGITAL = "digital"
MA_PER_A, G_PER_KG = 1000.0, 1000.0
OWN_WIRES = ("motor", "supply")  # lines whose way is told instead of an output


@planned("Lamps", "lamp_*", loose=("strips",), near=("plate",))
def lamps(machine: AssembledMachine) -> Words:
    """Stands, holders and strips."""
    light = machine.record.lamps
    assert light is not None
    drawing = machine.record.drawing_of(light.strip)
    does = [
        "Screw the bridge's feet on the plate with washers, on both sides of the camera's place; "
        "the plate's drawing says which holes are theirs. Screw the bar on the fronts of both "
        "uprights with its T-nuts, as high as the upright's drawing has it."
        if light.level
        else "Screw the stands on the plate with washers; its drawing says which holes are theirs. "
        "Screw the holders on the fronts of the uprights with their T-nuts, as high as the "
        "upright's drawing has it.",
        f"Cut the strip {machine.ref(light.strip)} at its marks: {light.strips} pieces of "
        f"{light.length_mm:.0f} mm for each of the {len(light.places)} lamps"
        f"{when(drawing, f' ({drawing})')}. Solder a cable to each piece, plus to plus.",
        "Stick them on the lamps' faces, toward the object.",
    ]
    checks = [
        f"At 24 V all of them light up and draw {light.current_ma:.0f} mA together.",
        "All of them shine at the object, and stand alike on both sides of it.",
    ]
    return does, checks


@planned("Object stage", "stage_*", loose=("WIRE-28", "WIRE-30"))
def stage(machine: AssembledMachine) -> Words:
    """The object's stage with its LEDs; x is toward the camera, y to its right as it looks back."""
    leds = machine.record.leds
    does = [
        when(
            leds,
            f"Solder two wires to each of the {len(leds)} LEDs, long one to anode, and mark the "
            "anode. Push the LEDs into the crown's pockets from below, wires through the grooves "
            "and the bore.",
        ),
        f"{when(leds, 'Wires through the post. ')}Crown into the post, set screw through the "
        "post's wall.",
        "Press the insert into the foot's ear. Foot on the plate with washers; clamp the post in "
        f"it{', turned so that the LEDs stand as the checks say.' if leds else '.'}",
        "Lay the disc on the crown's studs.",
    ]
    checks = [
        "The disc lies flat, comes off by hand and fits turned by 180 degrees.",
        *(
            f"LED {number}: {abs(x):.0f} mm {'toward' if x > 0 else 'away from'} the camera, "
            f"{abs(y):.0f} mm to the {'right' if y > 0 else 'left'} as the camera sees it, "
            f"{abs(z):.0f} mm {'above' if z > 0 else 'below'} the object's centre."
            for number, (x, y, z) in enumerate((led.position_mm for led in leds), 1)
        ),
        "The post does not turn in its clamp."
        + when(leds, " A plug on the wires lets it be taken out."),
        "The base passes the stage without touching it, over its whole travel by hand; then the "
        "zero pin is in again.",
    ]
    return does, checks


@planned(
    "Bracket, plate and fence of the camera",
    *("camera_bracket", "camera_plate", "camera_fence", "camera"),
)
def camera(machine: AssembledMachine) -> Words:
    """The camera's mount."""
    does = [
        "Press the inserts into the camera plate from behind.",
        "Bracket on the base plate with washers, in the middle of its slots.",
        "Three long screws with washers from behind through the bracket's slots; on each between "
        "bracket and plate a washer and two nuts, then into the plate's inserts. "
        f"{GAP_MM:g} mm between plate and bracket. The nut at the plate locks the screw, the other "
        "one clamps the bracket.",
        "Camera and lens are not in the list: camera.json has what they must do, and tbcad camera "
        "shows which on sale do it.",
        "Fence on the plate. Then your camera on the plate by its tripod thread, its back against "
        "the fence.",
    ]
    checks = [
        f"The gap between plate and bracket is {GAP_MM:g} mm at all three screws, to 0.5 mm.",
        "The camera looks at the object, and cannot be turned on its screw by hand.",
    ]
    return does, checks


@planned("Wiring", loose=("electronics", "wires", "connectors", "resistors"))
def wiring(machine: AssembledMachine) -> Words:
    """Lines of the controller, one each; without lamps, where light comes from instead."""
    does = [
        "Controller, supply, relay and switch modules stand outside the shroud. Supply off.",
        "Plus of the supply goes to each lamp, and through its resistor to each LED's anode (odd "
        "pin). Their other ends (an LED's cathode: even pin) go to the drain of a switch module, "
        "whose input is the controller's output.",
        *(_line(machine, row) for row in machine.wiring),
        when(
            not machine.record.lamps,
            "This design has no place for lamps of its own, and none are in the list: buy two "
            "small ones alike, for 24 V and 2 W each, and connect both to line 1. Fasten them "
            "lower than the object and in the middle of the machine, one toward the camera and one "
            "toward the uprights, as far from the object, out of the camera's picture of balls and "
            "out of the base's way (turn it by hand). They light it alike before and after its "
            "half turn. Without them no photograph shows the object.",
        ),
        "Never plug or unplug the motor with the supply on: that destroys drivers, and the base "
        "falls. Zero pin in before the supply is switched off. No wire goes to the base.",
    ]
    checks = [
        "Before the supply is on: between its plus and minus, behind the fuse, are more than 100 "
        "ohm, and a few ohm between the two wires of each of the motor's coils.",
        "With the supply on, no part gets warm and no LED lights.",
        *(
            f"{row['on']} switches {row['signal'].replace('_', ' ')} on, {row['off']} off."
            for row in machine.wiring
            if row["on"]
        ),
    ]
    return does, checks, ["Solder or crimp all joints, and insulate each one."]


def _line(machine: AssembledMachine, row: dict[str, str]) -> str:
    """A line of wiring.csv in words."""
    line, part = f"Line {row['line']}, {row['signal'].replace('_', ' ')}:", machine.ref(row["part"])
    if row["signal"] in OWN_WIRES:
        rated = f", {float(row['current_ma']):.0f} mA RMS" if row["current_ma"] else ""
        return f"{line} {part}{rated}; {row['path']}."
    through = when(row["resistor"], f" through {machine.ref(row['resistor'])}")
    pins = f", pins {row['pins'].replace(' ', ' and ')} of {row['connector']}"
    switched = when(row["output"].startswith(DIGITAL), " by a switch module")
    way = when(row["path"] and not row["resistor"], f"; {row['path']}")
    return f"{line} {part}{through}{when(row['pins'], pins)}, at {row['output']}{switched}{way}."


@planned("Angle zero")
def zero(machine: AssembledMachine) -> Words:
    """Settings, homing and the trim."""
    drive, home, off = machine.record.drive, machine.record.home, machine.record.power_off
    current = drive.hold_current_a
    homes = machine.record.controller.firmware == "grblhal"
    rated = next((row["current_ma"] for row in machine.wiring if row["signal"] == "motor"), "")
    of_motor = f", {float(rated) / MA_PER_A:.1f} A," if rated else ""
    does = [
        when(
            current,
            f"Set the driver to the motor's rated current{of_motor} while it turns, and "
            f"{current:.2f} A (root mean square) at rest (IRUN and IHOLD of Trinamic drivers).",
        ),
        "Send grbl_settings.txt line by line from a G-code sender. With Klipper include "
        "klipper.cfg instead, fill in the board's pins, and print rotation_plan_klipper.gcode.",
        when(
            homes,
            "grblHAL starts in alarm when its inputs for reset, emergency stop and door are empty: "
            "send $14=73 then, which inverts them.",
        ),
        f"{when(homes, 'Unlock the controller by $X. ')}Jog by 0.1 degrees, so that the motor "
        "holds the base (if not, change $4), and pull the zero pin out. Jog a little in the "
        "positive direction. If the base turns against the disc's arrow, set $3 as the file's "
        "comment says.",
        "Home ($H), send the program's line G92, and jog until the zero pin goes in. The angle "
        "that the controller shows, with a changed sign, is prototype.motion.home_trim_deg: build "
        "again with it."
        if homes
        else "Jog until the zero pin goes in, and switch the controller on there: that is its "
        "zero.",
        "Pull the zero pin out, and keep the motor powered. Before the supply is switched off or "
        "unplugged, its fuse taken out, or the controller reset or restarted, send the base to "
        "zero and put the pin in.",
        when(
            off.fall_energy_j,
            "Nothing but the motor's current holds the base while the pin is out. If the supply "
            "fails, the base falls and strikes the end of its travel with up to "
            f"{off.fall_energy_j:.1f} J at {off.fall_speed_deg_s:.0f} degrees a second: keep hands "
            "out of its way, and use an uninterruptible supply for controller and motor. The pin "
            f"bears {off.pin_force_n:.0f} N of gravity at most, {off.pin_pressure_mpa:.1f} MPa in "
            f"its printed hole ({off.pin_pressure_limit_mpa:.0f} are allowed).",
        ),
    ]
    checks = [
        when(
            homes,
            "Before $H: the controller's report (send ?) has Pn with the axis's letter while the "
            "switch is pressed by hand, and only then.",
        ),
        when(homes, f"Homed, the base stops at {home.homed_deg:.1f} degrees, again and again."),
        f"Sent to zero, the zero pin goes in: the error is at most {home.zero_error_deg:.1f} "
        "degrees.",
    ]
    return does, checks


@planned("Camera in its place", "camera_gauge", near=("carrier",))
def gauge(machine: AssembledMachine) -> Words:
    """The camera's alignment by the gauge."""
    place = machine.record.camera_place
    assert place is not None
    sizes, error, travel = place.lengths_mm, place.error, place.travel
    does = [
        "Take the stage's post out of its clamp. Measure the gauge: both widths between the edges "
        "that face each other. Sand the near arm's ends, or tape them, until near_width is "
        "far_width x (H - hub_to_near) / (H - hub_to_far), H = hub_to_pinhole.",
        "Gauge into the hub's bore, arms level and marked face up, flange flat on the hub; hold it "
        "with tape. Zero pin in at zero.",
        "Focus and stop the lens as camera.json has it: both move the pinhole.",
        "Base at zero: turn yaw, roll and pitch until the near marks are within 10 pixels of the "
        "place that the checks name.",
        "Move the camera along its axis until the near arm's ends just touch the far arm's edges "
        "in the picture. Gaps of one width: too far. Overlaps: too near. If they differ, it is the "
        "gauge or the place across, which the next pictures tell apart.",
        "Zero pin out. Base at -90 and 90 degrees: marked faces in one line (across), ends "
        "touching (out). What is alike in both pictures with opposite signs is the gauge's error; "
        "their mean is the camera's.",
        "Repeat until every mean is below half a pixel (0.1 mm is about a pixel). Tighten all "
        "screws, look once more. Take the gauge off, put the post back. The camera may be taken "
        "off later: the fence brings it back.",
    ]
    checks = [
        f"Before sanding: near_width {sizes.near_width:.2f}, far_width {sizes.far_width:.2f}, "
        f"hub_to_near {sizes.hub_to_near:.2f}, hub_to_far {sizes.hub_to_far:.2f}, "
        f"hub_to_pinhole {sizes.hub_to_pinhole:.2f} mm.",
        *(
            f"Base at {one.base_angle_deg:.0f} degrees: the {one.side} mark appears at column "
            f"{one.column_px:.0f}, row {one.row_px:.0f}."
            for one in place.pictures
        ),
        f"The pinhole is then known to {error.along_mm:.2f} mm along, {error.across_mm:.2f} across "
        f"and {error.out_mm:.2f} out.",
    ]
    fit = (
        f"Travel: along {travel.along_axis_mm:g} mm, across {travel.across_mm:g}, out "
        f"{travel.out_mm:g}, yaw {travel.yaw_deg:.0f} degrees, roll {travel.roll_deg:.0f}, "
        f"pitch {travel.pitch_deg:.0f}"
    )
    return does, checks, [fit]


@planned("Balls into their seats", "ball_*", near=("carrier",))
def balls(machine: AssembledMachine) -> Words:
    """Balls in their seats, by what holds them."""
    held = [one for one in machine.record.holding.balls if one.ball in machine.sizes]
    magnets = [one for one in held if one.by == "magnet"]
    strongest = max(magnets, default=None, key=lambda one: one.force_available_n)
    mass = machine.record.drive.mass_g / G_PER_KG
    does = [
        "Clean the balls with alcohol. Touch them only with gloves from now on.",
        when(machine.record.caps, "Push the caps into their seats, too."),
        "Put each into the seat with its number on the back, in any order. balls.csv lists the "
        "balls by number."
        if strongest
        else "Put a small drop of glue into the well of each seat, none on the pads, and the ball "
        "on it.",
        f"The magnet of ball {strongest.ball} pulls with {strongest.force_available_n:.0f} N: let "
        "the ball down by hand, and keep fingers off the edge of the cup."
        if strongest
        else "",
    ]
    named = ((one.ball, machine.ref(f"ball {machine.sizes[one.ball]}")) for one in held)
    checks = [
        *(f"{name.capitalize()} in seat {number}." for number, name in named),
        "Each touches its three pads and does not rock. It stays in its seat when the base is "
        f"turned through its whole travel; the base weighs {mass:.1f} kg now.",
    ]
    return does, checks


@planned("Shroud", "shroud_*", loose=("sheets",))
def shroud(machine: AssembledMachine) -> Words:
    """The box of card."""
    box = machine.record.shroud
    assert box is not None
    does = [
        *(
            f"Cut {one.dxf}: {one.what}, {one.size_mm[0]:.0f} x {one.size_mm[1]:.0f} mm."
            for one in box.panels
        ),
        "Lay the floor under the plate first; cables go out through the notch of the back.",
        "Score the dashed lines. Fold the flaps of front, back and right side inward by 90 degrees "
        "and glue them. The left side is held by tape, so that it comes off: the object is placed "
        "and turned through it.",
    ]
    checks = [
        "No part touches the card over the whole travel of the base.",
        "With the room lit and the lamps off, a long exposure stays black.",
    ]
    return does, checks


@planned("First photographs")
def first(machine: AssembledMachine) -> Words:
    """The program's first run."""
    phases = machine.record.controller.phases
    low, high = machine.record.swing_deg
    names = ", ".join(one.name.replace("_", " ") for one in phases)
    does = [
        "Object on the disc, shroud closed. tbcad run drives machine and camera and keeps the "
        "photographs; any G-code sender runs rotation_plan.nc with the camera on the relay.",
        f"At each stop it takes {len(phases)} photographs: {names}.",
        "When the program waits, turn the disc with the object by 180 degrees and let it go on.",
    ]
    checks = [
        f"The base swings from {low:.0f} to {high:.0f} degrees and touches nothing. The first "
        "time, keep a hand at Ctrl-C of tbcad run, or at the sender's feed hold (Klipper: pause), "
        "which stop it with the motor on. The supply's switch, an emergency stop in it, its plug "
        "and its fuse let it fall.",
        "The number of photographs is the same in both runs.",
        "Afterwards the base is at zero and the zero pin in, before the supply is switched off.",
    ]
    return does, checks

"""The program against the plan: every photograph once, at its angle, at rest, from below.

What a program does is taken from a machine that runs it; what it has to do, from the stops and
from the motion that the design asks for.

Klipper obeys all that it reads: an include, a macro with the name of a command, a section twice. So
both texts are read by closed grammars, and the program is run by the same machine. The
configuration has no line but those that tbcad writes, in their order; pins are the user's, each for
one purpose, their inversions are not.
Sources: idle_timeout.py, stepper_enable.py and static_digital_output.py of Klipper: without
[idle_timeout], or without its gcode, M84 comes after 600 s at rest; a shutdown takes the enable_pin
of a stepper back, and leaves a static output as it is.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import zip_longest

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_machine import (
    LAMP,
    Line,
    Machine,
    Photograph,
    numbers,
    run_lines,
    run_program,
)
from tbcad_verify.prototype.drive_checks import FULL_STEPS, gear_of
from tbcad_verify.record.prototype import KLIPPER_CONFIG
from tbcad_verify.record.spec import MotionSpec
from tbcad_verify.report.checks import Check, CheckName, no_faults
from tbcad_verify.step.solids_text import TextSolid

PROGRAM_DEG = 1.0001e-4  # the digits of angles in the program
PROGRAM_DIGITS = 4
PROGRAM_S = 5.1e-4  # of durations
SHARE = 1e-5  # of other numbers, which have six digits
RUNS = 2  # one for each turn of the object
PAUSES = {"grblhal": ["pin", "turn"], "grbl": ["base", "turn"], "klipper": ["pin", "turn"]}
PULL_OFF_DEG = 2.0
NUMBER = r"-?\d+(?:\.\d+)?"
BASE = "MANUAL_STEPPER STEPPER=base"
# Lines, and the words of a controller that do the same.
FORMS = {
    re.compile(form): code
    for form, code in {
        r"; stop (?P<stop>\d+) of \d+: \d+ mirrors": "",
        r'RESPOND MSG="zero pin (?P<pin>out), object straight"': "RESPOND",
        r'RESPOND MSG="turn the object by (?P<turn>180) degrees about z"': "RESPOND",
        r'RESPOND MSG="stop (?P<photograph>\d+): (?:(?P<phase>dark|led_\d+|lit), )?photograph"': (
            "RESPOND"
        ),
        "PAUSE": "M0",
        rf"{BASE} ENABLE=1 SET_POSITION=0": "ENABLE",
        rf"{BASE} MOVE=-\d+(?:\.\d+)? SPEED={NUMBER} STOP_ON_ENDSTOP=1": "$H",
        rf"{BASE} SET_POSITION=(?P<X>{NUMBER})": "G92",
        rf"{BASE} MOVE=(?P<X>{NUMBER}) SPEED=(?P<F>{NUMBER})": "G1",
        r"G4 P(?P<P>\d+)": "G4",
        r"SET_PIN PIN=release VALUE=1": "M8",
        r"SET_PIN PIN=release VALUE=0": "M9",
        r"SET_PIN PIN=(?P<P>lamp|led_\d+) VALUE=1": "M64",
        r"SET_PIN PIN=(?P<P>lamp|led_\d+) VALUE=0": "M65",
    }.items()
}
SECOND_MS, MINUTE_S = 1000.0, 60.0
PIN, OPEN = r"[\w.:]+", "FILL_IN"
CONFIG = (
    "# base of the prototype: degrees for millimetres; fill in the pins of the board",
    "# zero pin in before RESTART, FIRMWARE_RESTART or the supply's switch: they let it fall",
    *(r"\[printer\]", "kinematics: none", "max_velocity: 1000", "max_accel: 1000"),
    *(r"\[pause_resume\]", r"\[respond\]", r"\[idle_timeout\]", "timeout: 86400", "gcode:"),
    r'    RESPOND MSG="idle, the motor stays on"',
    *(r"\[static_digital_output base_enable\]", f"pins: {PIN}", r"\[manual_stepper base\]"),
    # Normally closed to ground: pulled up, high when pressed.
    *(rf"step_pin: {PIN}", rf"dir_pin: {PIN}", rf"endstop_pin: \^{PIN}"),
)
FIGURE_SHARE = 1e-5
SAME_DEG = 2.1e-4
FILE = KLIPPER_CONFIG
CHECKS = {"klipper": "faults"}


def program_faults(context: PrototypeContext) -> Iterator[str]:
    """Faults of the program, and its deviations from the plan."""
    if is_klipper(context):
        yield from klipper_faults(context)
        return
    machine = run_program(context.prototype.program, *homing(context))
    yield from [*machine.faults, *deviations(context, machine)]


def deviations(context: PrototypeContext, machine: Machine) -> Iterator[str]:
    """Deviations of a machine's actions from the design."""
    yield from _travel(context, machine)
    motion, stops = context.export.spec.prototype.motion, context.prototype.stops
    lights = expected_lights(context)
    expected = np.repeat(np.tile(stops.angle, RUNS), len(lights))
    if machine.angles.shape != expected.shape:
        yield f"{machine.angles.size} photographs, not {expected.size}"
    else:
        for k, one in enumerate(machine.photographs):
            taken, phase = divmod(k, len(lights))
            turned, stop = divmod(taken, len(stops))
            if not abs(one.angle - expected[k]) <= PROGRAM_DEG:
                yield f"photograph {k + 1} at {one.angle:.4f} deg"
            if one.turned != turned:
                yield f"photograph {k + 1} with the object turned {one.turned} times"
            if one.stop != stop + 1:
                yield f"photograph {k + 1} has another comment than its stop"
            yield from (f"photograph {k + 1} {what}" for what in _unlike_light(one, lights, phase))
    low = min(machine.driven, default=np.nan)
    for k, one in enumerate(machine.photographs):
        if not one.rising and one.angle > low + PROGRAM_DEG:
            yield f"photograph {k + 1} is approached from above"
        switched = len(lights) > 1
        yield from (f"photograph {k + 1} {what}" for what in _unlike_motion(one, motion, switched))


def homing(context: PrototypeContext) -> tuple[float, float]:
    """Base angles at which the switch trips and homing ends, degrees; NaN without homing."""
    motion, home = context.export.spec.prototype.motion, context.prototype.home
    if motion.controller == "grbl":
        return np.nan, np.nan
    return home.switch, round(home.switch + PULL_OFF_DEG + motion.home_trim_deg, PROGRAM_DIGITS)


def expected_lights(context: PrototypeContext) -> list[tuple[float, frozenset[int]]]:
    """Number of each photograph of a stop, and the digital outputs that are on in it.

    The number is 0 in the dark, -1 for the lamp, else that of an LED. The lamp is on output 0, LED
    k on output k. GRBL 1.1 has no such outputs: there is one photograph, of the lit object.
    """
    if context.export.spec.prototype.motion.controller == "grbl":
        return [(LAMP, frozenset())]
    leds = range(1, len(context.prototype.leds) + 1)
    alone = [(float(led), frozenset({led})) for led in leds]
    return [(0.0, frozenset()), *alone, (LAMP, frozenset({0}))]


def _unlike_light(
    one: Photograph, lights: list[tuple[float, frozenset[int]]], phase: int
) -> Iterator[str]:
    number, outputs = lights[phase]
    if one.lights != outputs:
        yield f"with outputs {sorted(one.lights) or 'none'} on, not {sorted(outputs) or 'none'}"
    told = one.phase if len(lights) > 1 else number
    if np.isinf(one.released) and told != number:
        yield "with a pause that tells another light"


def _unlike_motion(one: Photograph, motion: MotionSpec, switched: bool) -> Iterator[str]:
    """Faults of the motion about one photograph; switched: lights are."""
    if switched and one.lit < motion.light_s - PROGRAM_S:
        yield f"{one.lit:g} s after a light was switched"
    if one.settled < motion.settle_s - PROGRAM_S:
        yield f"{one.settled:g} s after the motion"
    if np.isinf(one.released) != (motion.trigger == "pause"):
        yield "with another trigger"
    # Written so that NaN, of a release that is never turned off, fails.
    if not one.released >= motion.trigger_s - PROGRAM_S:
        yield f"with the release on for {one.released:g} s"
    if not one.waited >= motion.exposure_s - PROGRAM_S:
        yield f"{one.waited:g} s before the next motion"


def _travel(context: PrototypeContext, machine: Machine) -> Iterator[str]:
    motion, (low, high) = context.export.spec.prototype.motion, context.prototype.swing
    pauses = PAUSES[motion.controller]
    if machine.axis != motion.axis:
        yield f"drives axis {machine.axis or 'none'}"
    if machine.pauses != pauses:
        yield f"pauses for {', '.join(machine.pauses) or 'nothing'}, not for {', '.join(pauses)}"
    if machine.homes != (motion.controller != "grbl"):
        yield f"homes {machine.homes} times"
    for angle in machine.bases:
        if not math.isclose(angle, motion.home_deg, rel_tol=SHARE):
            yield f"starts at {angle:g} deg"
    if not machine.moves or abs(machine.moves[-1] - motion.home_deg) > PROGRAM_DEG:
        yield "does not end at home_deg"
    for speed in machine.feeds:
        if not math.isclose(speed, motion.feed_deg_min, rel_tol=SHARE):
            yield f"a speed of {speed:g}"
    for angle in machine.moves:
        if not low - PROGRAM_DEG <= angle <= high + PROGRAM_DEG:
            yield f"{angle:.4f} deg is beyond the swing"
    reached = [*machine.moves, *machine.bases]
    for name, end, far in (("lower", low, min), ("upper", high, max)):
        if reached and abs(far(reached) - end) > PROGRAM_DEG:
            yield f"{far(reached):.4f} deg is not the swing's {name} end"


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """Lines of the configuration; no other controller has one."""
    ratio = gear_of(context, solids).ratio
    return [no_faults(names[0], [*config_faults(context, ratio)] if is_klipper(context) else [])]


def is_klipper(context: PrototypeContext) -> bool:
    """Whether the design's controller is Klipper."""
    return context.export.spec.prototype.motion.controller == "klipper"


def klipper_faults(context: PrototypeContext) -> Iterator[str]:
    """Faults of Klipper's program, run by the machine that runs G-code."""
    text = context.prototype.klipper
    motion, (switch, homed) = context.export.spec.prototype.motion, homing(context)
    machine = run_klipper(text, motion.axis, switch, switch + motion.home_trim_deg)
    yield from machine.faults
    # A controller drives off the switch by itself, as part of homing; here it is the first motion.
    off, feed = next(iter(machine.driven), math.nan), next(iter(machine.feeds), math.nan)
    if not (abs(off - homed) <= SAME_DEG and feed <= motion.feed_deg_min):
        yield "drives off the switch to another angle, or too fast"
    moves = machine.moves[:2] + machine.moves[3:]
    yield from deviations(context, replace(machine, moves=moves, feeds=machine.feeds[1:]))


def run_klipper(text: str, axis: str, switch: float, homed: float) -> Machine:
    """Run a Klipper program; its end is that of its text, its coordinates are the switch's."""
    lines, faults = [Line(0, "G21", {}, {})], []
    said, enabled = dict[str, float](), False
    for number, line in enumerate(text.splitlines(), 1):
        if (found := _parsed(line)) is None:
            faults.append(f"line {number} is none that a plan has")
            continue
        told, code = found
        enabled |= code == "ENABLE"
        if code == "$H" and not enabled:
            faults.append(f"line {number} homes before the motor is on")
        if code == "RESPOND":
            said = told
        elif code == "M0":
            lines.append(Line(number, code, {}, said))
            said = {}
        elif code != "ENABLE":
            scale = {"F": MINUTE_S} | ({"P": 1 / SECOND_MS} if code == "G4" else {})
            values = {name: value * scale.get(name, 1.0) for name, value in told.items()}
            if "X" in values:
                values[axis] = values.pop("X")
            # Pins wait for the motion, as moves do.
            lines += [Line(number, "G4", {"P": 0.0}, {})] * code.startswith(("M6", "M8", "M9"))
            lines.append(Line(number, code, values, told))
    return run_lines([*lines, Line(len(lines), "M2", {}, {})], faults, switch, homed)


@lru_cache
def _parsed(line: str) -> tuple[dict[str, float], str] | None:
    """The numbers that a line tells, and its code; most lines come often."""
    found = ((form.fullmatch(line), code) for form, code in FORMS.items())
    return next(((numbers(match), code) for match, code in found if match), None)


def config_faults(context: PrototypeContext, ratio: float) -> Iterator[str]:
    """The first line that is another; what its comments tell is obeyed by people."""
    text = context.prototype.klipper_config
    lines = text.splitlines()
    forms: list[str | tuple[str, float]] = [*CONFIG, *_steps(context, ratio)]
    for name in ("release", "lamp", *(f"led_{k + 1}" for k in range(len(context.prototype.leds)))):
        forms += [rf"\[output_pin {name}\]", rf"pin: {PIN}", "value: 0"]
    for line, form in zip_longest(lines, forms):
        if line is None or form is None or not _fits(line, form):
            yield f"{KLIPPER_CONFIG}: {line or 'its end'!r}, allowed is {form or 'its end'!r}"
            return
    pins = re.findall(rf"pins?: \^?({PIN})$", text, re.MULTILINE)
    for pin, count in Counter(pins).items():
        if count > 1 and pin != OPEN:
            yield f"{KLIPPER_CONFIG}: pin {pin} is there {count} times, each is for one purpose"


def _steps(context: PrototypeContext, ratio: float) -> Iterator[tuple[str, float]]:
    """Name and value of what makes degrees of steps; a gear is turns to one."""
    motion = context.export.spec.prototype.motion
    yield "rotation_distance", 360.0
    yield "gear_ratio", ratio
    yield "full_steps_per_rotation", FULL_STEPS
    yield "microsteps", float(motion.microsteps)
    yield "velocity", motion.feed_deg_min / MINUTE_S
    yield "accel", motion.acceleration_deg_s2


def _fits(line: str, form: str | tuple[str, float]) -> bool:
    if isinstance(form, str):
        return re.fullmatch(form, line) is not None
    found = re.fullmatch(rf"{form[0]}: ({NUMBER}){':1' if form[0] == 'gear_ratio' else ''}", line)
    return found is not None and math.isclose(float(found[1]), form[1], rel_tol=FIGURE_SHARE)

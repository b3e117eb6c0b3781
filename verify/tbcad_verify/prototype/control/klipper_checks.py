"""The Klipper program and configuration: the same photographs as the controller's program takes.

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

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_checks import deviations, homing
from tbcad_verify.prototype.control.gcode_machine import Line, Machine, numbers, run_lines
from tbcad_verify.prototype.drive_checks import FULL_STEPS, gear_of
from tbcad_verify.record.prototype import KLIPPER, KLIPPER_CONFIG
from tbcad_verify.report.checks import Check, CheckName, at_most, no_faults, require
from tbcad_verify.step.solids_text import TextSolid

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
FILE = KLIPPER
CHECKS = {"klipper": "faults"}


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """Angles, lights, times and pauses of all photographs; lines of the configuration."""
    if context.export.spec.prototype.motion.controller == "grbl":
        return [at_most(names[0], 0, 0)]
    faults = [*program_faults(context), *config_faults(context, gear_of(context, solids).ratio)]
    return [no_faults(names[0], faults)]


def program_faults(context: PrototypeContext) -> Iterator[str]:
    """What the machine of the controller's program finds wrong when it does the same."""
    text = require(context.prototype.klipper, f"there is no {KLIPPER}")
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
    text = require(context.prototype.klipper_config, f"there is no {KLIPPER_CONFIG}")
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

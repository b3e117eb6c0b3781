"""The Klipper program and configuration: the same photographs as the verified program takes.

Klipper obeys all that it reads: an include, a macro with the name of a command, a section twice. So
both texts are read by closed grammars. The configuration has no line but those that tbcad writes,
in their order; pins are the user's, their inversions are not.
Sources: idle_timeout.py, stepper_enable.py and static_digital_output.py of Klipper: without
[idle_timeout], or without its gcode, M84 comes after 600 s at rest; a shutdown takes the enable_pin
of a stepper back, and leaves a static output as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_checks import homing
from tbcad_verify.prototype.control.gcode_machine import run_program
from tbcad_verify.prototype.drive_checks import gear_of
from tbcad_verify.record.prototype import KLIPPER, KLIPPER_CONFIG
from tbcad_verify.report.checks import Check, CheckName, at_most, require, short_list
from tbcad_verify.step.solids_text import TextSolid

NUMBER = r"-?\d+(?:\.\d+)?"
BASE = "MANUAL_STEPPER STEPPER=base"
TOLD = "zero pin out, object straight"
FORMS = tuple(
    re.compile(form)
    for form in (
        r"; stop \d+ of \d+: \d+ mirrors",
        rf'RESPOND MSG="(?P<told>{TOLD})"',
        r'RESPOND MSG="turn the object by (?P<turned>180) degrees about z"',
        r'RESPOND MSG="stop \d+: (?:(?:dark|led_\d+|lit), )?photograph"',
        r"(?P<pause>PAUSE)",
        rf"{BASE} ENABLE=(?P<enable>1) SET_POSITION=0",
        rf"{BASE} MOVE=(?P<search>-\d+(?:\.\d+)?) SPEED={NUMBER} STOP_ON_ENDSTOP=1",
        rf"{BASE} SET_POSITION=(?P<switch>{NUMBER})",
        rf"{BASE} MOVE=(?P<move>{NUMBER}) SPEED=(?P<speed>{NUMBER})",
        r"G4 P(?P<dwell>\d+)",
        r"SET_PIN PIN=(?P<pin>release|lamp|led_\d+) VALUE=(?P<value>[01])",
    )
)
DWELL = re.compile(r"^G4 P(\d+\.\d+)$", re.MULTILINE)
PIN = r"[\w.:]+"
CONFIG = (
    *(r"\[printer\]", "kinematics: none", "max_velocity: 1000", "max_accel: 1000"),
    *(r"\[pause_resume\]", r"\[respond\]", r"\[idle_timeout\]", r"timeout: \d+", "gcode:"),
    r'    RESPOND MSG="idle, the motor stays on"',
    *(r"\[static_digital_output base_enable\]", rf"pins: !?{PIN}", r"\[manual_stepper base\]"),
    # Normally closed to ground: pulled up, high when pressed.
    *(rf"step_pin: {PIN}", rf"dir_pin: {PIN}", rf"endstop_pin: \^{PIN}"),
)
SAME_DEG = 2.1e-4
SHARE, FIGURE_SHARE = 1e-6, 1e-5
MINUTE_S = 60.0
CHECKS = {"klipper": "faults"}


@dataclass
class _State:
    """What a Klipper host would do."""

    angle: float = math.nan  # of the base, degrees; NaN before homing
    on: set[str] = field(default_factory=set)  # names of pins that are on
    # angle, lights and turns of the object before it, of each photograph
    taken: list[tuple[float, frozenset[str], int]] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)  # of moves, degrees a second
    said: str = ""  # the last words before a pause; empty after it
    # what was done on the way to homing: "told" to take the pin out, "enable", "search"
    done: set[str] = field(default_factory=set)
    turns: int = 0  # of the object so far
    dwells: list[int] = field(default_factory=list)  # in order, ms
    faults: list[str] = field(default_factory=list)  # what no program may do


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """Angles, lights and pauses of all photographs; lines of the configuration."""
    if context.export.spec.prototype.motion.controller == "grbl":
        return [at_most(names[0], 0, 0)]
    faults = [*_program(context), *_config(context, gear_of(context, solids).ratio)]
    return [at_most(names[0], len(faults), 0, short_list(faults))]


def _program(context: PrototypeContext) -> Iterator[str]:
    text = require(context.prototype.klipper, f"there is no {KLIPPER}")
    switch, homed = homing(context)
    motion = context.export.spec.prototype.motion
    state = _run(text, switch + motion.home_trim_deg)
    yield from state.faults
    program = context.prototype.program
    machine = run_program(program, switch, homed)
    if motion.trigger == "coolant":
        expected = [(one.angle, one.lights, one.turned) for one in machine.photographs]
        if len(state.taken) != len(expected):
            yield f"{len(state.taken)} photographs, not {len(expected)}"
            return
        for k, (one, two) in enumerate(zip(state.taken, expected, strict=True), 1):
            outputs = frozenset("lamp" if out == 0 else f"led_{out}" for out in two[1])
            if abs(one[0] - two[0]) > SAME_DEG or (one[1], one[2]) != (outputs, two[2]):
                yield f"photograph {k} is another"
    if state.dwells != [round(1000 * float(dwell)) for dwell in DWELL.findall(program)]:
        yield "waits for other times"
    fastest = motion.feed_deg_min / MINUTE_S * (1 + SHARE)
    if any(speed > fastest for speed in state.speeds):
        yield f"a speed of {max(state.speeds):g} degrees a second"


def _run(text: str, switch: float) -> _State:
    state = _State()
    for number, line in enumerate(text.splitlines(), 1):
        found = next((match for form in FORMS if (match := form.fullmatch(line))), None)
        if found is None:
            state.faults.append(f"line {number} is none that a plan has")
            continue
        told = {name: value for name, value in found.groupdict().items() if value is not None}
        state.faults += [f"line {number} {what}" for what in _step(state, told, switch)]
    if state.on:
        state.faults.append(f"ends with {min(state.on)} on")
    return state


def _step(state: _State, told: dict[str, str], switch: float) -> Iterator[str]:
    if "pause" in told:
        state.done |= {"told"} & {state.said}
        state.turns += state.said == "turned"
    if "told" in told or "turned" in told or "pause" in told:
        state.said = "".join({"told", "turned"} & told.keys())
    if "dwell" in told:
        state.dwells.append(int(told["dwell"]))
    yield from _homing_faults(state, told, switch)
    if ("move" in told or "search" in told) and state.on:
        yield f"moves with {min(state.on)} on"
    if "move" in told:
        if math.isnan(state.angle):
            yield "moves before homing"
        state.angle = float(told["move"])
        state.speeds.append(float(told["speed"]))
    if "pin" in told:
        if told["value"] == "1" and told["pin"] == "release":
            state.taken.append((state.angle, frozenset(state.on), state.turns))
        (state.on.add if told["value"] == "1" else state.on.discard)(told["pin"])


def _homing_faults(state: _State, told: dict[str, str], switch: float) -> Iterator[str]:
    if "search" in told and not {"told", "enable"} <= state.done:
        yield "homes before the zero pin is told to be out and the motor on"
    state.done |= {"enable", "search"} & told.keys()
    if "switch" in told:
        if "search" not in state.done:
            yield "sets the switch's angle without a search for it"
        state.angle = float(told["switch"])
        if abs(state.angle - switch) > SAME_DEG:
            yield f"sets {state.angle:g} deg at the switch"


def _config(context: PrototypeContext, ratio: float) -> Iterator[str]:
    """The first line that is another; comments and blank lines have no use."""
    text = require(context.prototype.klipper_config, f"there is no {KLIPPER_CONFIG}")
    lines = [line for line in text.splitlines() if line and not line.startswith("# ")]
    forms: list[str | tuple[str, float]] = [*CONFIG, *_steps(context, ratio)]
    for name in ("release", "lamp", *(f"led_{k + 1}" for k in range(len(context.prototype.leds)))):
        forms += [rf"\[output_pin {name}\]", rf"pin: {PIN}", "value: 0"]
    for line, form in zip_longest(lines, forms):
        if line is None or form is None or not _fits(line, form):
            yield f"{KLIPPER_CONFIG}: {line or 'its end'!r} is no {form or 'line of it'!r}"
            return


def _steps(context: PrototypeContext, ratio: float) -> Iterator[tuple[str, float]]:
    """Name and value of what makes degrees of steps; a gear is turns to one."""
    motion = context.export.spec.prototype.motion
    yield from {
        "rotation_distance": 360.0,
        "gear_ratio": ratio,
        "full_steps_per_rotation": 200.0,
        "microsteps": float(motion.microsteps),
        "velocity": motion.feed_deg_min / MINUTE_S,
        "accel": motion.acceleration_deg_s2,
    }.items()


def _fits(line: str, form: str | tuple[str, float]) -> bool:
    if isinstance(form, str):
        return re.fullmatch(form, line) is not None
    found = re.fullmatch(rf"{form[0]}: ({NUMBER}){':1' if form[0] == 'gear_ratio' else ''}", line)
    return found is not None and math.isclose(float(found[1]), form[1], rel_tol=FIGURE_SHARE)

"""The Klipper program and configuration: the same photographs as the verified program takes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.gcode_checks import homing
from tbcad_verify.prototype.gcode_machine import run_program
from tbcad_verify.prototype.klipper_config import OUTPUT, STEPPER, lets_go, parsed_config
from tbcad_verify.record.prototype import KLIPPER, KLIPPER_CONFIG
from tbcad_verify.report.checks import Check, CheckName, at_most, require, short_list

NUMBER = r"-?\d+(?:\.\d+)?"
BASE = "MANUAL_STEPPER STEPPER=base"
FORMS = tuple(
    re.compile(form)
    for form in (
        r"; stop (?P<stop>\d+) of \d+: \d+ mirrors",
        r'RESPOND MSG="[^"]{1,70}"',
        r"(?P<pause>PAUSE)",
        rf"{BASE} ENABLE=1 SET_POSITION=0",
        rf"{BASE} MOVE=(?P<search>-{NUMBER.removeprefix('-?')}) SPEED={NUMBER} STOP_ON_ENDSTOP=1",
        rf"{BASE} SET_POSITION=(?P<switch>{NUMBER})",
        rf"{BASE} MOVE=(?P<move>{NUMBER}) SPEED=(?P<speed>{NUMBER})",
        r"G4 P(?P<dwell>\d+)",
        r"SET_PIN PIN=(?P<pin>release|lamp|led_\d+) VALUE=(?P<value>[01])",
    )
)
SAME_DEG, SAME_S = 2.1e-4, 1.1e-3
SHARE = 1e-6
MINUTE_S = 60.0
CHECKS = {"klipper": "faults"}


@dataclass
class _State:
    """What a Klipper host would do.

    Attributes:
        angle: of the base, degrees; NaN before homing.
        on: names of pins that are on.
        taken: angle, lights and pauses before it, of each photograph.
        speeds: of moves, degrees a second.
        pauses: so far.
        faults: what no program may do.
    """

    angle: float = math.nan
    on: set[str] = field(default_factory=set)
    taken: list[tuple[float, frozenset[str], int]] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    pauses: int = 0
    faults: list[str] = field(default_factory=list)


def checks(names: list[CheckName], context: PrototypeContext) -> list[Check]:
    """Angles, lights and pauses of all photographs; steps of the configuration."""
    if context.export.spec.prototype.motion.controller == "grbl":
        return [at_most(names[0], 0, 0)]
    faults = [*_program(context), *_config(context)]
    return [at_most(names[0], len(faults), 0, short_list(faults))]


def _program(context: PrototypeContext) -> Iterator[str]:
    text = require(context.prototype.klipper, f"there is no {KLIPPER}")
    switch, homed = homing(context)
    state = _run(text, switch + context.export.spec.prototype.motion.home_trim_deg)
    yield from state.faults
    machine = run_program(context.prototype.program, switch, homed)
    motion = context.export.spec.prototype.motion
    if motion.trigger == "coolant":
        expected = [(one.angle, one.lights, one.turned + 1) for one in machine.photographs]
        if len(state.taken) != len(expected):
            yield f"{len(state.taken)} photographs, not {len(expected)}"
            return
        for k, (one, two) in enumerate(zip(state.taken, expected, strict=True), 1):
            outputs = frozenset("lamp" if out == 0 else f"led_{out}" for out in two[1])
            if abs(one[0] - two[0]) > SAME_DEG or (one[1], one[2]) != (outputs, two[2]):
                yield f"photograph {k} is another"
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
        state.pauses += 1
    if "switch" in told:
        state.angle = float(told["switch"])
        if abs(state.angle - switch) > SAME_DEG:
            yield f"sets {state.angle:g} deg at the switch"
    if "move" in told or "search" in told:
        if state.on:
            yield f"moves with {min(state.on)} on"
        if "move" in told:
            if math.isnan(state.angle):
                yield "moves before homing"
            state.angle = float(told["move"])
            state.speeds.append(float(told["speed"]))
    if "pin" in told:
        if told["value"] == "1" and told["pin"] == "release":
            state.taken.append((state.angle, frozenset(state.on), state.pauses))
        (state.on.add if told["value"] == "1" else state.on.discard)(told["pin"])


def _config(context: PrototypeContext) -> Iterator[str]:
    text = require(context.prototype.klipper_config, f"there is no {KLIPPER_CONFIG}")
    sections, faults = parsed_config(text)
    yield from faults
    yield from lets_go(sections)
    values = sections.get(STEPPER, {})
    motion, drive = context.export.spec.prototype.motion, context.prototype.drive
    ratio = re.fullmatch(rf"({NUMBER}):1", values.get("gear_ratio", ""))
    expected = {
        "rotation_distance": 360.0,
        "full_steps_per_rotation": 200.0,
        "microsteps": float(motion.microsteps),
        "velocity": motion.feed_deg_min / MINUTE_S,
        "accel": motion.acceleration_deg_s2,
    }
    for name, value in expected.items():
        if not math.isclose(float(values.get(name, "nan")), value, rel_tol=1e-5):
            yield f"{name} is {values.get(name)}"
    if not ratio or not math.isclose(float(ratio[1]), drive.ratio, rel_tol=1e-5):
        yield f"gear_ratio is {values.get('gear_ratio')}"
    pins = ["release", "lamp", *(f"led_{k + 1}" for k in range(len(context.prototype.leds)))]
    if [name.split()[1] for name in sections if name.startswith(OUTPUT)] != pins:
        yield "its output pins are others"

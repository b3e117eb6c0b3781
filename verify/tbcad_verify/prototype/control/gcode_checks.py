"""The program against the plan: every photograph once, at its angle, at rest, from below.

What the program does is taken from a machine that runs it; what it has to do, from the stops and
from the motion that the design asks for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_machine import LAMP, Machine, Photograph, run_program
from tbcad_verify.record.spec import MotionSpec
from tbcad_verify.report.checks import Check, CheckName, no_faults

PROGRAM_DEG = 1.0001e-4  # the digits of angles in the program
PROGRAM_DIGITS = 4
PROGRAM_S = 5.1e-4  # of durations
SHARE = 1e-5  # of other numbers, which have six digits
RUNS = 2  # one for each turn of the object
PAUSES = {"grblhal": ["pin", "turn"], "grbl": ["base", "turn"]}
PULL_OFF_DEG = 2.0


def program_check(name: CheckName, context: PrototypeContext) -> Check:
    """Run the program, and compare what it does with the stops."""
    machine = run_program(context.prototype.program, *homing(context))
    return no_faults(name, [*machine.faults, *deviations(context, machine)])


def deviations(context: PrototypeContext, machine: Machine) -> Iterator[str]:
    """What a machine did otherwise than the design asks for."""
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
    """What is wrong with the motion about one photograph; switched: lights are."""
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
    if machine.homes != (motion.controller == "grblhal"):
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

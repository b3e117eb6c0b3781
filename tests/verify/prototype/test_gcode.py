"""Programs run by the machine of the verification: what is wrong with each is said."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_checks import homing, program_check
from tbcad_verify.prototype.control.gcode_machine import run_program
from tbcad_verify.record.export import read_export

NAME = ("plan program", "rotation_plan.nc", "faults")
START = (
    "M0 (MSG, base at 2 degrees, object straight? Then resume)\n"
    "G21 G90 G94 G54 (a degree for a millimetre, absolute, units a minute)\n"
)


@pytest.fixture(scope="module")
def context(synthetic_prototype: Path) -> PrototypeContext:
    export = read_export(synthetic_prototype)
    assert export.prototype is not None
    return PrototypeContext(export, export.prototype)


def said(context: PrototypeContext, text: str) -> str:
    changed = context.prototype.model_copy(update={"program": text})
    check = program_check(NAME, replace(context, prototype=changed))
    assert check.passed == (not check.detail)
    return check.detail


def test_a_machine_knows_the_true_angle_whatever_the_offset() -> None:
    machine = run_program(START + "G92 X5.0000\nG1 X7.0000 F60\nG4 P2.000\nG1 X1.0000\nM2\n")
    assert machine.faults == []
    assert machine.moves == [4.0, -2.0]
    assert not machine.rising


def test_a_photograph_knows_when_it_is_taken() -> None:
    text = START + "G92 A2.0000\nG1 A3.0000 F60\nG4 P0.500\nM8\nG4 P0.200\nM9\nG4 P1.000\nM2\n"
    machine = run_program(text)
    (one,) = machine.photographs
    assert (one.angle, one.settled, one.rising, one.turned) == (3.0, 0.5, True, 0)
    assert (one.released, one.waited) == pytest.approx((0.2, 1.0))
    pause = START + "G92 A2.0000\nG1 A3.0000 F60\nM0 (MSG, stop 1: photograph, then resume)\nM2\n"
    (one,) = run_program(pause).photographs
    assert (one.released, one.waited, one.settled) == (math.inf, math.inf, 0)


def test_the_program_of_the_plan_has_no_fault(context: PrototypeContext) -> None:
    assert said(context, context.prototype.program) == ""


def test_another_axis_is_the_designs(context: PrototypeContext) -> None:
    text = context.prototype.program.replace(" X", " A")
    spec = context.export.spec
    motion = spec.prototype.motion.model_copy(update={"axis": "A"})
    prototype = spec.prototype.model_copy(update={"motion": motion})
    export = replace(context.export, spec=spec.model_copy(update={"prototype": prototype}))
    assert said(replace(context, export=export), text) == ""


def once(old: str, new: str) -> Callable[[str], str]:
    return lambda text: text.replace(old, new, 1)


def at_end(old: str, new: str) -> Callable[[str], str]:
    return lambda text: new.join(text.rsplit(old, 1))


def without(pattern: str, count: int = 0) -> Callable[[str], str]:
    return lambda text: re.sub(pattern, "", text, count=count)


def after_a_move(line: str) -> Callable[[str], str]:
    return once("G4 P0.500\n", f"{line}\nG4 P0.500\n")


TURN = "M0 (MSG, turn the object by 180 degrees about z, then resume)"
FOREIGN = (
    *("G28", "G2 X1.0000", "Y5000", "G1 Y5000", "G93", "G10 L2 P1 X5", "G55", "M7", "M30", "G20"),
    *("G91", "G53", "G0 X1.0000", "M3 S100", "$H", "/G4 P1.000", "g1 x1.0000", "G1X1.0000", "%"),
    *("G1 X1.0000 (take care!)", "T1", "G1 X1.00001", "G1 X1e3", "(turn the object by 90 degrees)"),
)
FAULTS: dict[str, tuple[Callable[[str], str], str]] = {
    "another base angle by G92": (
        lambda text: re.sub("G92 X.*", "G92 X50.0000", text),
        "deg is beyond the swing",
    ),
    "G92 on the way": (after_a_move("G92 X0.0000"), "sets a coordinate after a motion"),
    "the end halfway": (after_a_move("M2"), "stands after the end"),
    "no end": (at_end("M2\n", ""), "the program has no end"),
    "cut in a line": (lambda text: text[:-2], "the last line is cut"),
    "the object never turned": (
        without(r"M0 \(MSG, turn.*\n"),
        "pauses for pin, not for pin, turn",
    ),
    "the object turned at once": (
        lambda text: once(
            "G92 X", "M0 (MSG, turn the object by 180 degrees about z, then resume)\nG92 X"
        )(without(r"M0 \(MSG, turn.*\n")(text)),
        "photograph 1 with the object turned 1 times",
    ),
    "no pause at the start": (without(r"M0 \(MSG, zero.*\n"), "before the zero pin is told"),
    "no homing": (without(r"\$H\n"), "before a person has put the base"),
    "homing after the coordinate is set": (
        lambda text: once("M65 P1\n", "$H\nM65 P1\n")(without(r"\$H\n")(text)),
        "before a person has put the base",
    ),
    "homing with a light on": (once("$H\n", "M64 P1\n$H\n"), "with a light on"),
    "homing twice": (once("$H\n", "$H\n$H\n"), "homes"),
    "no dwell before photographs": (without("G4 P0.[15]00\n"), "0 s after the motion"),
    "a dwell too short": (once("G4 P0.500", "G4 P0.100"), "photograph 1 0.2 s after the motion"),
    "a dwell too short at the end": (at_end("G4 P0.500", "G4 P0.100"), "0.2 s after the motion"),
    "a light without a dwell": (without("G4 P0.500\n(?=G4 P0.100\n)"), "0.1 s after the motion"),
    "a light that is switched while the base turns": (
        once("G4 P0.500\n", "M64 P1\nM65 P1\nG4 P0.500\n"),
        "switches a light before the motion has ended",
    ),
    "a light that stays on": (without("M65 P0\n(?=\\(stop)"), "moves while a light is on"),
    "a light that is never turned on": (without("M64 P1\n"), "outputs none on, not [1]"),
    "a light on while it is dark": (
        once("G4 P0.500\n", "G4 P0.500\nM64 P0\n"),
        "outputs [0] on, not none",
    ),
    "lamp and LED exchanged": (
        lambda text: re.sub("(M6[45] P)([01])", lambda m: m[1] + "10"[int(m[2])], text),
        "outputs [1] on, not [0]",
    ),
    "a light that is not given time": (once("M64 P1\nG4 P0.100\n", "M64 P1\n"), "was switched"),
    "a light turned off before the camera has exposed": (
        once("G4 P1.000\nM65 P1\n", "M65 P1\nG4 P1.000\n"),
        "photograph 2 0 s before the next motion",
    ),
    "a light turned off while the release is on": (
        once("M9\nG4 P1.000\nM65 P1\n", "M65 P1\nM9\nG4 P1.000\n"),
        "while the camera's release is on",
    ),
    "a light turned on twice": (once("M64 P1\n", "M64 P1\nM64 P1\n"), "turns output 1 on twice"),
    "the end while a light is on": (at_end("M2\n", "M64 P0\nM2\n"), "ends while a light is on"),
    "no release": (without("M9\n"), "moves while the camera's release is on"),
    "no release at the end": (at_end("M9\n", ""), "moves while the camera's release is on"),
    "a release of no length": (without("G4 P0.200\n"), "with the release on for 0 s"),
    "no time to expose": (without("G4 P1.000\n"), "0 s before the next motion"),
    "no speed": (without(" F900"), "moves without a speed"),
    "no speed but zero": (lambda text: text.replace("F900", "F0"), "moves without a speed"),
    "another speed": (lambda text: text.replace("F900", "F90000"), "a speed of 90000"),
    "no modes": (without("G21.*\n"), "before units and distance mode are set"),
    "a photograph twice": (once("M9\n", "M9\nG4 P0.500\nM8\nG4 P0.200\nM9\n"), "not "),
    "approached from above": (
        lambda text: re.sub(r"(G1 X)(\S+)(\nG4)", r"G1 X40.0000\n\1\2\3", text, count=2),
        "is approached from above",
    ),
    "another axis": (lambda text: text.replace(" X", " A"), "drives axis A"),
    "two axes": (after_a_move("G1 A1.0000"), "drives another axis"),
    "another stop in the comments": (
        once("(stop 2 of", "(stop 3 of"),
        "another comment than its stop",
    ),
    "not back at its start": (at_end("G1 X0.0000", "G1 X1.0000"), "does not end at home_deg"),
    **{f"a foreign line: {line}": (after_a_move(line), "line") for line in FOREIGN},
}


@pytest.mark.parametrize("how", FAULTS)
def test_what_is_wrong_with_a_program_is_said(context: PrototypeContext, how: str) -> None:
    change, words = FAULTS[how]
    text = change(context.prototype.program)
    assert text != context.prototype.program
    machine = "; ".join(run_program(text, *homing(context)).faults)
    detail = said(context, text)
    assert detail
    assert words in detail or words in machine, (detail, machine)

"""Programs run by the machine of the verification; settings and Klipper's texts as tbcad has them.

What is wrong is said, and no line may go, come twice or be another.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest
from tbcad_verify.errors import BadExport
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control import homing_checks, program_checks
from tbcad_verify.prototype.control.gcode_machine import run_program
from tbcad_verify.record.export import read_export
from tbcad_verify.report.checks import Unknown

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.balance import HomeAngles
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.electronics import lights
from tbcad.prototype.files.controllers import (
    klipper_config,
    klipper_program,
    settings,
    settings_lines,
)
from tbcad.prototype.purchased.parts import load_parts

DRIVE, MOTION = load_drives(load_parts())[0], MotionSpec()
START = (
    "M0 (MSG, base at 2 degrees, object straight? Then resume)\n"
    "G21 G90 G94 G54 (a degree for a millimetre, absolute, units a minute)\n"
)


def joined(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def context(synthetic_prototype: Path) -> PrototypeContext:
    export = read_export(synthetic_prototype)
    record = export.prototype
    assert record is not None
    home, top = record.home, float(record.stops.angle.max())
    angles = HomeAngles(home.switch, home.homed, top - home.switch + 3)
    texts = {
        "settings": joined(
            settings_lines("settings of x for grblhal", settings(DRIVE, MOTION, angles))
        ),
        "klipper": joined(klipper_program(record.program.splitlines(), MOTION, angles)),
        "klipper_config": joined(klipper_config(DRIVE, MOTION, lights(1, MOTION))),
    }
    return PrototypeContext(export, record.model_copy(update=texts))


def with_controller(context: PrototypeContext, controller: str = "klipper") -> PrototypeContext:
    """The same design with Klipper, or another controller."""
    spec = context.export.spec
    motion = spec.prototype.motion.model_copy(update={"controller": controller})
    prototype = spec.prototype.model_copy(update={"motion": motion})
    export = replace(context.export, spec=spec.model_copy(update={"prototype": prototype}))
    return replace(context, export=export)


FAULTS: dict[str, Callable[[PrototypeContext], Iterable[str]]] = {
    "program": program_checks.program_faults,
    "settings": lambda context: homing_checks.settings_faults(context, DRIVE.ratio),
    "klipper": program_checks.klipper_faults,
    "klipper_config": lambda context: program_checks.config_faults(context, DRIVE.ratio),
}


def faults(context: PrototypeContext, name: str, text: str) -> str:
    changed = context.prototype.model_copy(update={name: text})
    return "; ".join(FAULTS[name](replace(context, prototype=changed)))


@pytest.mark.parametrize("name", FAULTS)
def test_what_tbcad_writes_has_no_fault(context: PrototypeContext, name: str) -> None:
    assert faults(context, name, getattr(context.prototype, name)) == ""


def test_a_machine_knows_the_true_angle_whatever_the_offset() -> None:
    machine = run_program(START + "G92 X5.0000\nG1 X7.0000 F60\nG4 P2.000\nG1 X1.0000\nM2\n")
    assert machine.faults == []
    assert machine.moves == [4.0, -2.0]
    assert not machine.rising


def test_a_photograph_knows_when_it_is_taken() -> None:
    text = START + "G92 A2.0000\nG1 A3.0000 F60\nG4 P0.500\nM8\nG4 P0.200\nM9\nG4 P1.000\nM2\n"
    (one,) = run_program(text).photographs
    assert (one.angle, one.settled, one.rising, one.turned) == (3.0, 0.5, True, 0)
    assert (one.released, one.waited) == pytest.approx((0.2, 1.0))
    pause = START + "G92 A2.0000\nG1 A3.0000 F60\nM0 (MSG, stop 1: photograph, then resume)\nM2\n"
    (one,) = run_program(pause).photographs
    assert (one.released, one.waited, one.settled) == (math.inf, math.inf, 0)


def test_only_a_controller_that_homes_must_have_a_switch(context: PrototypeContext) -> None:
    assert [*homing_checks._switch(with_controller(context, "grbl"), {})] == []
    for controller in ("klipper", "grblhal"):
        with pytest.raises(Unknown, match="no home_switch"):
            list(homing_checks._switch(with_controller(context, controller), {}))


def test_another_axis_is_the_designs(context: PrototypeContext) -> None:
    spec = context.export.spec
    motion = spec.prototype.motion.model_copy(update={"axis": "A"})
    prototype = spec.prototype.model_copy(update={"motion": motion})
    export = replace(context.export, spec=spec.model_copy(update={"prototype": prototype}))
    text = context.prototype.program.replace(" X", " A")
    assert faults(replace(context, export=export), "program", text) == ""
    assert "drives axis A" in faults(context, "program", text)


def test_the_program_of_the_chosen_controller_is_run(context: PrototypeContext) -> None:
    chosen = with_controller(context)
    assert [*program_checks.program_faults(chosen)] == []
    assert [*homing_checks.settings_faults(chosen, DRIVE.ratio)] == []
    assert faults(chosen, "program", "G1 X5\n") == ""  # is of another controller
    text = chosen.prototype.klipper.replace("PAUSE\n", "", 1)
    changed = chosen.prototype.model_copy(update={"klipper": text})
    assert [*program_checks.program_faults(replace(chosen, prototype=changed))]


@pytest.mark.parametrize("name", ["klipper.cfg", "rotation_plan_klipper.gcode"])
def test_files_of_another_controller_are_refused(prototype_folder: Path, name: str) -> None:
    (prototype_folder / name).write_text("PAUSE\n")
    with pytest.raises(BadExport, match=f"{name} is not for grblhal"):
        read_export(prototype_folder)


@pytest.mark.parametrize("name", ["grbl_settings.txt", "rotation_plan.nc"])
def test_files_of_the_controller_are_needed(prototype_folder: Path, name: str) -> None:
    (prototype_folder / name).unlink()
    with pytest.raises(BadExport, match=name):
        read_export(prototype_folder)


FOREIGN = (
    *("G28", "G2 X1.0000", "Y5000", "G1 Y5000", "G93", "G10 L2 P1 X5", "G55", "M7", "M30", "G20"),
    *("G91", "G53", "G0 X1.0000", "M3 S100", "$H", "/G4 P1.000", "g1 x1.0000", "G1X1.0000", "%"),
    *("G1 X1.0000 (take care!)", "T1", "G1 X1.00001", "G1 X1e3", "(turn the object by 90 degrees)"),
    *("G92 X0.0000", "M2", "G1 A1.0000", "G1 X179.0000", "M64 P1\nM65 P1", "M64 P0"),
    *("SET_STEPPER_ENABLE STEPPER=base ENABLE=0", "M84", "[include more.cfg]"),
)


@pytest.mark.parametrize("name", ["program", "klipper"])
def test_no_foreign_line_is_run(context: PrototypeContext, name: str) -> None:
    """After the first stop's motion."""
    text = getattr(context.prototype, name)
    place = re.search(r"G4 P0?\.?500\n", text)
    assert place
    for line in FOREIGN:
        changed = text[: place.start()] + line + "\n" + text[place.start() :]
        assert faults(context, name, changed), line


PROGRAM_FAULTS = (
    ("G92 X.*", "G92 X50.0000", "deg is beyond the swing"),
    (r"M2\n\Z", "", "the program has no end"),
    (r".\n\Z", "", "the last line is cut"),
    (r"M0 \(MSG, turn.*\n", "", "pauses for pin, not for pin, turn"),
    (
        "(?=G92 X)",
        "M0 (MSG, turn the object by 180 degrees about z, then resume)\n",
        "photograph 1 with the object turned 1 times",
    ),
    (r"M0 \(MSG, zero.*\n", "", "before the zero pin is told"),
    (r"\$H\n", "", "before a person has put the base"),
    (r"\$H\n", "M64 P1\n$H\n", "with a light on"),
    (r"\$H\n", "$H\n$H\n", "homes"),
    ("G4 P0.500", "G4 P0.100", "photograph 1 0.2 s after the motion"),
    (r"(?s)(.*)G4 P0.500", r"\1G4 P0.100", "0.2 s after the motion"),
    (r"M65 P0\n(?=\(stop)", "", "moves while a light is on"),
    (r"M64 P1\n", "", "outputs none on, not [1]"),
    (r"M64 P1\nG4 P0.100\n", "M64 P1\n", "was switched"),
    (r"G4 P1.000\nM65 P1\n", "M65 P1\nG4 P1.000\n", "photograph 2 0 s before the next motion"),
    (r"M9\nG4 P1.000\nM65 P1\n", "M65 P1\nM9\nG4 P1.000\n", "while the camera's release is on"),
    (r"M64 P1\n", "M64 P1\nM64 P1\n", "turns output 1 on twice"),
    (r"M2\n\Z", "M64 P0\nM2\n", "ends while a light is on"),
    (r"(?s)(.*)M9\n", r"\1", "moves while the camera's release is on"),
    (r"M8\n", "", "is not on"),
    (r"G4 P0.200\n", "", "with the release on for 0 s"),
    (r"G4 P1.000\n", "", "0 s before the next motion"),
    (" F900", "", "moves without a speed"),
    ("F900", "F0", "moves without a speed"),
    ("F900", "F90000", "a speed of 90000"),
    (r"G21.*\n", "", "before units and distance mode are set"),
    ("M9\n", "M9\nG4 P0.500\nM8\nG4 P0.200\nM9\n", "photographs, not"),
    (r"(stop 2 .*\n)", r"\1G1 X40.0000\n", "is approached from above"),
    (r"\(stop 2 of", "(stop 3 of", "another comment than its stop"),
    (r"(?s)(.*)G1 X0.0000", r"\1G1 X1.0000", "does not end at home_deg"),
    (r"(stop 2 .*\nG1 X).*", r"\g<1>0.0100", "photograph 4 at"),
)
KLIPPER_FAULTS = (
    (r'RESPOND MSG="zero.*\nPAUSE\n', "", "before the zero pin is told to be out"),
    ("zero pin out", "zero pin in", "is none that a plan has"),
    (r".*ENABLE=1 .*\n", "", "before the motor is on"),
    (r".*STOP_ON_ENDSTOP=1\n", "", "before a person has put the base"),
    (r".*SET_POSITION=-.*\n", "", "moves without a known coordinate"),
    ("SET_POSITION=-\\S+", "SET_POSITION=-50", "deg is beyond the swing"),
    (r"SPEED=15", "SPEED=1500", "a speed of 90000"),
    (r"(SET_POSITION=-.*\n.*SPEED=)\d+", r"\g<1>60", "drives off the switch"),
    (r"(SET_POSITION=-.*\n.*MOVE=)\S+", r"\g<1>150", "drives off the switch"),
    (r"SET_PIN PIN=lamp VALUE=0\n(?=; stop)", "", "moves while a light is on"),
    (r'RESPOND MSG="turn.*\nPAUSE\n', "", "pauses for pin, not for pin, turn"),
    (r"G4 P500\n", "G4 P50\n", "s after the motion"),
    (r"(; stop 1 .*\n.*MOVE=)\S+", r"\g<1>5", "photograph 1 at 5.0000 deg"),
    (r"\Z", "SET_PIN PIN=lamp VALUE=1\n", "ends while a light is on"),
)


@pytest.mark.parametrize(
    ("name", "pattern", "new", "words"),
    [
        *(("program", *row) for row in PROGRAM_FAULTS),
        *(("klipper", *row) for row in KLIPPER_FAULTS),
    ],
)
def test_what_is_wrong_with_a_program_is_said(
    context: PrototypeContext, name: str, pattern: str, new: str, words: str
) -> None:
    text = getattr(context.prototype, name)
    changed = re.sub(pattern, new, text, count=1)
    assert changed != text
    assert words in faults(context, name, changed)


def test_no_setting_may_go_come_twice_or_be_another(context: PrototypeContext) -> None:
    text = context.prototype.settings
    some = re.findall(r"\$\d+=.*\n", text)
    assert len(some) > 20
    for line in some:
        for new in ("", line + line, line.partition("=")[0] + "=9999\n", "G28\n" + line):
            assert faults(context, "settings", text.replace(line, new)), (line, new)
    assert "is not needed" in faults(context, "settings", text + "$4=1\n")
    for order, refused in (("$22=1\n$20=1", 0), ("$20=0\n$21=0\n$22=0", 0), ("$20=1\n$22=1", 1)):
        assert len(homing_checks.parsed_settings(order)[1]) == refused


def test_no_line_of_the_configuration_may_go_come_twice_or_be_another(
    context: PrototypeContext,
) -> None:
    text = str(context.prototype.klipper_config)
    some = [line + "\n" for line in text.splitlines() if not line.startswith("#")]
    for k, line in enumerate(some):
        others = ["", line + line, "[include more.cfg]\n" + line, line.replace(": ", " = ")]
        if re.search(r": \d", line):
            others.append(re.sub(r"\d+", "7", line))
        for new in others:
            changed = "".join([*some[:k], new, *some[k + 1 :]])
            assert faults(context, "klipper_config", changed) or new == line, (line, new)


@pytest.mark.parametrize(
    ("old", "new", "refused"),
    [
        ("step_pin: FILL_IN", "step_pin: mcu:gpio11", False),
        ("pins: FILL_IN", "pins: PA1", False),
        ("step_pin: FILL_IN\ndir_pin: FILL_IN", "step_pin: PA1\ndir_pin: PA1", True),
        ("step_pin: FILL_IN\ndir_pin: FILL_IN", "step_pin: PA1\ndir_pin: PA2", False),
        ("dir_pin: ", "dir_pin: !", True),
        ("endstop_pin: ^", "endstop_pin: ", True),
        ("pins: ", "pins: !", True),
        ("timeout: 86400", "timeout: 60", True),
        ("[printer]", "[gcode_macro PAUSE]\ngcode:\n[printer]", True),
        ('stays on"', 'stays on {% M84 %}"', True),
        ("step_pin: ", "enable_pin: PA1\nstep_pin: ", True),
        ("[respond]", "#*# [idle_timeout]\n[respond]", True),
    ],
)
def test_pins_are_the_users_and_nothing_else(
    context: PrototypeContext, old: str, new: str, refused: bool
) -> None:
    text = str(context.prototype.klipper_config)
    assert text.count(old) == 1
    assert bool(faults(context, "klipper_config", text.replace(old, new))) == refused

"""Settings and Klipper's texts as tbcad writes them: no line may go, come twice or be another."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control import homing_checks, klipper_checks
from tbcad_verify.record.export import read_export

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.drive.travel import HomeAngles
from tbcad.prototype.electronics import lights
from tbcad.prototype.files.controllers import (
    klipper_config,
    klipper_program,
    settings,
    settings_lines,
)
from tbcad.prototype.purchased.parts import load_parts

DRIVE, MOTION = load_drives(load_parts())[0], MotionSpec()
Faults = Callable[[PrototypeContext], Iterable[str]]


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
        "settings": joined(settings_lines("a title", settings(DRIVE, MOTION, angles))),
        "klipper": joined(klipper_program(record.program.splitlines(), MOTION, angles)),
        "klipper_config": joined(klipper_config(DRIVE, MOTION, lights(1, MOTION))),
    }
    return PrototypeContext(export, record.model_copy(update=texts))


FAULTS: dict[str, Faults] = {
    "settings": lambda context: homing_checks._settings(context, DRIVE.ratio),
    "klipper": klipper_checks._program,
    "klipper_config": lambda context: klipper_checks._config(context, DRIVE.ratio),
}


def faults(context: PrototypeContext, name: str, text: str) -> str:
    changed = context.prototype.model_copy(update={name: text})
    return "; ".join(FAULTS[name](replace(context, prototype=changed)))


@pytest.mark.parametrize("name", FAULTS)
def test_what_tbcad_writes_has_no_fault(context: PrototypeContext, name: str) -> None:
    assert faults(context, name, getattr(context.prototype, name)) == ""


def test_no_setting_may_go_come_twice_or_be_another(context: PrototypeContext) -> None:
    text = context.prototype.settings
    some = re.findall(r"\$\d+=.*\n", text)
    assert len(some) > 20
    for line in some:
        for new in ("", line + line, line.partition("=")[0] + "=9999\n", "G28\n" + line):
            assert faults(context, "settings", text.replace(line, new)), (line, new)
    assert "is not needed" in faults(context, "settings", text + "$4=1\n")


@pytest.mark.parametrize(
    ("order", "refused"),
    [("$22=1\n$20=1", False), ("$20=0\n$21=0\n$22=0", False), ("$20=1\n$22=1", True)],
)
def test_soft_limits_need_homing_before_them(order: str, refused: bool) -> None:
    assert bool(homing_checks._parsed(order)[1]) == refused


def test_no_line_of_the_configuration_may_go_come_twice_or_be_another(
    context: PrototypeContext,
) -> None:
    text = str(context.prototype.klipper_config)
    some = [line + "\n" for line in text.splitlines() if not line.startswith("#")]
    for k, line in enumerate(some):
        others = ["", line + line, "[include more.cfg]\n" + line, line.replace(": ", " = ")]
        if re.search(r": \d", line) and "timeout" not in line:
            others.append(re.sub(r"\d+", "7", line))
        for new in others:
            changed = "".join([*some[:k], new, *some[k + 1 :]])
            assert faults(context, "klipper_config", changed) or new == line, (line, new)


@pytest.mark.parametrize(
    ("old", "new", "refused"),
    [
        ("step_pin: FILL_IN", "step_pin: mcu:gpio11", False),
        ("pins: FILL_IN", "pins: !PA1", False),
        ("[respond]", "# a note\n\n[respond]", False),
        ("dir_pin: ", "dir_pin: !", True),
        ("endstop_pin: ^", "endstop_pin: ", True),
        ("endstop_pin: ^", "endstop_pin: ^!", True),
        ("    RESPOND", "    M84\n    RESPOND", True),
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


@pytest.mark.parametrize(
    ("pattern", "new", "words"),
    [
        (r'RESPOND MSG="zero.*\nPAUSE\n', "", "before the zero pin is told to be out"),
        ("zero pin out", "zero pin in", "is none that a plan has"),
        (r".*ENABLE=1 .*\n", "", "and the motor on"),
        (r".*STOP_ON_ENDSTOP=1\n", "", "without a search"),
        (r".*SET_POSITION=-.*\n", "", "moves before homing"),
        ("SET_POSITION=-\\S+", "SET_POSITION=-50", "deg at the switch"),
        (r"(mirrors\n.*MOVE=).*?( SPEED)", r"\g<1>5\2", "photograph 1 is another"),
        (r"SPEED=15", "SPEED=1500", "a speed of 1500"),
        (r"SET_PIN PIN=lamp VALUE=0\n(?=; stop)", "", "with lamp on"),
        (r"SET_PIN PIN=led_1 VALUE=1\n", "", "is another"),
        (r'RESPOND MSG="turn.*\nPAUSE\n', "", "is another"),
        (r"G4 P500\n", "G4 P50\n", "waits for other times"),
        (r"SET_PIN PIN=release VALUE=1\n", "", "photographs, not"),
        (r"(?=; stop 2 )", "M84\n", "is none that a plan has"),
        (r"(?=; stop 2 )", "SET_STEPPER_ENABLE STEPPER=base ENABLE=0\n", "is none that a plan"),
        (r"\Z", "SET_PIN PIN=lamp VALUE=1\n", "ends with lamp on"),
    ],
)
def test_what_is_wrong_with_a_klipper_program_is_said(
    context: PrototypeContext, pattern: str, new: str, words: str
) -> None:
    text = str(context.prototype.klipper)
    changed = re.sub(pattern, new, text, count=1)
    assert changed != text
    assert words in faults(context, "klipper", changed)

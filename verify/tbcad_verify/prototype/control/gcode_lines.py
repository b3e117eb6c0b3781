"""The text of a controller's program, by a strict grammar: the lines that tbcad writes, no others.

A controller obeys whatever it is sent, so a word that has no use here is refused, not ignored.
People obey the comments of a program; these have a grammar too.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

MAX_LINE_LENGTH = 79
AXIS = r"[XA]-?\d{1,3}\.\d{4}"
COMMANDS = (
    rf"G1 {AXIS}(?: F\d+(?:\.\d+)?(?:e\+\d\d)?)?",
    r"G4 P\d+\.\d{3}",
    r"G21 G90 G94 G54",
    rf"G92 {AXIS}",
    r"G92\.1",
    r"M[0289]",
    r"M6[45] P\d",
    r"\$H",
)
NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]\d\d)?"
LED = r"led_\d+"
COMMENTS = (
    r"rotation plan: \d+ stops, twice, about \d+ min",
    rf"[\w-]+, [\w-]+, {NUMBER} turns of the motor a turn",
    r"settings for the controller, to be sent before:",
    r"\$1=255: motor always on, for the base falls without it",
    rf"\$1[012][03]={NUMBER}: (?:steps a degree|degrees a minute, at most|degrees/s\^2)",
    r"the camera's release is a relay on the coolant output",
    r"a degree for a millimetre, absolute, units a minute",
    rf"digital output \d: (?:lamp|{LED})",
    rf"MSG, base at (?P<base>{NUMBER}) degrees, object straight\? Then resume",
    r"MSG, zero pin (?P<pin>out), object straight\? Then resume",
    r"MSG, turn the object by (?P<turn>180) degrees about z, then resume",
    rf"MSG, stop (?P<photograph>\d+): (?:(?P<phase>dark|{LED}|lit), )?photograph, then resume",
    r"stop (?P<stop>\d+) of \d+: \d+ mirrors",
)
LINE = re.compile(rf"(?P<command>{'|'.join(COMMANDS)})?(?: ?\((?P<comment>[^()]+)\))?")
WORD = re.compile(r"([A-Z$])(\S+)")
FORMS = tuple(re.compile(form) for form in COMMENTS)
LAMP = -1.0  # number that stands for the lamp where LEDs are numbered from 1
WORDS = {"dark": 0.0, "lit": LAMP, "out": 1.0}


@dataclass(frozen=True)
class Line:
    """One line of a program."""

    number: int  # from 1
    code: str = ""  # first word of the command, such as "G1"; empty for a comment alone
    values: dict[str, float] = field(default_factory=dict)  # of the other words, by their letter
    says: dict[str, float] = field(default_factory=dict)  # what the comment tells, by name


def parse_program(text: str) -> tuple[list[Line], list[str]]:
    """The lines of a program, and what is wrong with others."""
    lines: list[Line] = []
    faults: list[str] = []
    for number, line in enumerate(text.split("\n")[:-1], 1):
        found = LINE.fullmatch(line)
        if not found or not line or len(line) > MAX_LINE_LENGTH:
            faults.append(f"line {number} is none that a plan has: {line[:MAX_LINE_LENGTH]!r}")
            continue
        says = _said(found["comment"]) if found["comment"] else {}
        if says is None:
            faults.append(f"line {number} has a comment that no plan has")
            continue
        words = WORD.findall(found["command"] or "")
        code = "".join(words[0]) if words else ""
        # The other G words of the one line that sets modes are fixed by the grammar.
        values = {letter: float(value) for letter, value in words[1:] if letter != "G"}
        lines.append(Line(number, code, values, says))
    if not text.endswith("\n"):
        faults.append("the last line is cut")
    return lines, faults


def _said(comment: str) -> dict[str, float] | None:
    """The numbers in a comment by name; None if it is none of the known ones."""
    for form in FORMS:
        if found := form.fullmatch(comment):
            told = found.groupdict().items()
            return {name: _number(value) for name, value in told if value is not None}
    return None


def _number(value: str) -> float:
    """A number, or that of a light: 0 for none."""
    return WORDS[value] if value in WORDS else float(value.removeprefix("led_"))

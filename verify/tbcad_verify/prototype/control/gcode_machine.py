"""A controller with one axis that runs a program as GRBL 1.1 does, and what comes of it.

The text is read by a strict grammar: the lines that tbcad writes, no others. A controller obeys
whatever it is sent, so a word that has no use here is refused, not ignored; people obey the
comments of a program, and these have a grammar too.

Every mode is part of the machine's state and unset at first; no motion is done before all are set.
The machine knows the true angle of the base, whatever offset the program gives to its coordinates.

Sources: grbl/gcode.c of GRBL 1.1h: modal groups, G92 as an offset, M8 and G4 after the motion.
grblHAL core gcode.c: M64 and M65 are done when they are read, before the motion has ended.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tbcad_verify.types import Floats

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
WORDS = {"dark": 0.0, "lit": LAMP, "out": 1.0, "lamp": 0.0}


class Line(NamedTuple):
    """One line of a program."""

    number: int  # from 1
    code: str  # first word of the command, such as "G1"; empty for a comment alone
    values: dict[str, float]  # of the other words, by their letter
    says: dict[str, float]  # what the comment tells, by name


def parse_program(text: str) -> tuple[list[Line], list[str]]:
    """The lines of a program, and what is wrong with others."""
    lines: list[Line] = []
    faults: list[str] = []
    for number, line in enumerate(text.split("\n")[:-1], 1):
        try:
            lines.append(Line(number, *_parsed(line)))
        except ValueError as error:
            faults.append(f"line {number} {error}")
    if not text.endswith("\n"):
        faults.append("the last line is cut")
    return lines, faults


@lru_cache
def _parsed(line: str) -> tuple[str, dict[str, float], dict[str, float]]:
    """Code, values and comment of a line. ValueError: no plan has it. Most lines come often."""
    found = LINE.fullmatch(line)
    if not found or not line or len(line) > MAX_LINE_LENGTH:
        raise ValueError(f"is none that a plan has: {line[:MAX_LINE_LENGTH]!r}")
    says = _said(found["comment"]) if found["comment"] else {}
    if says is None:
        raise ValueError("has a comment that no plan has")
    words = WORD.findall(found["command"] or "")
    code = "".join(words[0]) if words else ""
    # The other G words of the one line that sets modes are fixed by the grammar.
    return code, {letter: float(value) for letter, value in words[1:] if letter != "G"}, says


def _said(comment: str) -> dict[str, float] | None:
    """The numbers in a comment by name; None if it is none of the known ones."""
    return next((numbers(found) for form in FORMS if (found := form.fullmatch(comment))), None)


def numbers(found: re.Match[str]) -> dict[str, float]:
    """The numbers of a match by name: 0 for no light, or the lamp's output."""
    return {
        name: WORDS[value] if value in WORDS else float(value.removeprefix("led_"))
        for name, value in found.groupdict().items()
        if value is not None
    }


@dataclass
class Photograph:
    """A photograph, and the state of the machine when it is taken."""

    angle: float  # of the base, degrees
    settled: float  # time at rest before it, s
    released: float  # time for which the release is on, s; infinite where a person takes it
    waited: float  # time at rest after it, s; infinite where a person takes it
    rising: bool  # whether the base came there from below
    turned: int  # how often the object was turned before it
    stop: int  # number of its stop in the comments, from 1; 0 without
    lights: frozenset[int]  # digital outputs that are on
    lit: float  # time since one of them was switched, s
    phase: float = math.nan  # light that the pause tells: 0 none, -1 the lamp, else the LED's


@dataclass
class Machine:
    """The controller's state, and the record of what it did."""

    switch: float = math.nan  # base angle at which homing finds the switch, and
    homed: float = math.nan  # at which it ends, degrees; NaN: there is no switch
    modes_set: bool = False  # millimetres, absolute, units a minute, first coordinate system
    axis: str = ""  # letter of the axis; empty before it is used
    angle: float = math.nan  # of the base, degrees; NaN before a person has put it to a known one
    offset: float = math.nan  # of that from the program's coordinate, degrees; NaN: not set
    feed: float = 0.0  # degrees a minute; 0 before it is set
    now: float = 0.0  # time that the base has rested, s; motions take none
    moved: float = 0.0  # time of the last motion, and
    switched: float = -math.inf  # of the last switching of an output, s
    release: float = math.nan  # time at which the camera's release was turned on, s; NaN: off
    closed: float = 0.0  # time at which it was last turned off, s
    ended_motion: bool = True  # whether the controller has waited for the end of the last motion
    lights: set[int] = field(default_factory=set)  # digital outputs that are on
    rising: bool = False  # whether the last motion, if any, was upward
    ended: bool = False  # the program has ended
    stop: int = 0  # number of the last stop in the comments
    moves: list[float] = field(default_factory=list)  # base angles driven to, degrees
    homes: int = 0  # how often the base was homed; each adds the switch and its end to `moves`
    photographs: list[Photograph] = field(default_factory=list)  # in order
    pauses: list[str] = field(default_factory=list)  # "base", "pin" or "turn", by a person
    bases: list[float] = field(default_factory=list)  # to which a person puts the base, degrees
    feeds: list[float] = field(default_factory=list)  # every speed that is set
    faults: list[str] = field(default_factory=list)  # what no program may do, a few words each

    @property
    def angles(self) -> Floats:
        """(P,) base angles at which photographs are taken, degrees."""
        return np.array([one.angle for one in self.photographs], dtype=np.float64)

    @property
    def driven(self) -> list[float]:
        """Base angles that the program itself drives to, without homing."""
        return self.moves[2 * self.homes :]

    @property
    def _on(self) -> bool:
        return not math.isnan(self.release)

    def run(self, line: Line) -> str:
        """Do what a line says; what is wrong with it, or empty."""
        self.stop = int(line.says.get("stop", self.stop))
        if not line.code:
            return ""
        if self.ended:
            return "stands after the end"
        for letter in set(line.values) & {"X", "A"}:
            if self.axis not in ("", letter):
                return "drives another axis"
            self.axis = letter
        values = line.values
        command: dict[str, Callable[[], str | None]] = {
            "$H": self._home,
            "G21": lambda: self._set(modes_set=True),
            "G92": lambda: self._set_offset(values[self.axis]),
            "G92.1": lambda: self._set(offset=math.nan),
            "G1": lambda: self._move(values),
            "G4": lambda: self._set(ended_motion=True, now=self.now + values["P"]),
            "M8": self._release_on,
            "M9": self._release_off,
            "M0": lambda: self._pause(line.says),
            "M64": lambda: self._switch(int(values["P"]), True),
            "M65": lambda: self._switch(int(values["P"]), False),
            "M2": self._end,
        }
        return command[line.code]() or ""

    def _set(self, **state: float) -> None:
        vars(self).update(state)

    def _home(self) -> str:
        """Down to the switch and up again; nothing may be in the way of the pin's hole."""
        if math.isnan(self.homed):
            return "homes without a switch"
        if "pin" not in self.pauses:
            return "homes before the zero pin is told to be out"
        if self.moves or self.lights:
            return "homes after a motion, or with a light on"
        self.moves += [self.switch, self.homed]
        self.angle, self.rising = self.homed, True
        self.homes += 1
        return ""

    def _set_offset(self, coordinate: float) -> str:
        if math.isnan(self.angle):
            return "sets a coordinate before a person has put the base to a known angle"
        if self.driven:
            return "sets a coordinate after a motion"
        self.offset = self.angle - coordinate
        return ""

    def _switch(self, output: int, on: bool) -> str:
        if on and output in self.lights:
            return f"turns output {output} on twice"
        (self.lights.add if on else self.lights.discard)(output)
        self._end_photograph()
        self.switched = self.now
        if self._on:
            return "switches a light while the camera's release is on"
        return "" if self.ended_motion else "switches a light before the motion has ended"

    def _end(self) -> str:
        self.ended = True
        self._end_photograph()
        if self.lights:
            return "ends while a light is on"
        return "ends while the camera's release is on" if self._on else ""

    def _move(self, values: dict[str, float]) -> str:
        self.feed = values.get("F", self.feed)
        if "F" in values:
            self.feeds.append(self.feed)
        refused = {
            "before units and distance mode are set": not self.modes_set,
            "without a known coordinate": math.isnan(self.offset),
            "without a speed": not self.feed > 0,
            "while the camera's release is on": self._on,
            "while a light is on": bool(self.lights),
        }
        if any(refused.values()):
            return f"moves {next(why for why, true in refused.items() if true)}"
        target = values[self.axis] + self.offset
        if target != self.angle:
            self._end_photograph()
            self.rising, self.moved, self.ended_motion = target > self.angle, self.now, False
        self.angle = target
        self.moves.append(target)
        return ""

    def _release_on(self) -> str:
        if self._on:
            return "turns the camera's release on twice"
        self.ended_motion = True
        self._photograph(math.nan, math.nan)
        self.release = self.now
        return ""

    def _release_off(self) -> str:
        if not self._on:
            return "turns the camera's release off, which is not on"
        self.photographs[-1].released = self.now - self.release
        self.release, self.closed = math.nan, self.now
        return ""

    def _photograph(self, released: float, waited: float, phase: float = math.nan) -> None:
        self._end_photograph()
        turned, lights = self.pauses.count("turn"), frozenset(self.lights)
        settled, lit = self.now - self.moved, self.now - self.switched
        state = self.rising, turned, self.stop, lights, lit
        self.photographs.append(Photograph(self.angle, settled, released, waited, *state, phase))

    def _end_photograph(self) -> None:
        """The base moves, a light is switched, or another photograph begins."""
        if self.photographs and math.isnan(self.photographs[-1].waited):
            self.photographs[-1].waited = self.now - self.closed

    def _pause(self, says: dict[str, float]) -> str:
        if self._on:
            return "pauses while the camera's release is on"
        self.ended_motion = True
        if "photograph" in says:
            self._photograph(math.inf, math.inf, says.get("phase", math.nan))
            return ""
        asked = {"base", "pin", "turn"} & says.keys()
        if not asked:
            return "pauses, and does not say for what"
        self.pauses += asked
        if "base" in asked:
            self.angle = says["base"]
            self.bases.append(self.angle)
        return ""


@lru_cache(maxsize=1)
def run_program(text: str, switch: float = math.nan, homed: float = math.nan) -> Machine:
    """Run a program; homing finds the switch at one base angle and ends at another, degrees.

    Several checks ask for the same run.
    """
    return run_lines(*parse_program(text), switch, homed)


def run_lines(lines: list[Line], faults: list[str], switch: float, homed: float) -> Machine:
    """Run lines that were read; faults are those of others."""
    machine = Machine(faults=faults, switch=switch, homed=homed)
    for line in lines:
        if wrong := machine.run(line):
            machine.faults.append(f"line {line.number} {wrong}")
    if not machine.ended:
        machine.faults.append("the program has no end")
    return machine

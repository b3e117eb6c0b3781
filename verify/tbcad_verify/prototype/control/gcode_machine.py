"""A controller with one axis that runs a program as GRBL 1.1 does, and what comes of it.

Every mode is part of the machine's state and unset at first; no motion is done before all are set.
The machine knows the true angle of the base, whatever offset the program gives to its coordinates.

Sources: grbl/gcode.c of GRBL 1.1h: modal groups, G92 as an offset, M8 and G4 after the motion.
grblHAL core gcode.c: M64 and M65 are done when they are read, before the motion has ended.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from tbcad_verify.prototype.control.gcode_lines import Line, parse_program
from tbcad_verify.types import Floats


@dataclass
class Photograph:
    """A photograph, and the state of the machine when it is taken."""

    angle: float  # of the base, degrees
    settled: float  # time at rest before it, s
    # time for which the camera's release is on, s; infinite where a person takes it
    released: float
    waited: float  # time at rest after it, s; infinite where a person takes it
    rising: bool  # whether the base came there from below
    turned: int  # how often the object was turned before it
    stop: int  # number of its stop in the comments, from 1; 0 without
    lights: frozenset[int]  # digital outputs that are on
    lit: float  # time since one of them was switched, s
    # light that the pause tells: 0 none, -1 the lamp, else the LED's number; NaN without
    phase: float = math.nan


@dataclass
class Machine:
    """The controller's state, and the record of what it did."""

    switch: float = math.nan  # base angle at which homing finds the switch, and
    homed: float = math.nan  # at which it ends, degrees; NaN: there is no switch
    modes_set: bool = False  # millimetres, absolute, units a minute, first coordinate system
    axis: str = ""  # letter of the axis; empty before it is used
    angle: float = math.nan  # of the base, degrees; NaN before a person has put it to a known one
    # of the base's angle from the program's coordinate, degrees; NaN before it is set
    offset: float = math.nan
    feed: float = 0.0  # degrees a minute; 0 before it is set
    now: float = 0.0  # time that the base has rested, s; motions take none
    moved: float = 0.0  # time of the last motion, and
    switched: float = -math.inf  # of the last switching of an output, s
    # time at which the camera's release was last turned on, s; NaN while it is off
    release: float = math.nan
    closed: float = 0.0  # time at which it was last turned off, s
    ended_motion: bool = True  # whether the controller has waited for the end of the last motion
    lights: set[int] = field(default_factory=set)  # digital outputs that are on
    rising: bool = False  # whether the last motion, if any, was upward
    ended: bool = False  # the program has ended
    stop: int = 0  # number of the last stop in the comments
    moves: list[float] = field(default_factory=list)  # base angles driven to, degrees
    # how often the base was homed; each adds the switch's angle and its end to `moves`
    homes: int = 0
    photographs: list[Photograph] = field(default_factory=list)  # in order
    # what a person does at each but photographs: "base", "pin" or "turn"
    pauses: list[str] = field(default_factory=list)
    # angle to which a person puts the base, degrees
    bases: list[float] = field(default_factory=list)
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
        return self._command(line)

    def _command(self, line: Line) -> str:
        values = line.values
        return {
            "$H": self._home,
            "G21": self._set_modes,
            "G92": lambda: self._set_offset(values[self.axis]),
            "G92.1": self._drop_offset,
            "G1": lambda: self._move(values),
            "G4": lambda: self._wait(values["P"]),
            "M8": self._release_on,
            "M9": self._release_off,
            "M0": lambda: self._pause(line.says),
            "M64": lambda: self._switch_on(int(values["P"])),
            "M65": lambda: self._switch_off(int(values["P"])),
            "M2": self._end,
        }[line.code]()

    def _set_modes(self) -> str:
        self.modes_set = True
        return ""

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

    def _drop_offset(self) -> str:
        self.offset = math.nan
        return ""

    def _set_offset(self, coordinate: float) -> str:
        if math.isnan(self.angle):
            return "sets a coordinate before a person has put the base to a known angle"
        if self.driven:
            return "sets a coordinate after a motion"
        self.offset = self.angle - coordinate
        return ""

    def _wait(self, seconds: float) -> str:
        self.ended_motion = True
        self.now += seconds
        return ""

    def _switch_on(self, output: int) -> str:
        if output in self.lights:
            return f"turns output {output} on twice"
        self.lights.add(output)
        return self._switch()

    def _switch_off(self, output: int) -> str:
        self.lights.discard(output)
        return self._switch()

    def _switch(self) -> str:
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
        for what in {"base", "pin", "turn"} & says.keys():
            self.pauses.append(what)
            if what == "base":
                self.bases.append(says[what])
                self.angle = says[what]
            return ""
        return "pauses, and does not say for what"


def run_program(text: str, switch: float = math.nan, homed: float = math.nan) -> Machine:
    """Run a program from its first line to its last.

    Args:
        text: of the program.
        switch: base angle at which homing finds the switch, degrees.
        homed: base angle at which homing ends, degrees.
    """
    lines, faults = parse_program(text)
    machine = Machine(faults=faults, switch=switch, homed=homed)
    for line in lines:
        if wrong := machine.run(line):
            machine.faults.append(f"line {line.number} {wrong}")
    if not machine.ended:
        machine.faults.append("the program has no end")
    return machine

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

from tbcad_verify.prototype.gcode_lines import Line, parse_program
from tbcad_verify.types import Floats

SECONDS = 60.0  # of a minute, in which speeds are given


@dataclass
class Photograph:
    """A photograph, and the state of the machine when it is taken.

    Attributes:
        angle: of the base, degrees.
        settled: time at rest before it, s.
        released: time for which the camera's release is on, s; infinite where a person takes it.
        waited: time at rest after it, s; infinite where a person takes it.
        rising: whether the base came there from below.
        turned: how often the object was turned before it.
        stop: number of its stop in the comments, from 1; 0 without.
        mirrors: that the comment of the stop tells.
        lights: digital outputs that are on.
        lit: time since one of them was switched, s.
        phase: light that the pause tells: 0 none, -1 the lamp, else the LED's number; NaN without.
    """

    angle: float
    settled: float
    released: float
    waited: float
    rising: bool
    turned: int
    stop: int
    mirrors: int
    lights: frozenset[int]
    lit: float
    phase: float = math.nan


@dataclass
class Machine:
    """The controller's state, and the record of what it did.

    Attributes:
        switch: base angle at which homing finds the switch, and
        homed: at which it ends, degrees; NaN: there is no switch.
        modes_set: millimetres, absolute, units a minute, first coordinate system.
        axis: letter of the axis; empty before it is used.
        angle: of the base, degrees; NaN before a person has put it to a known one.
        offset: of the base's angle from the program's coordinate, degrees; NaN before it is set.
        feed: degrees a minute; 0 before it is set.
        rest: time since the last motion, or since the release was turned off, s.
        still: time since the last motion, s.
        ended_motion: whether the controller has waited for the end of the last motion.
        lights: digital outputs that are on.
        switched: time since one of them was switched, s.
        rising: whether the last motion, if any, was upward.
        release: value of `rest` when the camera's release was turned on; NaN while it is off.
        ended: the program has ended.
        moves: base angles driven to, degrees.
        photographs: in order.
        homes: how often the base was homed; each adds the switch's angle and its end to `moves`.
        pauses: what a person does at each but photographs: "base", "pin" or "turn".
        bases: angle to which a person puts the base, degrees.
        feeds: every speed that is set.
        told: what comments tell, by name, each with all of its values.
        seconds: duration without pauses.
        faults: what no program may do, a few words each.
    """

    switch: float = math.nan
    homed: float = math.nan
    modes_set: bool = False
    axis: str = ""
    angle: float = math.nan
    offset: float = math.nan
    feed: float = 0.0
    rest: float = 0.0
    still: float = 0.0
    ended_motion: bool = True
    lights: set[int] = field(default_factory=set)
    switched: float = math.inf
    rising: bool = False
    release: float = math.nan
    ended: bool = False
    moves: list[float] = field(default_factory=list)
    homes: int = 0
    photographs: list[Photograph] = field(default_factory=list)
    pauses: list[str] = field(default_factory=list)
    bases: list[float] = field(default_factory=list)
    feeds: list[float] = field(default_factory=list)
    told: dict[str, list[float]] = field(default_factory=dict)
    seconds: float = 0.0
    faults: list[str] = field(default_factory=list)

    @property
    def angles(self) -> Floats:
        """(P,) base angles at which photographs are taken, degrees."""
        return np.array([one.angle for one in self.photographs], dtype=np.float64)

    @property
    def driven(self) -> list[float]:
        """Base angles that the program itself drives to, without homing."""
        return self.moves[2 * self.homes :]

    def last_told(self, name: str) -> int:
        """The last number that a comment told by this name; 0 without."""
        return int(self.told.get(name, [0])[-1])

    def run(self, line: Line) -> str:
        """Do what a line says; what is wrong with it, or empty."""
        for name, value in line.says.items():
            self.told.setdefault(name, []).append(value)
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

    def _wait(self, seconds: float) -> str:
        self.ended_motion = True
        self.rest += seconds
        self.still += seconds
        self.switched += seconds
        self.seconds += seconds
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
        self.switched = 0.0
        if self._is_on():
            return "switches a light while the camera's release is on"
        return "" if self.ended_motion else "switches a light before the motion has ended"

    def _end(self) -> str:
        self.ended = True
        if self.lights:
            return "ends while a light is on"
        return "ends while the camera's release is on" if self._is_on() else ""

    def _is_on(self) -> bool:
        return not math.isnan(self.release)

    def _set_offset(self, coordinate: float) -> str:
        if math.isnan(self.angle):
            return "sets a coordinate before a person has put the base to a known angle"
        if len(self.moves) > 2 * self.homes:
            return "sets a coordinate after a motion"
        self.offset = self.angle - coordinate
        return ""

    def _move(self, values: dict[str, float]) -> str:
        self.feed = values.get("F", self.feed)
        if "F" in values:
            self.feeds.append(self.feed)
        if not self.modes_set:
            return "moves before units and distance mode are set"
        if math.isnan(self.offset):
            return "moves without a known coordinate"
        if not self.feed > 0:
            return "moves without a speed"
        if self._is_on():
            return "moves while the camera's release is on"
        if self.lights:
            return "moves while a light is on"
        target = values[self.axis] + self.offset
        if target != self.angle:
            self.rising = target > self.angle
            self._end_rest()
            self.ended_motion = False
        duration = abs(target - self.angle) / self.feed * SECONDS
        self.seconds += duration
        self.switched += duration
        self.angle = target
        self.moves.append(target)
        return ""

    def _end_rest(self) -> None:
        """The base begins to move: nothing rests any longer."""
        self._end_photograph()
        self.rest = self.still = 0.0

    def _end_photograph(self) -> None:
        if self.photographs and math.isnan(self.photographs[-1].waited):
            self.photographs[-1].waited = self.rest

    def _release_on(self) -> str:
        if self._is_on():
            return "turns the camera's release on twice"
        self.ended_motion = True
        self._photograph(math.nan, math.nan)
        self.release = self.rest
        return ""

    def _release_off(self) -> str:
        if not self._is_on():
            return "turns the camera's release off, which is not on"
        self.photographs[-1].released = self.rest - self.release
        self.release, self.rest = math.nan, 0.0
        return ""

    def _photograph(self, released: float, waited: float, phase: float = math.nan) -> None:
        self._end_photograph()
        self.photographs.append(
            Photograph(
                self.angle,
                self.still,
                released,
                waited,
                self.rising,
                self.pauses.count("turn"),
                self.last_told("stop"),
                self.last_told("mirrors"),
                frozenset(self.lights),
                self.switched,
                phase,
            )
        )

    def _pause(self, says: dict[str, float]) -> str:
        if self._is_on():
            return "pauses while the camera's release is on"
        self.ended_motion = True
        if "photograph" in says:
            self._photograph(math.inf, math.inf, says.get("phase", math.nan))
            return ""
        if "base" in says:
            self.pauses.append("base")
            self.bases.append(says["base"])
            self.angle = says["base"]
            return ""
        if "pin" in says:
            self.pauses.append("pin")
            return ""
        if "turn" in says:
            self.pauses.append("turn")
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
    machine._end_rest()
    return machine

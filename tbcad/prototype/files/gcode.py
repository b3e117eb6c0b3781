"""rotation_plan.nc: the plan as G-code for a GRBL-style controller with one rotary axis.

GRBL 1.1 knows the axes X, Y and Z only and refuses the word A, so its X takes degrees for
millimetres; controllers with more axes take A. It drops comments in round brackets, shows none of
them itself, and reads lines of at most 79 characters. M8, M9 and G4 wait for the motion to end.
Homing is not part of the program: $H needs switches on axes that are not there, unless GRBL is
built for it. So the program is told where it starts: at a mark, or wherever homing ended.
Sources: grbl/gcode.c, grbl/protocol.h and doc/markdown/settings.md of GRBL 1.1h.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import MotionSpec
from tbcad.types import Floats

MAX_LINE_LENGTH = 79
DECIMALS = 4  # of a degree: far below a microstep, and 7 digits are what GRBL's floats hold
SETTING = {"X": 0, "A": 3}  # of the axis: $100 or $103, and so on


@dataclass(frozen=True)
class StopSequence:
    """What the base does, twice: once for each turn of the object.

    Attributes:
        start: base angle below all stops, degrees.
        angle: of the stops, degrees, ascending, (s,).
        mirrors: shown at each stop, (s,).
    """

    start: float
    angle: Floats
    mirrors: NDArray[np.int64]


def stop_sequence(made: PrototypeLayout, motion: MotionSpec) -> StopSequence:
    """The stops, and where to begin so that play in the drive is taken up before the first.

    Raises:
        SpecError: when the program would have to start where post or camera stand in the way.
    """
    low, high = free_base_angles(made)
    home = math.radians(motion.home_deg)
    if not low <= home <= high:
        raise SpecError(
            f"prototype.motion.home_deg is {motion.home_deg:g}, but the base is free from "
            f"{math.degrees(low):.1f} to {math.degrees(high):.1f} degrees: choose one of these"
        )
    angle = np.degrees(made.stops.angle)
    start = max(float(angle[0]) - motion.approach_deg, min(math.degrees(low), float(angle[0])))
    return StopSequence(start, angle, np.bincount(made.stops.stop, minlength=len(angle)))


def free_base_angles(made: PrototypeLayout) -> tuple[float, float]:
    """Base angles between which post, camera and the largest swing leave the balls, radians."""
    problem, azimuth = made.problem, made.placement.azimuth
    low = max(float((problem.min_azimuth - azimuth).max()), -problem.max_swing / 2)
    return low, min(float((problem.max_azimuth - azimuth).min()), problem.max_swing / 2)


def gcode_program(made: PrototypeLayout, drive: Drive, motion: MotionSpec) -> list[str]:
    """Lines of the program, each shorter than 80 characters.

    Raises:
        SpecError: when it would have to start where post or camera stand in the way.
    """
    todo = stop_sequence(made, motion)
    lines = [
        *_header(todo, drive, motion),
        f"M0 (MSG, base at {motion.home_deg:g} degrees, object straight? Then resume)",
        "G21 G90 G94 G54 (a degree for a millimetre, absolute, units a minute)",
        f"G92 {_place(motion.home_deg, motion)}",
        *_photographs(todo, motion),
        f"G1 {_place(todo.start, motion)}",
        "M0 (MSG, turn the object by 180 degrees about z, then resume)",
        *_photographs(todo, motion),
        f"G1 {_place(motion.home_deg, motion)}",
        "G92.1",
        "M2",
    ]
    assert max(len(line) for line in lines) <= MAX_LINE_LENGTH
    return lines


def write_program(path: Path, lines: list[str]) -> None:
    """Write rotation_plan.nc."""
    path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")


def duration_minutes(todo: StopSequence, motion: MotionSpec) -> float:
    """How long the program takes, without the pauses and without what people do."""
    way = 2 * (float(todo.angle[-1]) - todo.start) * 2
    rest = motion.settle_s
    if motion.trigger == "coolant":
        rest += motion.trigger_s + motion.exposure_s
    return way / motion.feed_deg_min + 2 * len(todo.angle) * rest / 60


def _header(todo: StopSequence, drive: Drive, motion: MotionSpec) -> Iterator[str]:
    number = SETTING[motion.axis]
    minutes = duration_minutes(todo, motion)
    yield f"(rotation plan: {len(todo.angle)} stops, twice, about {minutes:.0f} min)"
    yield f"({drive.name}, {drive.motor.name}, {drive.ratio:g} turns of the motor a turn)"
    yield "(settings for the controller, to be sent before:)"
    yield "($1=255: motor always on, for the base falls without it)"
    yield f"($10{number}={drive.steps_per_deg(motion.microsteps):.6g}: steps a degree)"
    yield f"($11{number}={motion.feed_deg_min:g}: degrees a minute, at most)"
    yield f"($12{number}={motion.acceleration_deg_s2:g}: degrees/s^2)"
    if motion.trigger == "coolant":
        yield "(the camera's release is a relay on the coolant output)"


def _photographs(todo: StopSequence, motion: MotionSpec) -> Iterator[str]:
    """One run through all stops, from below."""
    yield f"G1 {_place(todo.start, motion)} F{motion.feed_deg_min:g}"
    stops = zip(todo.angle.tolist(), todo.mirrors.tolist(), strict=True)
    for stop, (angle, count) in enumerate(stops, 1):
        yield f"(stop {stop} of {len(todo.angle)}: {count} mirrors)"
        yield f"G1 {_place(angle, motion)}"
        yield from _photograph(stop, motion)


def _photograph(stop: int, motion: MotionSpec) -> Iterator[str]:
    if motion.settle_s:
        yield _dwell(motion.settle_s)
    if motion.trigger == "pause":
        yield f"M0 (MSG, stop {stop}: photograph, then resume)"
        return
    yield "M8"
    yield _dwell(motion.trigger_s)
    yield "M9"
    if motion.exposure_s:
        yield _dwell(motion.exposure_s)


def _dwell(seconds: float) -> str:
    return f"G4 P{seconds:.3f}"


def _place(angle: float, motion: MotionSpec) -> str:
    """The axis' word for an angle in degrees, cut toward zero so that no limit is passed."""
    scale = 10**DECIMALS
    return f"{motion.axis}{math.trunc(angle * scale) / scale + 0.0:.{DECIMALS}f}"

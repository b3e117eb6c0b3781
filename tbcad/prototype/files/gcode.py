"""rotation_plan.nc: the plan as G-code for a GRBL-style controller with one rotary axis.

At each stop it takes a photograph in the dark, one of each LED alone and one of the lit object.

GRBL 1.1 knows the axes X, Y and Z only and refuses the word A, so its X takes degrees for
millimetres; controllers with more axes take A. It drops comments in round brackets, shows none of
them itself, and reads lines of at most 79 characters. M8, M9 and G4 wait for the motion to end; M64
and M65 are done when they are read, so a dwell comes before them after every motion.
With grblHAL the program homes; its settings tell which axis. GRBL 1.1 homes X alone only if it is
built for that, so there a person puts the base to angle zero by the pin.
Sources: grblHAL core gcode.c; grbl/gcode.c, grbl/protocol.h and doc/markdown/settings.md of GRBL
1.1h.
"""

import math
from collections.abc import Iterator

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.drive.travel import StopSequence, home_angles, stop_sequence
from tbcad.prototype.electronics import LIT, phases
from tbcad.records.prototype_drive import Phase

MAX_LINE_LENGTH = 79
RUNS = 2  # one for each turn of the object
DECIMALS = 4  # of a degree: far below a microstep, and 7 digits are what GRBL's floats hold
SYNC_S = 0.01  # shortest dwell, which makes the controller wait for the end of a motion
SETTING = {"X": 0, "A": 3}  # of the axis: $100 or $103, and so on


def gcode_program(
    prototype: PrototypeLayout, drive: Drive, motion: MotionSpec, leds: int
) -> list[str]:
    """Lines of the program for the stops of a prototype, each shorter than 80 characters.

    Raises:
        SpecError: when the base cannot be where the program starts, for post or camera.
    """
    sequence, lit = stop_sequence(prototype, motion), phases(leds, motion)
    lines = [
        *_header(sequence, drive, motion, lit),
        *_known_angle(prototype, motion),
        *(f"M65 P{phase.output}" for phase in lit if phase.output is not None),
        *_photographs(sequence, motion, lit),
        f"G1 {_axis_word(sequence.start, motion)}",
        "M0 (MSG, turn the object by 180 degrees about z, then resume)",
        *_photographs(sequence, motion, lit),
        f"G1 {_axis_word(motion.home_deg, motion)}",
        "G92.1",
        "M2",
    ]
    assert max(len(line) for line in lines) <= MAX_LINE_LENGTH
    return lines


def _known_angle(prototype: PrototypeLayout, motion: MotionSpec) -> Iterator[str]:
    """The base to a known angle: by homing, or by a person."""
    modes = "G21 G90 G94 G54 (a degree for a millimetre, absolute, units a minute)"
    if motion.controller == "grbl":
        yield f"M0 (MSG, base at {motion.home_deg:g} degrees, object straight? Then resume)"
        yield modes
        yield f"G92 {_axis_word(motion.home_deg, motion)}"
        return
    homed = round(home_angles(prototype, motion).homed + motion.home_trim_deg, DECIMALS)
    yield from ("M0 (MSG, zero pin out, object straight? Then resume)", "$H", modes)
    yield f"G92 {_axis_word(homed, motion)}"


def duration_minutes(sequence: StopSequence, motion: MotionSpec, lit: tuple[Phase, ...]) -> float:
    """Duration of the program, min, without pauses and manual work."""
    travel = RUNS * 2 * (float(sequence.angle[-1]) - sequence.start)
    each = motion.light_s if len(lit) > 1 else 0.0
    if motion.trigger == "coolant":
        each += motion.trigger_s + motion.exposure_s
    rest = _settle_s(motion, lit) + len(lit) * each
    return travel / motion.feed_deg_min + RUNS * len(sequence.angle) * rest / 60


def _settle_s(motion: MotionSpec, lit: tuple[Phase, ...]) -> float:
    """Dwell after a motion, s; with lights to switch, never none."""
    return max(motion.settle_s, SYNC_S if len(lit) > 1 else 0.0)


def _header(
    sequence: StopSequence, drive: Drive, motion: MotionSpec, lit: tuple[Phase, ...]
) -> Iterator[str]:
    number = SETTING[motion.axis]
    minutes = duration_minutes(sequence, motion, lit)
    yield f"(rotation plan: {len(sequence.angle)} stops, twice, about {minutes:.0f} min)"
    yield f"({drive.name}, {drive.motor.name}, {drive.ratio:g} turns of the motor a turn)"
    yield "(settings for the controller, to be sent before:)"
    yield "($1=255: motor always on, for the base falls without it)"
    yield f"($10{number}={drive.steps_per_deg(motion.microsteps):.6g}: steps a degree)"
    yield f"($11{number}={motion.feed_deg_min:g}: degrees a minute, at most)"
    yield f"($12{number}={motion.acceleration_deg_s2:g}: degrees/s^2)"
    if motion.trigger == "coolant":
        yield "(the camera's release is a relay on the coolant output)"
    for phase in lit:
        if phase.output is not None:
            name = "lamp" if phase.name == LIT else phase.name
            yield f"(digital output {phase.output}: {name})"


def _photographs(
    sequence: StopSequence, motion: MotionSpec, lit: tuple[Phase, ...]
) -> Iterator[str]:
    """One run through all stops, in ascending order."""
    yield f"G1 {_axis_word(sequence.start, motion)} F{motion.feed_deg_min:g}"
    stops = zip(sequence.angle.tolist(), sequence.mirrors.tolist(), strict=True)
    for stop, (angle, count) in enumerate(stops, 1):
        yield f"(stop {stop} of {len(sequence.angle)}: {count} mirrors)"
        yield f"G1 {_axis_word(angle, motion)}"
        if settle := _settle_s(motion, lit):
            yield _dwell(settle)
        for phase in lit:
            yield from _phase(stop, phase, motion, switched=len(lit) > 1)


def _phase(stop: int, phase: Phase, motion: MotionSpec, *, switched: bool) -> Iterator[str]:
    """One photograph: its light on, released, and off again when it is exposed."""
    if phase.output is not None:
        yield f"M64 P{phase.output}"
    if switched and motion.light_s:
        yield _dwell(motion.light_s)
    name = f"{phase.name}, " if switched else ""
    if motion.trigger == "pause":
        yield f"M0 (MSG, stop {stop}: {name}photograph, then resume)"
    else:
        yield from ("M8", _dwell(motion.trigger_s), "M9")
        if motion.exposure_s:
            yield _dwell(motion.exposure_s)
    if phase.output is not None:
        yield f"M65 P{phase.output}"


def _dwell(seconds: float) -> str:
    return f"G4 P{seconds:.3f}"


def _axis_word(angle: float, motion: MotionSpec) -> str:
    """The axis word of an angle in degrees, truncated toward zero so that no limit is exceeded."""
    scale = 10**DECIMALS
    return f"{motion.axis}{math.trunc(angle * scale) / scale + 0.0:.{DECIMALS}f}"

"""Files of the chosen controller: program and settings of GRBL and grblHAL, or of Klipper.

rotation_plan.nc: at each stop a photograph in the dark, one of each LED alone and one of the lit
object. GRBL 1.1 refuses the word A, so its X takes degrees for millimetres; it drops comments in
round brackets, and reads lines of at most 79 characters. Why lights wait for a dwell: decision
0012. With grblHAL the program homes; GRBL 1.1 homes X alone only if it is built for that, so there
a person puts the base to angle zero by the pin.

grbl_settings.txt: a board that had another life is set whole. An alarm in mid-motion lets the motor
go in spite of $1, in grblHAL but for the axes of $37. Left to the board are $2, $4 and $14 to $16,
which follow from its circuit. After homing GRBL sets the machine's coordinate to minus the travel
plus the pull-off, and soft limits keep it between minus the travel and zero; grblHAL keeps the
pull-off from both ends.

rotation_plan_klipper.gcode and klipper.cfg: Klipper drives the base as a manual stepper whose
millimetres are degrees, without any kinematics. Its G4 takes milliseconds, SPEED is a second's, and
SET_PIN waits for the motion as moves do. Two things would let the motor go. Without [idle_timeout]
Klipper sends M84 after 600 s without motion, as in a pause. And a shutdown takes a stepper's
enable_pin back, but leaves a static output as it is: so the driver is enabled by one.
Sources: klippy/extras/manual_stepper.py, output_pin.py, idle_timeout.py, stepper_enable.py and
static_digital_output.py; Config_Reference.md, G-Codes.md; doc/markdown/settings.md, grbl/limits.c,
gcode.c, protocol.h and stepper.c of GRBL 1.1h; gcode.c, settings.h, config.h, machine_limits.c and
stepper.c of grblHAL core.
"""

import math
import re
from collections.abc import Iterable, Iterator
from importlib.resources import files

from tbcad.cad.formats.checked_files import Row
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import (
    PULL_OFF_DEG,
    HomeAngles,
    StopSequence,
    home_angles,
    stop_sequence,
)
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.electronics import LAMP, LAMP_OUTPUT, LIT, lights, phases
from tbcad.records.prototype_drive import Phase

NAME = "grbl_settings.txt"
AXES = "XYZA"  # a bit of a mask each, and the last digit of $100, $110, $120, $130
SEEK_DEG_MIN, LOCATE_DEG_MIN = 360.0, 60.0
DEBOUNCE_MS = 25
# A pulled-up input is high, which means pressed, with an open switch and with none (grblHAL core,
# config.h: the default 0 is for normally closed switches to ground): empty ones are inverted.
OTHER_AXES = 0b111
OTHER_CYCLES = range(45, 50)  # of homing; boards have those of their axes, three at least
PULSE_US = 10  # of a step: optocouplers of drivers need 5 to 10
# Places of the machine, and in grblHAL its other defaults (bits 0 to 8) and reports while it homes.
GRBL_REPORTS, HAL_REPORTS = 0b1, 0b1_1111_1111 | 1 << 12
PLAN, KLIPPER_PLAN, CONFIG = "rotation_plan.nc", "rotation_plan_klipper.gcode", "klipper.cfg"
STEPPER = "MANUAL_STEPPER STEPPER=base"
SEARCH = 1.5  # travel of the search for the switch, over the travel, as GRBL has it
MINUTE_S, MILLISECONDS = 60, 1000
MESSAGE = re.compile(r"M0 \(MSG, (.*?)[,.?]? [Tt]hen resume\)")
# Not the stepper's enable_pin, which a shutdown takes back. The switch is normally closed to
# ground: high when pressed. After a day Klipper tells that it is idle, and does no more.
_TEMPLATE = files("tbcad.prototype") / "files" / "klipper.cfg"
KLIPPER_PINS = {"home": "endstop_pin", "motor": "step_pin and dir_pin"}
TRAVEL_STEP_DEG = 0.001  # that the travel is rounded up to
Setting = tuple[int, float, str]


def controller_files(
    layout: PrototypeLayout, drive: Drive, motion: MotionSpec, leds: int, design: str
) -> dict[str, str]:
    """Texts of the chosen controller's program and settings, by name."""
    program, angles = gcode_program(layout, drive, motion, leds), home_angles(layout, motion)
    texts: dict[str, Iterable[str]] = {
        KLIPPER_PLAN: klipper_program(program, motion, angles),
        CONFIG: klipper_config(drive, motion, lights(leds, motion)),
    }
    if motion.controller != "klipper":
        title = f"settings of {design} for {motion.controller}"
        values = settings(drive, motion, angles)
        texts = {PLAN: program, NAME: settings_lines(title, values)}
    return {name: "\n".join(lines) + "\n" for name, lines in texts.items()}


def wired(row: Row, motion: MotionSpec) -> Row:
    """A line of the wiring, for Klipper with the names and commands of klipper.cfg."""
    if motion.controller != "klipper":
        return row
    signal = str(row["signal"])
    if row["on"]:
        switch, pin = f"SET_PIN PIN={signal} VALUE=", f"[output_pin {signal}]"
        output = re.sub(r"coolant|(?<=digital )\d+", pin, str(row["output"]))
        return {**row, "output": output, "on": f"{switch}1", "off": f"{switch}0"}
    return {**row, "output": KLIPPER_PINS.get(signal, row["output"])}


def settings(drive: Drive, motion: MotionSpec, angles: HomeAngles) -> list[Setting]:
    """Number, value and meaning of each setting, in an order in which GRBL takes them."""
    axis = AXES.index(motion.axis)
    travel = math.ceil(angles.travel / TRAVEL_STEP_DEG - TRAVEL_STEP_DEG) * TRAVEL_STEP_DEG
    hal = motion.controller == "grblhal"
    common: list[Setting] = [
        (0, PULSE_US, "microseconds of a step's pulse"),
        (1, 255, "motor always on, for the base falls without it"),
        (3, 0, f"{1 << axis} if the base turns against its arrow"),
        (10, HAL_REPORTS if hal else GRBL_REPORTS, "what status reports tell"),
        (13, 0, "reports in degrees, not divided by 25.4"),
        (32, 0, "no laser, no lathe"),
        (100 + axis, drive.steps_per_deg(motion.microsteps), "steps a degree"),
        (110 + axis, motion.feed_deg_min, "degrees a minute, at most"),
        (120 + axis, motion.acceleration_deg_s2, "degrees/s^2"),
        (130 + axis, travel, "degrees of travel"),
    ]
    unhomed: list[Setting] = [
        (20, 0, "no soft limits: the base is not homed"),
        (21, 0, "no hard limits"),
        (22, 0, "no homing"),
    ]
    return common + (_homing(1 << axis, motion) if hal else unhomed)


def _homing(mask: int, motion: MotionSpec) -> list[Setting]:
    seek = min(SEEK_DEG_MIN, motion.feed_deg_min)
    return [
        (37, mask, "motor on in alarms too"),
        (62, 0, "no sleep: it lets the motor go"),
        (5, OTHER_AXES & ~mask, "the switch opens when it is pressed; other inputs are empty"),
        (18, 0, "inputs of switches are pulled up"),
        (22, 1, "homing"),
        (43, 1, "homing: passes"),
        (44, mask, "homing: this axis"),
        *((cycle, 0, "homing: no other axis") for cycle in OTHER_CYCLES),
        (23, mask, "homing: toward negative angles"),
        (24, min(LOCATE_DEG_MIN, seek), "homing: degrees a minute, to find the switch again"),
        (25, seek, "homing: degrees a minute, to find the switch"),
        (26, DEBOUNCE_MS, "homing: ms until the switch has settled"),
        (27, PULL_OFF_DEG, "homing: degrees of pull-off"),
        (20, 1, "soft limits"),
        (21, 1, "hard limit: the switch stops the base"),
    ]


def settings_lines(title: str, values: list[Setting]) -> Iterator[str]:
    """Lines of the file: a title, and for each setting its meaning and its value."""
    yield f"({title})"
    for number, value, meaning in values:
        yield f"({meaning})"
        yield f"${number}={value:.7g}"


def klipper_program(lines: list[str], motion: MotionSpec, angles: HomeAngles) -> Iterator[str]:
    """The lines of a program for grblHAL, translated."""
    for line in lines:
        yield from _translated(line, motion, angles)


def _translated(line: str, motion: MotionSpec, angles: HomeAngles) -> Iterator[str]:
    code, _, rest = line.partition(" ")
    if message := MESSAGE.fullmatch(line):
        yield f'RESPOND MSG="{message[1]}"'
        yield "PAUSE"
    elif code == "$H":
        yield from _klipper_homing(motion, angles)
    elif code == "G1":
        words = rest.split()
        yield f"{STEPPER} MOVE={words[0][1:]} SPEED={motion.feed_deg_min / MINUTE_S:g}"
    elif code == "G4":
        yield f"G4 P{float(rest[1:]) * MILLISECONDS:.0f}"
    elif code in ("M8", "M9"):
        yield f"SET_PIN PIN=release VALUE={int(code == 'M8')}"
    elif code in ("M64", "M65"):
        light = LAMP if int(rest[1:]) == LAMP_OUTPUT else f"led_{rest[1:]}"
        yield f"SET_PIN PIN={light} VALUE={int(code == 'M64')}"
    elif line.startswith("(stop"):
        yield f"; {line.strip('()')}"


def _klipper_homing(motion: MotionSpec, angles: HomeAngles) -> Iterator[str]:
    """Down to the switch, which is at a known angle, and off it."""
    speed = min(SEEK_DEG_MIN, motion.feed_deg_min) / MINUTE_S
    trim = motion.home_trim_deg
    yield f"{STEPPER} ENABLE=1 SET_POSITION=0"
    yield f"{STEPPER} MOVE={-SEARCH * angles.travel:.4f} SPEED={speed:g} STOP_ON_ENDSTOP=1"
    yield f"{STEPPER} SET_POSITION={angles.switch + trim:.4f}"
    yield f"{STEPPER} MOVE={angles.homed + trim:.4f} SPEED={speed:g}"


def klipper_config(drive: Drive, motion: MotionSpec, outputs: Iterable[str]) -> Iterator[str]:
    """A configuration to include; pins of the board are left to fill in."""
    yield from _TEMPLATE.read_text(encoding="utf-8").splitlines()
    yield f"gear_ratio: {drive.ratio:.7g}:1"
    yield f"full_steps_per_rotation: {drive.motor['full_steps']:.0f}"
    yield f"microsteps: {motion.microsteps}"
    yield f"velocity: {motion.feed_deg_min / MINUTE_S:g}"
    yield f"accel: {motion.acceleration_deg_s2:g}"
    for name in ("release", *outputs):
        yield from (f"[output_pin {name}]", "pin: FILL_IN", "value: 0")


MAX_LINE_LENGTH = 79
RUNS = 2  # one for each turn of the object
DECIMALS = 4  # of a degree: far below a microstep, and 7 digits are what GRBL's floats hold
SYNC_S = 0.01  # shortest dwell, which makes the controller wait for the end of a motion
SETTING = {"X": 0, "A": 3}  # of the axis: $100 or $103, and so on


def gcode_program(
    prototype: PrototypeLayout, drive: Drive, motion: MotionSpec, leds: int
) -> list[str]:
    """Lines of the program for the stops of a prototype, each shorter than 80 characters.

    SpecError when the base cannot be where the program starts, for post or camera.
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
    if not motion.homes:
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

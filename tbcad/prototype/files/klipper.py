"""rotation_plan_klipper.gcode and klipper.cfg: the same plan for Klipper, written from the program.

Klipper drives the base as a manual stepper whose millimetres are degrees, without any kinematics.
Its G4 takes milliseconds, SPEED is a second's, and SET_PIN waits for the motion as moves do.

Two things would let the motor go. Without [idle_timeout] Klipper sends M84 after 600 s without
motion, as in a pause. And a shutdown takes a stepper's enable_pin back, but leaves a static output
as it is: so the driver is enabled by one.
Sources: klippy/extras/manual_stepper.py, output_pin.py, idle_timeout.py, stepper_enable.py and
static_digital_output.py; Config_Reference.md, G-Codes.md.
"""

import re
from collections.abc import Iterator

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.drive.travel import HomeAngles
from tbcad.prototype.electronics.outputs import LAMP, LAMP_OUTPUT, Light
from tbcad.prototype.files.settings import SEEK_DEG_MIN

PROGRAM, CONFIG = "rotation_plan_klipper.gcode", "klipper.cfg"
STEPPER = "MANUAL_STEPPER STEPPER=base"
SEARCH = 1.5  # travel of the search for the switch, over the travel, as GRBL has it
MINUTE_S, MILLISECONDS = 60, 1000
IDLE_S = 86_400  # of a day, after which Klipper tells that it is idle, and does no more
MESSAGE = re.compile(r"M0 \(MSG, (.*?)[,.?]? [Tt]hen resume\)")
PIN = "FILL_IN"  # what the user's board has


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
        yield from _homing(motion, angles)
    elif code == "G1":
        words = rest.split()
        yield f"{STEPPER} MOVE={words[0][1:]} SPEED={motion.feed_deg_min / MINUTE_S:g}"
    elif code == "G4":
        yield f"G4 P{float(rest[1:]) * MILLISECONDS:.0f}"
    elif code in ("M8", "M9"):
        yield f"SET_PIN PIN=release VALUE={int(code == 'M8')}"
    elif code in ("M64", "M65"):
        yield f"SET_PIN PIN={_light(int(rest[1:]))} VALUE={int(code == 'M64')}"
    elif line.startswith("(stop"):
        yield f"; {line.strip('()')}"


def _light(output: int) -> str:
    return LAMP if output == LAMP_OUTPUT else f"led_{output}"


def _homing(motion: MotionSpec, angles: HomeAngles) -> Iterator[str]:
    """Down to the switch, which is at a known angle, and off it."""
    speed = min(SEEK_DEG_MIN, motion.feed_deg_min) / MINUTE_S
    trim = motion.home_trim_deg
    yield f"{STEPPER} ENABLE=1 SET_POSITION=0"
    yield f"{STEPPER} MOVE={-SEARCH * angles.travel:.4f} SPEED={speed:g} STOP_ON_ENDSTOP=1"
    yield f"{STEPPER} SET_POSITION={angles.switch + trim:.4f}"
    yield f"{STEPPER} MOVE={angles.homed + trim:.4f} SPEED={speed:g}"


def klipper_config(drive: Drive, motion: MotionSpec, lights: tuple[Light, ...]) -> Iterator[str]:
    """A configuration to include; pins of the board are left to fill in."""
    yield "# base of the prototype: degrees for millimetres; fill in the pins of the board"
    yield "# zero pin in before RESTART, FIRMWARE_RESTART or the supply's switch: they let it fall"
    yield "[printer]"
    yield "kinematics: none"
    yield "max_velocity: 1000"
    yield "max_accel: 1000"
    yield "[pause_resume]"
    yield "[respond]"
    yield "[idle_timeout]"
    yield f"timeout: {IDLE_S}"
    yield "gcode:"
    yield '    RESPOND MSG="idle, the motor stays on"'
    yield "[static_digital_output base_enable]"
    yield f"pins: {PIN}"  # not enable_pin of the stepper, which a shutdown takes back
    yield "[manual_stepper base]"
    yield from (f"{name}_pin: {PIN}" for name in ("step", "dir"))
    yield f"endstop_pin: ^{PIN}"  # normally closed to ground: high when pressed
    yield "rotation_distance: 360"
    yield f"gear_ratio: {drive.ratio:.7g}:1"
    yield f"full_steps_per_rotation: {drive.motor['full_steps']:.0f}"
    yield f"microsteps: {motion.microsteps}"
    yield f"velocity: {motion.feed_deg_min / MINUTE_S:g}"
    yield f"accel: {motion.acceleration_deg_s2:g}"
    for name in ("release", *(light.name for light in lights)):
        yield f"[output_pin {name}]"
        yield f"pin: {PIN}"
        yield "value: 0"

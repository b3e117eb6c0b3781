"""grbl_settings.txt: the controller's settings, worked out from the drive, to be sent line by line.

A comment in round brackets is on a line of its own before each setting. A board that had another
life is set whole: reports of the machine's place in degrees, no laser, no sleep, motor always on.
An alarm in mid-motion lets the motor go in spite of $1, in grblHAL but for the axes of $37. Left to
the board are $2, $4 and $14 to $16, which follow from its circuit. After homing GRBL sets the
machine's coordinate to minus the travel plus the pull-off, and soft limits keep it between minus
the travel and zero; grblHAL keeps the pull-off from both ends.
Sources: doc/markdown/settings.md, grbl/limits.c and stepper.c of GRBL 1.1h; settings.h, config.h,
machine_limits.c and stepper.c of grblHAL core.
"""

import math
from collections.abc import Iterator
from pathlib import Path

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.drive.travel import PULL_OFF_DEG, HomeAngles

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
TRAVEL_STEP_DEG = 0.001  # that the travel is rounded up to
Setting = tuple[int, float, str]


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
    return common + (_homing(1 << axis, motion) if hal else UNHOMED)


UNHOMED: list[Setting] = [
    (20, 0, "no soft limits: the base is not homed"),
    (21, 0, "no hard limits"),
    (22, 0, "no homing"),
]


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


def write_settings(path: Path, lines: Iterator[str]) -> None:
    """Write grbl_settings.txt."""
    path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")

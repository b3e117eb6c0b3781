"""Angle zero, the switch and the controller's settings, from solids, program and text.

The angle of the switch is measured: from the tab of the zero disc and the roller of the switch in
the STEP assembly. Limits are the verifier's own.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_machine import run_program
from tbcad_verify.prototype.control.program_checks import PULL_OFF_DEG, homing, is_klipper
from tbcad_verify.prototype.drive_checks import FULL_STEPS, gear_of
from tbcad_verify.record.prototype import SETTINGS
from tbcad_verify.report.checks import Check, CheckName, Unknown, no_faults, require
from tbcad_verify.step.solids_text import TextSolid, distance_to_line, holes
from tbcad_verify.types import Floats

PIN_MM, PIN_HOLE_MM = 4.0, 4.2
PINNED, DOWEL = ("zero_disc", "bearing_head"), re.compile(r"DOWEL-(\d+)x\d+")
MIN_PIN_OUT_MM = 40.0  # of the pin from the axis: for 0.3 degrees
SAME_MM = 1e-6
ROLLER_MM = 2.4  # radius
PRESSED_MM = (0.05, 1.5)  # of the tab from the pressed roller
SWITCH_DEG = 1.5  # of the switch's angle from the record's
MIN_FREE_DEG = 2.5  # of the switch below all that the program drives to
TOP_MM = 0.01  # of the tab's corners
SETTING = re.compile(r"\$(\d{1,3})=(-?\d+(?:\.\d+)?(?:e-?\d+)?)")
# What people read beside the settings, and obey.
TOLD = (
    *(r"settings of [\w .-]+ for grbl(?:hal)?", "microseconds of a step's pulse"),
    *("motor always on, for the base falls without it", r"\d if the base turns against its arrow"),
    *("what status reports tell", r"reports in degrees, not divided by 25\.4"),
    *("no laser, no lathe", r"steps a degree|degrees a minute, at most|degrees/s\^2"),
    *("degrees of travel", "motor on in alarms too", "no sleep: it lets the motor go"),
    "the switch opens when it is pressed; other inputs are empty",
    *("inputs of switches are pulled up", "homing", "homing: (?:passes|(?:this|no other) axis)"),
    *("homing: toward negative angles", "homing: degrees a minute, to find the switch(?: again)?"),
    *("homing: ms until the switch has settled", "homing: degrees of pull-off", "soft limits"),
    *("hard limit: the switch stops the base", "no soft limits: the base is not homed"),
    *("no hard limits", "no homing"),
)
COMMENT = re.compile(rf"\((?:{'|'.join(TOLD)})\)")
SHARE = 1e-6
PULSE_US, DEBOUNCE_MS = 10.0, 25.0
PLACES = 1.0  # bit of $10 in both firmwares: the machine's place
HAL_DEFAULT, REPORTS_HOMING = 511, 4096  # bits 0 to 8, and 12: grblHAL core, settings.h
MAX_STEPS_S = 30_000.0  # that GRBL makes
MAX_SEEK_DEG_MIN = 720.0
# A pulled-up input is high with an open switch and with none: pressed, unless $5 inverts it.
XYZ = 0b111
MAX_BEYOND_DEG = 4.0  # of soft limits beyond the program
AXES = "XYZA"
FILE = SETTINGS
CHECKS = {"homing": "faults", "controller settings": "faults"}


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """Pin, tab and switch in the solids; settings against gear and program."""
    home = [*_pin(context, solids), *_switch(context, solids)]
    settings = settings_faults(context, gear_of(context, solids).ratio)
    return [no_faults(*pair) for pair in zip(names, (home, settings), strict=True)]


def _pin(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    """Holes of disc and head in line at base angle zero; the rod is long enough; the play."""
    axis, home, places = context.frame[0], context.prototype.home, []
    for name in PINNED:
        solid = require(solids.get(name), f"the assembly has no {name}")
        found = holes(solid.faces, PIN_HOLE_MM / 2, SAME_MM)
        found = [hole for hole in found if abs(hole.axis @ axis) > 1 - SAME_MM]
        if len(found) != 1:
            yield f"{name} has {len(found)} holes for the zero pin"
            return
        places.append(found[0].point)
    disc, head = places
    if distance_to_line(disc, head, axis) > SAME_MM:
        yield "the zero pin's holes are not in line at base angle zero"
    if distance_to_line(disc, np.zeros(3), axis) < MIN_PIN_OUT_MM:
        yield "the zero pin is too near to the axis"
    path = float((solids["zero_disc"].corners @ axis).max() - head @ axis)
    rod = re.fullmatch(r"ROD-4x(\d+)", home.pin)
    if not rod or float(rod[1]) < path:
        yield f"{home.pin} does not reach through {path:.0f} mm"
    error = _play(context, solids, PINNED, disc, PIN_MM)
    for one in context.prototype.fasteners:
        if one.through[0] == "zero_disc" and (dowel := DOWEL.fullmatch(one.part)):
            error += _play(context, solids, one.through, one.position, float(dowel[1]))
    if not math.isclose(error, home.zero_error, rel_tol=SHARE):
        yield f"zero_error_deg is {home.zero_error:.4g}; the play of pin and key is {error:.4g} deg"


def _play(
    context: PrototypeContext,
    solids: Mapping[str, TextSolid],
    bodies: Sequence[str],
    place: Floats,
    diameter: float,
) -> float:
    """Angle by which bodies turn on a pin through all of them: half its play in each, degrees."""
    axis = context.frame[0]
    gaps = [
        face.radius - diameter / 2
        for body in bodies
        for face in solids[body].faces
        if face.hollow and distance_to_line(face.point, place, axis) < SAME_MM
    ]
    lever = distance_to_line(place, np.zeros(3), axis)
    return math.degrees(len(bodies) * max(gaps, default=math.inf) / lever)


def _polar(context: PrototypeContext, points: Floats) -> Floats:
    """(n, 2) distance from the axis in mm, and azimuth in degrees, of points (n, 3)."""
    _, out, side = context.frame @ points.T
    return np.stack([np.hypot(out, side), np.degrees(np.arctan2(side, out))], axis=1)


def _switch(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    """The base angle at which the tab's arc begins at the roller, and what the tab presses then.

    GRBL 1.1 does not home, and needs none.
    """
    grbl = context.export.spec.prototype.motion.controller == "grbl"
    if grbl and "home_switch" not in solids:
        return
    switch = require(solids.get("home_switch"), "the assembly has no home_switch")
    disc = require(solids.get("zero_disc"), "the assembly has no zero_disc")
    rollers = [
        face
        for face in switch.faces
        if face.kind == "cylinder" and not face.hollow and abs(face.radius - ROLLER_MM) < SAME_MM
    ]
    if not rollers:
        raise Unknown("the switch has no roller")
    distance, azimuth = _polar(context, rollers[0].point[None])[0].tolist()
    corners = _polar(context, disc.corners)
    top = float(corners[:, 0].max())
    gap = distance - ROLLER_MM - top
    if not PRESSED_MM[0] <= gap <= PRESSED_MM[1]:
        yield f"the tab is {gap:.2f} mm from the pressed roller"
    arc = corners[corners[:, 0] > top - TOP_MM, 1]
    first, width = _arc(arc)
    measured, home = (azimuth - first + 180) % 360 - 180, context.prototype.home
    if abs((measured - home.switch + 180) % 360 - 180) > SWITCH_DEG:
        yield f"the switch trips at {measured:.1f} deg, not at {home.switch:.1f}"
    if abs(home.homed - home.switch - PULL_OFF_DEG) > SHARE:
        yield f"homing ends at {home.homed:.4f} deg"
    stops = context.prototype.stops.angle
    pressed = [(azimuth - first - angle) % 360 for angle in stops.tolist()]
    if any(value < width + MIN_FREE_DEG or value > 360 - MIN_FREE_DEG for value in pressed):
        yield "the tab presses the switch at a stop"


def _arc(azimuth: Floats) -> tuple[float, float]:
    """First azimuth of an arc of corners, and its width, degrees."""
    ordered = np.sort(azimuth)
    gaps = np.diff(np.append(ordered, ordered[0] + 360))
    last = int(gaps.argmax())
    first = float(ordered[(last + 1) % len(ordered)])
    return first, 360.0 - float(gaps[last])


def settings_faults(context: PrototypeContext, ratio: float) -> Iterator[str]:
    """Settings that are missing, foreign, or unlike what gear, motion and program need.

    Klipper has none.
    """
    if is_klipper(context):
        return
    values, faults = parsed_settings(context.prototype.settings)
    yield from faults
    motion = context.export.spec.prototype.motion
    axis = AXES.index(motion.axis)
    mask, others = float(1 << axis), {130 + axis}
    expected: dict[int, float] = {0: PULSE_US, 1: 255, 3: 0, 13: 0, 32: 0}
    expected[100 + axis] = FULL_STEPS * motion.microsteps * ratio / 360
    expected |= {110 + axis: motion.feed_deg_min, 120 + axis: motion.acceleration_deg_s2}
    if motion.controller == "grbl":
        expected |= {10: PLACES, 20: 0, 21: 0, 22: 0}
    else:
        # The motor on in alarms; no sleep; pulled-up inputs; reports while it homes.
        expected |= {37: mask, 62: 0, 18: 0, 10: HAL_DEFAULT | REPORTS_HOMING, 43: 1}
        expected |= {5: XYZ & ~(1 << axis), 20: 1, 21: 1, 22: 1, 23: mask, 27: PULL_OFF_DEG}
        expected |= {26: DEBOUNCE_MS, 44: mask} | dict.fromkeys(range(45, 50), 0.0)
        others |= {24, 25}
    for number, value in expected.items():
        if not math.isclose(values.get(number, math.nan), value, rel_tol=SHARE):
            yield f"${number} is {values.get(number, 'missing')}, not {value:g}"
    if foreign := values.keys() - expected.keys() - others:
        yield f"${min(foreign)} is not needed"
    steps = values.get(110 + axis, 0.0) / 60 * values.get(100 + axis, 0.0)
    if steps > MAX_STEPS_S:
        yield f"{steps:.0f} steps/s, a controller makes {MAX_STEPS_S:.0f}"
    yield from _limits(context, values, values.get(130 + axis, math.nan))


def parsed_settings(text: str) -> tuple[dict[int, float], list[str]]:
    """Settings by number; what is wrong with other lines. Soft limits need homing before them."""
    values: dict[int, float] = {}
    faults = []
    for number, line in enumerate(text.splitlines(), 1):
        if found := SETTING.fullmatch(line):
            if int(found[1]) in values:
                faults.append(f"${found[1]} is there twice")
            values[int(found[1])] = float(found[2])
        elif not COMMENT.fullmatch(line):
            faults.append(f"line {number}, {line!r}, is no setting, and no words that tbcad writes")
    order = list(values)
    if values.get(20) and (22 not in order or order.index(22) > order.index(20)):
        faults.append("$20 before $22, which GRBL refuses")
    return values, faults


def _limits(context: PrototypeContext, values: Mapping[int, float], travel: float) -> Iterator[str]:
    """Soft limits hold the program and little more; homing is slow, and finds the switch again."""
    switch, homed = homing(context)
    if math.isnan(switch):
        return
    machine = run_program(context.prototype.program, switch, homed)
    driven = machine.driven or [math.nan]
    low, high = switch + PULL_OFF_DEG, switch + travel - PULL_OFF_DEG
    trim = abs(context.export.spec.prototype.motion.home_trim_deg)
    if not (low <= min(driven) + trim + SHARE and max(driven) <= high + trim + SHARE):
        yield f"soft limits {low:.1f} to {high:.1f} deg do not hold the program"
    if not high - max(driven) <= MAX_BEYOND_DEG + trim:
        yield f"the upper soft limit is {high - max(driven):.1f} deg above the program"
    locate, seek = values.get(24, math.nan), values.get(25, math.nan)
    feed = context.export.spec.prototype.motion.feed_deg_min
    if not 0 < locate <= seek <= min(MAX_SEEK_DEG_MIN, feed):
        yield f"homing at {seek:g} and {locate:g} degrees a minute"

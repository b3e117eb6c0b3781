"""The controller's lines: outputs, resistors, connectors and wires, worked out from the spec.

Values of parts are taken from here: forward voltage and largest current of white LEDs, the
series E24 of IEC 60063, diameters of wires. The bore of the wires is measured in the STEP file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.drive_loads import PHASES
from tbcad_verify.prototype.gcode_checks import expected_lights
from tbcad_verify.prototype.gcode_lines import LAMP
from tbcad_verify.record.prototype import WIRING
from tbcad_verify.record.prototype_tables import Wiring
from tbcad_verify.report.checks import Check, CheckName, at_most, require, short_list
from tbcad_verify.step.solids_text import TextSolid

FORWARD_V, MAX_MA = 3.2, 20.0  # of a white LED of 3 or 5 mm
E24 = frozenset(
    (10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30, 33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91)
)
STEP = 1.11  # largest ratio of two neighbours of the series, rounded up
DERATING = 2.0  # of a resistor's rating over what it dissipates
WIRE_MM = {"WIRE-28": 0.9, "WIRE-30": 0.5}
CABLE, LEAST_CABLE_MM = "CABLE-2x0.25", 1000.0  # of lamp, release and switch
MAX_FILL = 0.5  # of the bore's section by the wires' squares
GROOVE_MM = 0.8  # depth of the arms' grooves
LEAST_LEAD_MM = 500.0  # of wire beyond the stage
WIRES = 2  # of an LED
SUPPLY = ("SUPPLY-24V", "FUSE-2A", 24.0)
STRIP_V = 24.0
STRIPS_W_MM = {"STRIP-COB-24V": 10e-3, "STRIP-240-24V": 19.2e-3}  # of the lamps' strips
LAMPS_MA = 1000.0  # beside the motor, from a supply of 2 A
SHARE = 1e-9
AXIAL_MM = 1e-6
UP = np.array([0.0, 0.0, 1.0])
CHECKS = {"wiring": "faults"}


@dataclass(frozen=True)
class Circuit:
    """One LED's circuit: value (ohm) and rating (W) of its resistor, current in mA, power in W."""

    ohm: float
    rating: float
    current: float
    power: float


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """Compare lines and phases with the spec, the bore with the wires."""
    faults = [*_phases(context), *_lines(context), *_bore(context, solids)]
    return [at_most(names[0], len(faults), 0, short_list(faults))]


def bought(context: PrototypeContext) -> dict[str, int]:
    """Quantities of what is wired by name: LEDs, resistors, switches, connector, metres of wire."""
    leds = len(context.prototype.leds)
    switched = sum(bool(outputs) for _, outputs in expected_lights(context))
    found = {"MOSFET": switched, context.export.spec.prototype.stage.led: leds}
    if leds and (lines := context.prototype.wiring) is not None:
        of_leds = np.char.startswith(lines.signal, "led_")
        for column in (lines.resistor, lines.connector, lines.wire):
            names = set(column[of_leds].tolist())
            found |= {str(name): 1 for name in names}
        found |= dict.fromkeys(map(str, set(lines.resistor[of_leds].tolist())), leds)
        metres = math.ceil(WIRES * float(lines.length_mm[of_leds].sum()) / 1000)
        found |= dict.fromkeys(map(str, set(lines.wire[of_leds].tolist())), metres)
    if (lines := context.prototype.wiring) is not None:
        cables = lines.length_mm[lines.wire == CABLE]
        found[CABLE] = math.ceil(float(cables.sum()) / 1000)
    return {name: count for name, count in found.items() if count}


def _phases(context: PrototypeContext) -> Iterator[str]:
    """The record's photographs of a stop."""
    record, motion = context.prototype.controller, context.export.spec.prototype.motion
    if (record.firmware, record.axis) != (motion.controller, motion.axis):
        yield f"the record's controller is {record.firmware} with axis {record.axis}"
    names = {0.0: "dark", LAMP: "lit"}
    expected = [
        (names.get(number, f"led_{number:.0f}"), min(outputs, default=None))
        for number, outputs in expected_lights(context)
    ]
    if [(phase.name, phase.output) for phase in record.phases] != expected:
        yield "the record has other phases"


def _lines(context: PrototypeContext) -> Iterator[str]:
    lines = require(context.prototype.wiring, f"there is no {WIRING}")
    motion, leds = context.export.spec.prototype.motion, len(context.prototype.leds)
    signals = ["lamp", *(f"led_{k}" for k in range(1, leds + 1))]
    released = ["release"] if motion.trigger == "coolant" else []
    expected = [*signals, *released, "home", "motor", "supply"]
    if lines.signal.tolist() != expected or lines.line.tolist() != [*range(1, len(expected) + 1)]:
        yield f"lines are {short_list(lines.signal.tolist())}, not {short_list(expected)}"
        return
    for output, signal in enumerate(signals):
        told = tuple(str(column[output]) for column in (lines.output, lines.on, lines.off))
        hand = motion.controller == "grbl"
        means = ("by hand", "", "") if hand else _commands(output)
        if told != means:
            yield f"{signal} is switched by {' '.join(told)}"
    yield from _lamp(context, lines)
    for k in range(leds):
        yield from (f"led_{k + 1}: {what}" for what in _led(context, lines, k))
    row = {signal: k for k, signal in enumerate(expected)}
    for k in (row[signal] for signal in ("lamp", *released, "home", "supply")):
        if lines.wire[k] != CABLE or not lines.length_mm[k] >= LEAST_CABLE_MM:
            yield f"{expected[k]} has {lines.length_mm[k]:g} mm of {lines.wire[k] or 'no cable'}"
    told = (str(lines.output[row["home"]]), str(lines.part[row["home"]]))
    if told != (f"limit {motion.axis}", "SWITCH-SS-5GL2"):
        yield f"the switch is {told[1]} on {told[0]}"
    for k in (row[signal] for signal in released):
        told = tuple(str(column[k]) for column in (lines.output, lines.on, lines.off, lines.part))
        if told != ("coolant", "M8", "M9", "RELAY"):
            yield f"the release is switched by {' '.join(told)}"
    yield from _motor(context, lines, row["motor"])
    yield from _supply(lines, row["supply"])


def _lamp(context: PrototypeContext, lines: Wiring) -> Iterator[str]:
    """The lamps' line has their part, voltage and current."""
    lamps, part = context.prototype.lamps, str(lines.part[0])
    if lamps is None:
        yield from () if part == "lamp" else [f"the lamp is {part}"]
        return
    watt = lamps.strips * len(lamps.places) * lamps.length * STRIPS_W_MM.get(lamps.strip, 0.0)
    current = watt / STRIP_V * 1e3
    if part != lamps.strip or float(lines.supply_v[0]) != STRIP_V:
        yield f"the lamps are {part} at {float(lines.supply_v[0]):g} V"
    if not math.isclose(float(lines.current_ma[0]), current, rel_tol=SHARE) or current > LAMPS_MA:
        yield f"the lamps take {current:.0f} mA, {LAMPS_MA:.0f} are allowed"


def _motor(context: PrototypeContext, lines: Wiring, k: int) -> Iterator[str]:
    """The motor is on the driver of its axis, with the current of its maker's sheet."""
    drive, axis = context.prototype.drive, context.export.spec.prototype.motion.axis
    told = (str(lines.part[k]), str(lines.output[k]))
    if told != (drive.motor, f"driver {axis}"):
        yield f"the motor is {told[0]} on {told[1]}"
    rated = PHASES.get(drive.motor, (math.nan,))[0] * 1e3
    if not np.isclose(lines.current_ma[k], rated, rtol=SHARE, equal_nan=True):
        yield f"the motor takes {float(lines.current_ma[k]):g} mA, not {rated:g}"


def _supply(lines: Wiring, k: int) -> Iterator[str]:
    """The supply is fused."""
    told = (str(lines.part[k]), str(lines.connector[k]), float(lines.supply_v[k]))
    if told != SUPPLY:
        yield f"the supply is {told[0]} by {told[1] or 'no fuse'} at {told[2]:g} V"


def _commands(output: int) -> tuple[str, str, str]:
    return f"digital {output}", f"M64 P{output}", f"M65 P{output}"


def _led(context: PrototypeContext, lines: Wiring, k: int) -> Iterator[str]:
    """What is wrong with the circuit of one LED, and with its cable."""
    stage, row = context.export.spec.prototype.stage, k + 1
    supply, forward = float(lines.supply_v[row]), float(lines.forward_v[row])
    if (supply, forward, lines.part[row]) != (stage.led_supply_v, FORWARD_V, stage.led):
        yield f"{lines.part[row]} of {forward:g} V at {supply:g} V"
    name = str(lines.resistor[row])
    ohm, current = float(lines.resistor_ohm[row]), float(lines.current_ma[row])
    found = re.fullmatch(r"R-([\d.]+)W-([\d.e+]+)", name)
    if not found or not math.isclose(float(found[2]), ohm):
        yield f"{name} is not of {ohm:g} ohm"
        return
    if not is_e24(ohm):
        yield f"{ohm:g} ohm is not in the series E24"
    if not math.isclose(current, (supply - forward) / ohm * 1e3, rel_tol=SHARE):
        yield f"its current is not {current:g} mA"
    if not stage.led_ma / STEP <= current <= min(stage.led_ma, MAX_MA) * (1 + SHARE):
        yield f"{current:g} mA, {stage.led_ma:g} are asked for, {MAX_MA:g} allowed"
    power = (current / 1e3) ** 2 * ohm
    if not math.isclose(float(lines.dissipation_w[row]), power, rel_tol=SHARE):
        yield f"its resistor dissipates {power:.3g} W"
    if float(found[1]) < DERATING * power:
        yield f"its resistor is rated for {found[1]} W and dissipates {power:.3g} W"
    if lines.pins[row] != f"{2 * row - 1} {2 * row}":
        yield f"its pins are {lines.pins[row]}"
    contacts = re.fullmatch(r"XH-(\d+)", str(lines.connector[row]))
    if not contacts or int(contacts[1]) < WIRES * len(context.prototype.leds):
        yield f"connector {lines.connector[row]} has too few contacts"
    position = context.prototype.leds[k].position
    floor = float(context.export.spec.prototype.frame.floor_mm)
    least = math.hypot(position[0], position[1]) + position[2] - floor + LEAST_LEAD_MM
    if not lines.length_mm[row] >= least:
        yield f"{lines.length_mm[row]:g} mm of wire do not reach the controller, {least:.0f} do"


def is_e24(ohm: float) -> bool:
    """Whether a resistance is a value of the series."""
    if not 1 <= ohm < math.inf:
        return False
    digits = ohm / 10.0 ** (math.floor(math.log10(ohm) + SHARE) - 1)
    return math.isclose(digits, round(digits), rel_tol=SHARE) and round(digits) in E24


def _bore(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    """All wires go through the crown's bore, and an LED's two through its groove."""
    lines, leds = context.prototype.wiring, len(context.prototype.leds)
    if lines is None or not leds:
        return
    crown = require(solids.get("stage_crown"), "the assembly has no stage_crown")
    bores = [
        face.radius
        for face in crown.faces
        if face.hollow
        and face.kind == "cylinder"
        and abs(face.axis @ UP) > 1 - AXIAL_MM
        and math.hypot(*face.point[:2]) < AXIAL_MM
    ]
    for name in sorted({str(name) for name in lines.wire[1 : 1 + leds]}):
        thick = WIRE_MM.get(name, math.inf)
        room = MAX_FILL * (2 * min(bores, default=0.0)) ** 2
        if WIRES * leds * thick**2 > room * (1 + SHARE):
            yield f"{WIRES * leds} wires {name} do not go through the crown's bore"
        if thick > GROOVE_MM or WIRES * thick > context.export.spec.prototype.stage.wire_mm:
            yield f"two wires {name} do not go through a groove"

"""What is wired to the controller, line by line, and the way of the LEDs' cable through the rig.

A light's circuit: supply, resistor, LED, switch module to ground. An LED's two wires go from its
pocket through the grooves of arm and crown, down the post, and out of the foot's channel, to a
connector; resistors and switch modules are beside the controller.
"""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from tbcad.cad.formats.checked_files import Row
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec, StageSpec
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.electronics.outputs import LAMP, Light, lights
from tbcad.prototype.electronics.resistors import SeriesResistor, series_resistor
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_part, of_kind
from tbcad.prototype.stage import crown
from tbcad.prototype.stage.layout import StageLayout

COLUMNS = (
    *("line", "signal", "part", "output", "on", "off", "connector", "pins", "supply_v"),
    *("forward_v", "resistor", "resistor_ohm", "current_ma", "dissipation_w", "wire"),
    *("length_mm", "path"),
)
MAX_FILL = 0.5  # of a bore's section by wires as squares, so that they can be pulled through
LEAD_MM = 1000.0  # from the foot of the stage to the controller
CHANNEL_MM = 45.0  # from the post's axis out of the foot's channel, with room for the connector
CUT_MM = 50.0  # wires are cut to multiples of this
METRE_MM = 1000.0
MA_PER_A = 1000.0
WIRES = 2  # of an LED
SWITCH_MODULE = "MOSFET"
PATH = "grooves of arm and crown, bore of crown and post, channel of the stage's foot, controller"
BOARD = "board"  # connector: terminals of the controller
CABLE, CABLE_MM = "CABLE-2x0.25", 1500.0  # to lamps, camera's release and switch
BETWEEN_LAMPS_MM = 500.0  # of cable from one lamp to the next
LAMP_PATH = "from lamp to lamp, all in parallel, then to the controller"
RELEASE: Row = {
    "wire": CABLE,
    "length_mm": CABLE_MM,
    "signal": "release",
    "part": "RELAY",
    "output": "coolant",
    "on": "M8",
    "off": "M9",
    "connector": BOARD,
    "path": "relay, camera's release",
}
HOME: Row = {
    "wire": CABLE,
    "length_mm": CABLE_MM,
    "signal": "home",
    "part": "SWITCH-SS-5GL2",
    "connector": BOARD,
    "path": "common and normally closed contact of the switch, input and ground",
}
MOTOR: Row = {
    "signal": "motor",
    "connector": BOARD,
    "pins": "A+ A- B+ B-",
    "path": "the motor's own wires; a few ohm are between the two of a coil",
}
FUSE, SUPPLY_V = "FUSE-2A", 24.0
SUPPLY: Row = {
    "wire": CABLE,
    "length_mm": CABLE_MM,
    "signal": "supply",
    "part": "SUPPLY-24V",
    "output": "supply",
    "connector": FUSE,
    "pins": "+ -",
    "supply_v": SUPPLY_V,
    "path": "plus by the fuse to controller, lamps and resistors; minus to controller and all "
    "switch modules: one ground",
}


@dataclass(frozen=True)
class Wiring:
    """The electronics of a stage."""

    lights: tuple[Light, ...]  # that the controller switches
    leds: int  # number of LEDs
    led: PurchasedPart  # the purchased part
    supply_v: float  # of lamp and LEDs
    resistor: SeriesResistor | None  # in series with each LED; None without LEDs
    connector: PurchasedPart | None  # of the LEDs' cable; None without LEDs
    wire: PurchasedPart | None  # of the LEDs; None without LEDs
    lengths: tuple[float, ...]  # of each LED's cable to the controller, mm
    trigger: bool  # whether a relay releases the camera
    axis: str  # of the controller

    @property
    def parts(self) -> Parts:
        """Parts that no list has by this name: the resistor of a value."""
        return {self.resistor.part.name: self.resistor.part} if self.resistor else {}

    def purchased(self, lamps: LampLayout | None) -> dict[str, int]:
        """Quantity of purchased parts by name; without LEDs; of wire, in metres."""
        counts = Counter({SWITCH_MODULE: len(self.lights)})
        if self.resistor and self.connector and self.wire:
            counts[self.resistor.part.name] += self.leds
            counts[self.connector.name] += 1
            counts[self.wire.name] += math.ceil(WIRES * sum(self.lengths) / METRE_MM)
        # Of supply, switch and release.
        cable = (2 + self.trigger) * CABLE_MM + lamp_cable_mm(lamps)
        counts[CABLE] += math.ceil(cable / METRE_MM)
        return dict(+counts)


def wiring_layout(spec: PrototypeSpec, stage: StageLayout, parts: Parts) -> Wiring:
    """The electronics of a stage.

    Raises:
        SpecError: when LEDs are too many, or not to be had with this current, supply or bore.
    """
    count, section = len(stage.leds), spec.stage
    resistor = connector = wire = None
    if count:
        resistor = series_resistor(stage.led, section.led_ma, section.led_supply_v, parts)
        hint = "use fewer LEDs in prototype.stage.leds_mm"
        key, pins = "prototype.stage.leds_mm", WIRES * count
        connector = choose_part(parts, "connectors", key, hint, "pins", pins=pins)
        wire = _wire(section, stage, resistor.current_ma, parts)
    return Wiring(
        lights=lights(count, spec.motion),
        leds=count,
        led=stage.led,
        supply_v=section.led_supply_v,
        resistor=resistor,
        connector=connector,
        wire=wire,
        lengths=_lengths(spec, stage),
        trigger=spec.motion.trigger == "coolant",
        axis=spec.motion.axis,
    )


def lamp_cable_mm(lamps: LampLayout | None) -> float:
    """Length of the cable to the lamps, mm."""
    return CABLE_MM + (BETWEEN_LAMPS_MM * (len(lamps.places) - 1) if lamps else 0.0)


def wiring_rows(wiring: Wiring, lamps: LampLayout | None, drive: Drive) -> list[Row]:
    """One row for each line of the controller: lights by output, release, switch, motor, supply."""
    outputs = {light.name: light.output for light in wiring.lights}
    rows = [_row(_lamp_cells(wiring, lamps), outputs)]
    for i in range(wiring.leds):
        name = f"led_{i + 1}"
        rows.append(_row({"signal": name, **_led_cells(wiring, i)}, outputs))
    if wiring.trigger:
        rows.append(RELEASE)
    rows.append(HOME | {"output": f"limit {wiring.axis}"})
    rows += [_motor_row(drive, wiring.axis), SUPPLY]
    empty: Row = dict.fromkeys(COLUMNS)
    return [{**empty, **row, "line": number} for number, row in enumerate(rows, 1)]


def _motor_row(drive: Drive, axis: str) -> Row:
    """The motor's line; a rotary stage's current is its maker's."""
    current = drive.rated_current * MA_PER_A or None
    return MOTOR | {"part": drive.motor.name, "output": f"driver {axis}", "current_ma": current}


def _row(cells: Row, outputs: dict[str, int]) -> Row:
    """A light's row, with what switches it; without an output it is switched by hand."""
    output = outputs.get(str(cells["signal"]))
    if output is None:
        return {"connector": BOARD, "output": "by hand", **cells}
    on, off = f"M64 P{output}", f"M65 P{output}"
    return {"connector": BOARD, "output": f"digital {output}", "on": on, "off": off, **cells}


def _lamp_cells(wiring: Wiring, lamps: LampLayout | None) -> Row:
    """The lamps' line; without lamps it is that of a lamp of the user's own."""
    cable: Row = {"signal": LAMP, "wire": CABLE, "length_mm": lamp_cable_mm(lamps)}
    if lamps is None:
        return {**cable, "part": "lamp", "supply_v": wiring.supply_v}
    return {
        **cable,
        "part": lamps.strip.name,
        "supply_v": lamps.strip["supply_v"],
        "current_ma": lamps.current_ma,
        "path": LAMP_PATH,
    }


def _led_cells(wiring: Wiring, index: int) -> Row:
    assert wiring.resistor
    assert wiring.connector
    assert wiring.wire
    first = WIRES * index + 1
    return {
        "part": wiring.led.name,
        "connector": wiring.connector.name,
        "pins": f"{first} {first + 1}",  # anode, cathode
        "supply_v": wiring.supply_v,
        "forward_v": wiring.led["forward_v"],
        "resistor": wiring.resistor.part.name,
        "resistor_ohm": wiring.resistor.ohm,
        "current_ma": wiring.resistor.current_ma,
        "dissipation_w": wiring.resistor.dissipation_w,
        "wire": wiring.wire.name,
        "length_mm": wiring.lengths[index],
        "path": PATH,
    }


def _wire(section: StageSpec, stage: StageLayout, current_ma: float, parts: Parts) -> PurchasedPart:
    """The thickest wire of which an LED's two go through a groove, and all through the bore."""
    wires, bore = WIRES * len(stage.leds), 2 * stage.sizes.wire
    groove = min(crown.ARM_GROOVE_MM, crown.GROOVE_MM, section.wire_mm / WIRES)
    thickest = min(groove, bore * math.sqrt(MAX_FILL / wires))
    fitting = [
        wire
        for wire in of_kind(parts, "wires")
        if wire["outer_mm"] <= thickest and wire["max_ma"] >= current_ma
    ]
    if not fitting:
        raise SpecError(
            f"{wires} wires of LEDs do not fit through the crown's bore of {bore:.1f} mm: use "
            "fewer LEDs in prototype.stage.leds_mm, or set it to []"
        )
    return max(fitting, key=lambda wire: wire["outer_mm"])


def _lengths(spec: PrototypeSpec, stage: StageLayout) -> tuple[float, ...]:
    """Length of each LED's cable: down to its groove, inward, down the post, to the controller."""
    leds = stage.leds
    down = leds[:, 2] - spec.frame.floor_mm
    inward: list[float] = norm(leds[:, :2]).tolist() if len(leds) else []
    total = np.array(inward) + down + CHANNEL_MM + LEAD_MM + crown.GROOVE_MM
    return tuple((CUT_MM * np.ceil(total / CUT_MM)).tolist())

"""The electronics: the controller's board and outputs, resistors of LEDs, and what is wired.

The board is the first in boards.csv that has an output for each light and one for the coolant
function, which releases the camera. A light's circuit: supply, resistor, LED, output to ground;
an output that bears less than the light's current switches a module that does. An LED's two wires
go from its pocket through the grooves of arm and crown, down the post, and out of the foot's
channel, to a connector; resistors (IEC 60063) and switch modules are beside the controller.

GRBL 1.1 has two outputs only, for spindle and coolant. grblHAL, FluidNC and LinuxCNC number digital
outputs from 0 and switch them by M64 P (on) and M65 P (off), at once when the line is read; a dwell
before makes the line wait until the base is at rest.
Sources: grblHAL core gcode.c and issue 633; LinuxCNC M-codes, M62 to M65.
"""

import math
import tomllib
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from tbcad.cad.formats.checked_files import Row
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec, PrototypeSpec, StageSpec
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.light.upper import SUPPLY_V as UPPER_SUPPLY_V
from tbcad.prototype.light.upper import UpperLamps
from tbcad.prototype.part import FrameLayout, Mounted, Part, Site
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_part, of_kind
from tbcad.prototype.resistors import SeriesResistor, series_resistor
from tbcad.prototype.stage import crown
from tbcad.prototype.stage.layout import StageLayout
from tbcad.records.prototype_drive import Phase
from tbcad.records.tables import WiringRow

LAMP_OUTPUT, LAMP = 0, "lamp"
UPPER_LAMPS = "upper_lamps"  # on the lamps' output
MAX_OUTPUTS = 8  # digital outputs of the boards in boards.csv, at most
COOLANT_OUTPUTS = 1  # that releases the camera
DARK, LIT = "dark", "lit"
DIGITAL, BY_MODULE = "digital", "by a switch module"
LETS_FALL = "The supply's switch, its plug and its fuse let it fall."
OWN_WIRES = ("motor", "supply")  # lines whose way is told instead of an output
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
ON_CABLE: Row = {"wire": CABLE, "length_mm": CABLE_MM, "connector": BOARD}
RELEASE: Row = ON_CABLE | {
    **{"signal": "release", "part": "RELAY", "output": "coolant", "on": "M8", "off": "M9"},
    "path": "the relay's coil to plus of the supply; its contact: the camera's release",
}
HOME: Row = ON_CABLE | {
    **{"signal": "home", "part": "SWITCH-ROLLER"},
    "path": "common and normally closed contact of the switch, input and ground",
}
MOTOR: Row = {
    "signal": "motor",
    "connector": BOARD,
    "pins": "A+ A- B+ B-",
    "path": "the motor's own wires; a few ohm are between the two of a coil",
}
BRAKE: Row = ON_CABLE | {
    **{"signal": "brake", "output": "supply", "supply_v": 24.0, "pins": "+ -"},
    "path": "to plus and minus behind the fuse; without voltage its spring holds the motor",
}
DRIVER = "DRIVER-2A"
FUSE, SUPPLY_V = "FUSE-2A", 24.0
SUPPLY: Row = ON_CABLE | {
    **{"signal": "supply", "part": "SUPPLY-24V", "output": "supply"},
    **{"connector": FUSE, "pins": "+ -", "supply_v": SUPPLY_V},
    "path": "plus by the fuse to controller, lamps and resistors; minus to controller and all "
    "switch modules: one ground",
}


def lights(leds: int, motion: MotionSpec) -> dict[str, int]:
    """Digital outputs of lamp and LEDs, rising; none with GRBL 1.1, which cannot switch them.

    SpecError when no controller has so many outputs.
    """
    if motion.controller == "grbl":
        return {}
    if leds >= MAX_OUTPUTS:
        raise SpecError(
            f"prototype.stage.leds_mm has {leds} LEDs, but a controller switches {MAX_OUTPUTS} "
            f"outputs, one of them for the lamp: use at most {MAX_OUTPUTS - 1} LEDs, or set "
            "prototype.motion.controller to grbl and switch them by hand"
        )
    return {LAMP: LAMP_OUTPUT} | {f"led_{i}": LAMP_OUTPUT + i for i in range(1, leds + 1)}


def phases(leds: int, motion: MotionSpec) -> tuple[Phase, ...]:
    """The photographs of a stop in order: dark, every LED alone, the object lit.

    Without outputs there is one, with the lamp on all the time.

    SpecError when no controller has so many outputs.
    """
    if not (switched := lights(leds, motion)):
        return (Phase(name=LIT, output=None),)
    lit = Phase(name=LIT, output=switched.pop(LAMP))
    alone = (Phase(name=name, output=output) for name, output in switched.items())
    return (Phase(name=DARK, output=None), *alone, lit)


@dataclass(frozen=True)
class LedCircuit:
    """The circuit of the LEDs, which are alike."""

    resistor: SeriesResistor  # of each
    connector: PurchasedPart  # of their cable
    wire: PurchasedPart  # of each


def led_circuit(spec: PrototypeSpec, stage: StageLayout, parts: Parts) -> LedCircuit | None:
    """The circuit of the LEDs of a stage; None without any.

    SpecError when they are too many, or not to be had with this current, supply or bore.
    """
    count, section, key = len(stage.leds), spec.stage, "prototype.stage.leds_mm"
    lights(count, spec.motion)
    if not count:
        return None
    resistor = series_resistor(stage.led, section.led_ma, section.led_supply_v, parts)
    hint = f"use fewer LEDs in {key}"
    connector = choose_part(parts, "connectors", key, hint, "pins", pins=WIRES * count)
    return LedCircuit(resistor, connector, _wire(section, stage, resistor.current_ma, parts))


@dataclass(frozen=True, kw_only=True)
class Wiring(Mounted):
    """The electronics."""

    # one for each line of the controller: lights by output, release, switch, motor, supply
    rows: tuple[Row, ...]
    circuit: LedCircuit | None  # of the LEDs, None without any
    board: PurchasedPart  # of the controller
    upper: SeriesResistor | None = None  # of the LEDs above the object, None without any

    @property
    def parts(self) -> Parts:
        """Parts that no list has by this name: the resistor of a value."""
        some = [one.part for one in (self.circuit and self.circuit.resistor, self.upper) if one]
        return {one.name: one for one in some}


def wiring_layout(site: Site, before: FrameLayout) -> Wiring:
    """The electronics; SpecError as of `led_circuit`."""
    spec, motion, leds = site.spec.prototype, site.spec.prototype.motion, site.stage.leds
    circuit, outputs = led_circuit(spec, site.stage, site.parts), lights(len(leds), motion)
    board = controller_board(outputs, site.parts)
    # Of each LED's cable down to its groove, inward, down the post, to the controller.
    length = norm(leds[:, :2]) + leds[:, 2] - spec.frame.floor_mm
    length = CUT_MM * np.ceil((length + CHANNEL_MM + LEAD_MM + crown.GROOVE_MM) / CUT_MM)
    upper = before.find(UpperLamps)
    rows = [_lamp_cells(before.find(LampLayout), spec.stage.led_supply_v)]
    rows += [_upper_cells(upper)] if upper else []
    listed = {board.name: 1}
    if circuit:
        rows += [_led_cells(site, circuit, i, one) for i, one in enumerate(length.tolist())]
        metres = math.ceil(WIRES * float(length.sum()) / METRE_MM)
        listed |= {circuit.resistor.part.name: len(leds), circuit.connector.name: 1}
        listed |= {circuit.wire.name: metres}
    switched = [cells for cells in rows if cells["signal"] != UPPER_LAMPS]  # that is the lamps'
    modules = sum(_needs_module(cells, board) for cells in switched) if outputs else 0
    rows = [_row(cells, outputs, board) for cells in rows]
    if motion.trigger == "coolant":
        rows, listed = [*rows, RELEASE], listed | {"RELAY": 1}
    motor: Row = {"part": site.drive.motor.name, "output": f"driver {motion.axis}"}
    # A rotary stage's current is its maker's.
    rated: Row = {"current_ma": site.drive.of_motor("rated_a") * MA_PER_A or None}
    brake = [BRAKE | {"part": site.drive.brake.name}] if site.drive.brake else []
    home = [HOME | {"output": f"limit {motion.axis}"}] if motion.homes else []
    rows += [*home, MOTOR | motor | rated, *brake, SUPPLY]
    on_cable = sum(float(row["length_mm"] or 0) for row in rows if row.get("wire") == CABLE)
    empty: Row = dict.fromkeys(WiringRow.columns())
    return Wiring(
        listed=listed | {SWITCH_MODULE: modules, CABLE: math.ceil(on_cable / METRE_MM)},
        rows=tuple({**empty, **row, "line": number} for number, row in enumerate(rows, 1)),
        circuit=circuit,
        board=board,
        upper=upper.circuit if upper else None,
    )


def controller_board(outputs: dict[str, int], parts: Parts) -> PurchasedPart:
    """The smallest board with these outputs and one for the coolant function.

    SpecError when none has so many.
    """
    needed = float(len(outputs) + COOLANT_OUTPUTS)
    hint = "use fewer LEDs in prototype.stage.leds_mm"
    return choose_part(parts, "boards", "prototype.motion", hint, "outputs", outputs=needed)


def _needs_module(cells: Row, board: PurchasedPart) -> bool:
    """Whether a light's current is more than the board's outputs bear, or is not known."""
    return not 0 < float(cells.get("current_ma") or 0) <= board["output_ma"]


def _row(cells: Row, outputs: dict[str, int], board: PurchasedPart) -> Row:
    """A light's row, with what switches it; without an output it is switched by hand."""
    signal = LAMP if cells["signal"] == UPPER_LAMPS else str(cells["signal"])
    output = outputs.get(signal)
    if output is None:
        return {"connector": BOARD, "output": "by hand", **cells}
    on, off = f"M64 P{output}", f"M65 P{output}"
    by = f" {BY_MODULE}" if _needs_module(cells, board) else ""
    named = f"{DIGITAL} {output}{by}"
    return {"connector": BOARD, "output": named, "on": on, "off": off, **cells}


def _lamp_cells(lamps: LampLayout | None, supply_v: float) -> Row:
    """The lamps' line; without lamps it is that of a lamp of the user's own."""
    cable: Row = {"signal": LAMP, "wire": CABLE, "length_mm": CABLE_MM}
    if lamps is None:
        return {**cable, "part": "lamp", "supply_v": supply_v}
    strip: Row = {"part": lamps.strip.name, "supply_v": lamps.strip["supply_v"]}
    length = CABLE_MM + BETWEEN_LAMPS_MM * (len(lamps.places) - 1)
    more: Row = {"length_mm": length, "current_ma": lamps.current_ma, "path": LAMP_PATH}
    return {**cable, **strip, **more}


def _upper_cells(upper: UpperLamps) -> Row:
    """The line of the LEDs above the object, in series, on the lamps' output."""
    circuit = upper.circuit
    return {
        **{"signal": UPPER_LAMPS, "part": upper.led.name, "wire": CABLE, "length_mm": CABLE_MM},
        **{"supply_v": UPPER_SUPPLY_V, "forward_v": 2 * upper.led["forward_v"]},
        **{"resistor": circuit.part.name, "resistor_ohm": circuit.ohm},
        **{"current_ma": circuit.current_ma, "dissipation_w": circuit.dissipation_w},
        "path": "both in series, down along the post, by the resistor; minus with the lamps'",
    }


def _led_cells(site: Site, circuit: LedCircuit, index: int, length: float) -> Row:
    resistor, first = circuit.resistor, WIRES * index + 1
    return {
        "signal": f"led_{index + 1}",
        "part": site.stage.led.name,
        "connector": circuit.connector.name,
        "pins": f"{first} {first + 1}",  # anode, cathode
        "supply_v": site.spec.prototype.stage.led_supply_v,
        "forward_v": site.stage.led["forward_v"],
        "resistor": resistor.part.name,
        "resistor_ohm": resistor.ohm,
        "current_ma": resistor.current_ma,
        "dissipation_w": resistor.dissipation_w,
        "wire": circuit.wire.name,
        "length_mm": length,
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


@planned("Wiring", loose=("boards", "electronics", "wires", "connectors", "resistors"))
def wiring_step(machine: AssembledMachine) -> Values:
    """Lines of the controller, one each; without lamps, where light comes from instead."""
    rows = machine.wiring
    switched = [{"row": row, "name": row.signal.replace("_", " ")} for row in rows if row.on]
    controller = machine.record.controller
    return {
        "board": machine.ref(controller.board),
        "driver": DRIVER in machine.bill.items and machine.ref(DRIVER),
        "terminals": _terminals(controller.board, controller.firmware),
        "lines": [{"line": _line(machine, row)} for row in rows],
        "no_lamps": not machine.record.lamps,
        "switched": switched,
    }


def _terminals(board: str, firmware: str) -> str:
    """Where a board has its outputs, as text; empty where that is not known."""
    text = files(__package__).joinpath("electronics.toml").read_text("utf-8")
    return str(tomllib.loads(text)["boards"].get(board, {}).get(firmware, ""))


def _line(machine: AssembledMachine, row: WiringRow) -> str:
    line, part = f"Line {row.line}, {row.signal.replace('_', ' ')}:", machine.ref(row.part)
    if row.signal in OWN_WIRES:
        rated = f", {row.current_ma:.0f} mA RMS" if row.current_ma else ""
        return f"{line} {part}{rated}; {row.path}."
    through = f" through {machine.ref(row.resistor)}" if row.resistor else ""
    pins = f", pins {row.pins.replace(' ', ' and ')} of {row.connector}" if row.pins else ""
    way = when(row.path and not row.resistor, f"; {row.path}")
    return f"{line} {part}{through}{pins}, at {row.output}{way}."


@planned("First photographs")
def first_step(machine: AssembledMachine) -> Values:
    """The program's first run."""
    phases = machine.record.controller.phases
    low, high = machine.record.swing_deg
    names = ", ".join(one.name.replace("_", " ") for one in phases)
    off = "Without supply the brake holds it." if machine.record.power_off.brake else LETS_FALL
    ends = {"low": low, "high": high, "without_supply": off}
    return {
        "count": len(phases),
        "names": names,
        **ends,
    }


WIRING = Part((wiring_step,), wiring_layout)
FIRST = Part((first_step,))

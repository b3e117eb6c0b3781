"""Files of the ring of LEDs: STEP, STL, 3MF, what to buy and print, and how it is wired."""

from collections.abc import Iterator
from pathlib import Path

from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import PrinterSpec, Spec
from tbcad.prototype.files import bom
from tbcad.prototype.files.record import part_record
from tbcad.prototype.files.write import write_part
from tbcad.prototype.printed import PrintedPart, placed_component
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, load_parts, load_prices
from tbcad.records.design import LampRecord, ShellLamps
from tbcad.records.tables import WiringRow
from tbcad.shell_lamps.ring import INSERT, SCREWS, SET_SCREW, SUPPLY_V, LampRing

LIST, WIRING = "lamp_list.csv", "lamp_wiring.csv"
RINGS = 2
WIRE, CABLE, WIRE_M, CABLE_M = "WIRE-28", "CABLE-2x0.25", 1, 2  # metres of a ring
ALWAYS = {"SUPPLY-24V": 1, "FUSE-2A": 1, "GLUE-EPOXY": 1}
WIRING_MM = 1000.0  # of a ring's cable to the supply
MESH_MM = 0.02


def printed_ring(ring: LampRing, printer: PrinterSpec) -> PrintedPart:
    """The ring as it is printed, face down.

    SpecError: it does not fit on the printer's bed; InvalidSolidError: the kernel fails.
    """
    component = ring.component()
    return PrintedPart(placed_component(component, printer, MESH_MM), "frame", component.what)


def write_ring(spec: Spec, ring: LampRing, part: PrintedPart, folder: Path) -> None:
    """Write the ring and its lists into a folder."""
    parts = load_parts()
    estimate = write_part(folder, part, spec)
    item = bom.PrintedItem(part.name, part.what, part.solid.volume, estimate)
    prices = load_prices(spec.prototype.prices)
    rows = bom.list_rows(
        ring_parts(ring, parts), [(item, RINGS)], spec.printer.density_g_cm3, prices
    )
    write_table(folder / LIST, bom.COLUMNS, rows)
    write_table(folder / WIRING, WiringRow.columns(), wiring_rows(ring))


def ring_parts(ring: LampRing, parts: Parts) -> Iterator[tuple[PurchasedPart, int]]:
    """What is bought for both rings, and how many of each."""
    counts = {ring.led.name: ring.number, SET_SCREW: SCREWS, INSERT: SCREWS}
    counts |= {WIRE: WIRE_M, CABLE: CABLE_M}
    yield from ((parts[name], RINGS * count) for name, count in counts.items())
    yield ring.resistor.part, RINGS
    yield from ((parts[name], count) for name, count in ALWAYS.items())


def wiring_rows(ring: LampRing) -> list[Row]:
    """The strings of LEDs of both rings, in parallel on one supply."""
    return [
        {
            **dict.fromkeys(WiringRow.columns()),
            "line": line,
            "signal": f"lamps of camera {camera}",
            "part": f"{ring.number} x {ring.led.name} in series",
            "output": "SUPPLY-24V by FUSE-2A",
            "supply_v": SUPPLY_V,
            "forward_v": round(ring.number * ring.led["forward_v"], 3),
            "resistor": ring.resistor.part.name,
            "resistor_ohm": ring.resistor.ohm,
            "current_ma": round(ring.resistor.current_ma, 3),
            "dissipation_w": round(ring.resistor.dissipation_w, 3),
            "wire": CABLE,
            "length_mm": WIRING_MM,
            "path": "plus by the resistor to the first LED, each minus to the next plus, the last "
            "to minus; wires lie between collar and rim, the cable leaves by the notch",
        }
        for line, camera in enumerate("ab", 1)
    ]


def ring_record(ring: LampRing, part: PrintedPart, design: MirrorDesign) -> ShellLamps:
    """What design.json says of the lamps."""
    places = [
        LampRecord(
            camera=array.camera_id,
            position_mm=(place + 0.0).tolist(),
            direction=(array.camera.forward + 0.0).tolist(),
        )
        for array in design.arrays
        for place in ring.places(array.camera)
    ]
    return ShellLamps(
        ring=part_record(part, RINGS),
        led=ring.led.name,
        emitter_mm=ring.led["emitter_mm"],
        candela=ring.candela,
        front_mm=ring.front,
        bore_mm=ring.bore,
        watt=RINGS * ring.watt,
        lux=ring.lux,
        places=tuple(places),
    )

"""All files of the prototype: parts, tables, plan, record and assembly."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.background import Submit, at_once
from tbcad.cad.assembly import mesh_groups
from tbcad.cad.brep import Solid
from tbcad.drafting.sheet import Sheet
from tbcad.formats.csv_table import Row, write_table
from tbcad.formats.dxf import write_dxf
from tbcad.formats.glb import write_glb
from tbcad.formats.step import write_step
from tbcad.formats.step_assembly import write_assembly
from tbcad.formats.stl import write_stl
from tbcad.formats.threemf import write_3mf
from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.arrangement import arrangements
from tbcad.prototype.assembly import assembly_groups
from tbcad.prototype.assembly_steps.machine import Machine
from tbcad.prototype.assembly_steps.steps import mounting_record
from tbcad.prototype.base.cap_limits import cap_limits
from tbcad.prototype.drawings.caps import cap_sheet
from tbcad.prototype.drawings.lamps import lamp_sheet
from tbcad.prototype.drawings.parts import Listed, listed, sheets
from tbcad.prototype.drive.loads import SELF_LOCKING, DriveLoads, base_torques
from tbcad.prototype.drive.power_off import PowerOff, power_off
from tbcad.prototype.drive.travel import stop_sequence
from tbcad.prototype.electronics import wiring
from tbcad.prototype.electronics.outputs import phases
from tbcad.prototype.fasteners.fastener import Fastener
from tbcad.prototype.files import balls_csv, bom_csv, gcode, klipper, plan_csv, settings
from tbcad.prototype.files.camera_place import camera_place_record
from tbcad.prototype.files.caps import cap_records
from tbcad.prototype.files.drive_record import drive_record
from tbcad.prototype.files.holding_record import holding_record
from tbcad.prototype.light.record import BLACK, BLACK_KINDS, BLACKENED, record_of_light
from tbcad.prototype.light.shroud import pattern
from tbcad.prototype.model import PrototypeModel
from tbcad.prototype.model_solids import build_prototype_model
from tbcad.prototype.printing.estimate import PrintEstimate, print_estimate
from tbcad.prototype.printing.parts import PrintedPart, part_mesh
from tbcad.prototype.purchased.prices import Prices, load_prices
from tbcad.prototype.stage.calibration import calibration_estimate
from tbcad.prototype.stage.layout import led_poses
from tbcad.spec.design import Spec
from tbcad.spec.prototype import MotionSpec
from tbcad.types import Progress

SCHEMA = "tbcad-prototype/2"
PAD_UM = 10.0  # largest error of a ball's centre, found from its pads
NAME, STEP, GLB = "prototype.json", "prototype.step", "prototype.glb"
BALLS_FILE = "balls.csv"


def export_prototype(
    design: MirrorDesign,
    folder: Path,
    progress: Progress = lambda _: None,
    submit: Submit = at_once,
) -> Spec:
    """Build the prototype and write all of its files into a folder.

    Args:
        design: the mirrors.
        folder: to write into.
        progress: called with each stage.
        submit: takes what can be done meanwhile.

    Returns:
        The design's spec with what was chosen for the prototype.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    prices = load_prices(design.spec.prototype.prices)
    built = build_prototype_model(arrangements(design), progress, submit)
    spec = built.spec
    progress("prototype: files")
    prints = [submit(_write_part, folder, part, spec) for part in built.printed]
    if shroud := built.shroud:
        for panel in shroud.panels:
            submit(write_dxf, folder / f"{panel.name}.dxf", pattern(panel, shroud.sheet))
    _write_tables(built, folder)
    for one in cap_limits(spec, built.base, built.layout):
        submit(cap_sheet(_title(spec), built.base, built.layout, one).write, folder)
    progress("prototype: assembly")
    groups = [group for group in assembly_groups(built) if group.bodies]
    submit(write_glb, folder / GLB, "prototype", mesh_groups(groups))
    write_assembly(folder / STEP, "prototype", groups)
    bill = _bill(built, [estimate.result() for estimate in prints], prices)
    write_table(folder / bom_csv.NAME, bom_csv.COLUMNS, bill)
    drawings = _drawings(built, listed(_title(spec), bill))
    for sheet in drawings:
        submit(sheet.write, folder)
    record = document(built, bill, drawings)
    record["assembly_steps"] = mounting_record(_machine(built, record))
    text = json.dumps(record, indent=1, allow_nan=False) + "\n"
    (folder / NAME).write_text(text, encoding="utf-8")
    return spec


def _machine(built: PrototypeModel, record: dict[str, Any]) -> Machine:
    """Its bodies and fasteners, as the steps of assembly take them."""
    caps = enumerate(built.layout.balls.cap.tolist(), 1)
    return Machine((), record, (), {ball: "" for ball, cap in caps if not cap}, built.parts)


def _drawings(built: PrototypeModel, bill: Listed) -> list[Sheet]:
    """Sheets of what is cut or drilled."""
    lamps = built.frame.lamps
    of_lamps = [lamp_sheet(lamps, bill)] if lamps else []
    return [*sheets(built.frame, built.base, built.drive, bill), *of_lamps]


def _title(spec: Spec) -> str:
    """The design in the title blocks of drawings."""
    return f"{spec.name}, n = {spec.optics.n}"


def _write_part(folder: Path, part: PrintedPart, spec: Spec) -> PrintEstimate:
    """STEP as assembled, STL and 3MF on the printer's bed; an estimate of its print."""
    names, mesh = _file_names(part), part_mesh(part)
    solid = Solid(part.name, part.solid.shape, ())
    write_step(folder / names["step"], solid, spec.step.pcurves, part.solid.properties)
    write_stl(folder / names["stl"], mesh)
    write_3mf(folder / names["3mf"], part.name, mesh)
    return print_estimate(mesh)


def _file_names(part: PrintedPart) -> dict[str, str]:
    return {kind: f"{part.name}.{kind}" for kind in ("step", "stl", "3mf")}


def document(built: PrototypeModel, bill: list[Row], drawings: list[Sheet]) -> dict[str, Any]:
    """prototype.json: what is known of the prototype, in numbers.

    Args:
        built: the prototype.
        bill: rows of the parts list.
        drawings: of what is cut or drilled.
    """
    layout, spec = built.layout, built.spec.prototype
    axis, zero, third = (layout.array.ellipsoid.frame() + 0.0).tolist()
    return {
        "schema": SCHEMA,
        "camera": layout.array.camera_id,
        "target_mm": built.spec.optics.capture_diameter_mm,
        "picture": spec.picture,
        "target_pad_um": PAD_UM,
        "frame": {"axis": axis, "zero": zero, "third": third},
        "swing_deg": _swing(built, spec.motion),
        "balls": BALLS_FILE,
        "alternatives": layout.alternatives,
        "seats": _seats(built),
        "holding": holding_record(built.spec, built.base, layout, built.parts),
        "parts": [_part_record(part) for part in built.printed],
        "leds": [
            {
                "name": name,
                "position_mm": (position + 0.0).tolist(),
                "direction": direction.tolist(),
            }
            for name, position, direction in led_poses(built.stage)
        ],
        "calibration": _calibration(built),
        "controller": _controller(built),
        "caps": cap_records(built),
        "camera_place": camera_place_record(built),
        "home": {
            "switch_deg": built.frame.homing.angles.switch,
            "homed_deg": built.frame.homing.angles.homed,
            "travel_deg": built.frame.homing.angles.travel,
            "pin": built.frame.homing.pin,
            "zero_error_deg": built.frame.homing.error_deg,
        },
        "bought": [
            {
                "name": item.name,
                "what": item.what,
                "part": item.part,
                "turns": item.rotates,
                "finish": BLACK if item.name in BLACKENED else None,
            }
            for item in built.frame.purchased
        ],
        **record_of_light(built.frame.lamps, built.shroud),
        "fasteners": [_fastener(one) for one in built.fasteners],
        "frame_stock": {
            "plate": built.frame.plate.name,
            "upright": built.frame.upright.name,
            "uprights_cut_to_mm": built.frame.length,
        },
        "totals": bom_csv.totals(bill),
        "drawings": [
            {"part": sheet.part, "pdf": f"{sheet.name}.pdf", "dxf": f"{sheet.name}.dxf"}
            for sheet in drawings
        ],
        "assembly": {"step": STEP, "glb": GLB},
        "drive": drive_record(built.balance, built.drive, spec.motion, layout.stops.range),
        "power_off": _power_off(built).record(),
    }


def _power_off(built: PrototypeModel) -> PowerOff:
    """The base without power, between the ends of its travel."""
    angles, drive = built.frame.homing.angles, built.drive
    low, high = np.radians([angles.switch, angles.switch + angles.travel]).tolist()
    return power_off(built.balance, low, high, holds_itself=drive.efficiency < SELF_LOCKING)


def _fastener(one: Fastener) -> dict[str, Any]:
    return {
        "name": one.name,
        "part": one.part.name,
        "position_mm": (one.place + 0.0).tolist(),
        "along": (one.along + 0.0).tolist(),
        "through": list(one.through),
        "turns": one.rotates,
        "finish": BLACK if one.part.kind in BLACK_KINDS else None,
    }


def _part_record(part: PrintedPart) -> dict[str, Any]:
    """Record of a part for prototype.json; y = x @ axes + origin is a point on the bed."""
    return {
        "name": part.name,
        "what": part.what,
        **_file_names(part),
        "role": part.role,
        "finish": "mirror" if part.role == "cap" else None if part.role == "tool" else BLACK,
        "ball": part.ball + 1 if part.ball >= 0 else None,
        "quantity": 1,
        "axes": (part.solid.axes + 0.0).tolist(),
        "origin_mm": (part.solid.origin + 0.0).tolist(),
    }


def _calibration(built: PrototypeModel) -> dict[str, float] | None:
    """What the LEDs will tell of the balls' centres; None without LEDs."""
    if not len(built.stage.leds):
        return None
    capture, stage = built.spec.optics.capture_diameter_mm / 2, built.spec.prototype.stage
    return calibration_estimate(stage, built.layout.array, built.stage.leds, capture).record()


def _controller(built: PrototypeModel) -> dict[str, Any]:
    """Firmware, and which digital output is on in each photograph of a stop."""
    motion = built.spec.prototype.motion
    return {
        "firmware": motion.controller,
        "axis": motion.axis,
        "phases": [
            {"name": phase.name, "output": phase.output}
            for phase in phases(len(built.stage.leds), motion)
        ],
    }


def _swing(built: PrototypeModel, motion: MotionSpec) -> list[float]:
    """Base angles that the program drives between: from the switch, or from the start."""
    todo = stop_sequence(built.layout, motion)
    angles = [todo.start, motion.home_deg, *todo.angle.tolist()]
    if motion.controller == "grblhal":
        angles.append(built.frame.homing.angles.switch)
    return [min(angles), max(angles)]


def _seats(built: PrototypeModel) -> list[dict[str, Any]]:
    """Record of each seat: its axis, away from the light, and its three pads."""
    seats = built.base.seats
    return [
        {
            "ball": k + 1,
            "axis": (seats.axis[k] + 0.0).tolist(),
            "normals": (seats.pad_normals[k] + 0.0).tolist(),
            "contacts_mm": (seats.contacts[k] + 0.0).tolist(),
            "pad_diameter_mm": 2 * float(seats.pad[k]),
        }
        for k in range(len(seats))
    ]


def _bill(built: PrototypeModel, estimates: list[PrintEstimate], prices: Prices) -> list[Row]:
    """Rows of the parts list; estimates are of the printed parts, in their order."""
    layout, density = built.layout, built.spec.printer.density_g_cm3
    printed = [
        bom_csv.cap_item(layout, part.ball, part.solid.volume, estimate)
        if part.role == "cap"
        else bom_csv.PrintedItem(part.name, part.what, part.solid.volume, estimate)
        for part, estimate in zip(built.printed, estimates, strict=True)
    ]
    return bom_csv.bom_rows(
        layout, built.drive, built.purchased, printed, density, built.parts, prices
    )


def _write_tables(built: PrototypeModel, folder: Path) -> None:
    layout, motion = built.layout, built.spec.prototype.motion
    loads = DriveLoads(built.drive, base_torques(built.balance, layout.stops.range, motion))
    for name, columns, rows in (
        (BALLS_FILE, balls_csv.COLUMNS, balls_csv.ball_rows(layout)),
        ("rotation_plan.csv", plan_csv.PICTURE_COLUMNS, plan_csv.picture_rows(layout)),
        ("stops.csv", plan_csv.STOP_COLUMNS, plan_csv.stop_rows(layout, built.balance, loads)),
        ("plate_holes.csv", plan_csv.HOLE_COLUMNS, plan_csv.hole_rows(built.frame)),
        (
            "wiring.csv",
            wiring.COLUMNS,
            wiring.wiring_rows(built.wiring, built.frame.lamps, built.drive),
        ),
    ):
        write_table(folder / name, columns, rows)
    program = gcode.gcode_program(layout, built.drive, motion, len(built.stage.leds))
    gcode.write_program(folder / "rotation_plan.nc", program)
    values = settings.settings(built.drive, motion, built.frame.homing.angles)
    title = f"settings of {built.spec.name} for {motion.controller}"
    settings.write_settings(folder / settings.NAME, settings.settings_lines(title, values))
    if motion.controller == "grblhal":
        angles, lights = built.frame.homing.angles, built.wiring.lights
        translated = klipper.klipper_program(program, motion, angles)
        gcode.write_program(folder / klipper.PROGRAM, [*translated])
        config = klipper.klipper_config(built.drive, motion, lights)
        gcode.write_program(folder / klipper.CONFIG, [*config])

"""All files of the prototype: parts, tables, plan, record and assembly."""

from pathlib import Path

from tbcad.cad.drafting.sheet import Sheet
from tbcad.cad.formats.assembly import mesh_groups, write_assembly, write_glb
from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.formats.dxf import write_dxf
from tbcad.cad.formats.mesh_files import write_3mf, write_stl
from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Solid
from tbcad.common.background import Submit, at_once
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import Spec
from tbcad.prototype.arrangement import PrototypeModel, arrangements
from tbcad.prototype.assembly import assembly_groups
from tbcad.prototype.assembly_steps.machine import Machine
from tbcad.prototype.assembly_steps.steps import mounting_record
from tbcad.prototype.base.caps import cap_limits
from tbcad.prototype.drawings.caps import cap_sheet
from tbcad.prototype.drawings.lamps import lamp_sheet
from tbcad.prototype.drawings.parts import Listed, listed, sheets
from tbcad.prototype.drive.loads import DriveLoads, base_torques
from tbcad.prototype.electronics import wiring
from tbcad.prototype.files import bom_csv, gcode, klipper, settings, tables
from tbcad.prototype.files.record import BALLS_FILE, GLB, STEP, prototype_record
from tbcad.prototype.light.shroud import pattern
from tbcad.prototype.model import build_prototype_model
from tbcad.prototype.printing.estimate import PrintEstimate, print_estimate
from tbcad.prototype.printing.placing import PrintedPart, part_mesh
from tbcad.prototype.purchased.prices import Prices, load_prices
from tbcad.records.prototype import NAME, Prototype
from tbcad.types import Progress


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
    record = prototype_record(built, bill, drawings)
    steps = mounting_record(_machine(built, record))
    record.model_copy(update={"assembly_steps": steps}).write(folder / NAME)
    return spec


def _machine(built: PrototypeModel, record: Prototype) -> Machine:
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
    mesh, solid = part_mesh(part), Solid(part.name, part.solid.shape, ())
    write_step(folder / f"{part.name}.step", solid, spec.step.pcurves, part.solid.properties)
    write_stl(folder / f"{part.name}.stl", mesh)
    write_3mf(folder / f"{part.name}.3mf", part.name, mesh)
    return print_estimate(mesh)


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
        (BALLS_FILE, tables.BALL_COLUMNS, tables.ball_rows(layout)),
        ("rotation_plan.csv", tables.PICTURE_COLUMNS, tables.picture_rows(layout)),
        ("stops.csv", tables.STOP_COLUMNS, tables.stop_rows(layout, built.balance, loads)),
        ("plate_holes.csv", tables.HOLE_COLUMNS, tables.hole_rows(built.frame)),
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

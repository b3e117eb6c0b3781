"""All files of the prototype: parts, tables, plan, record and assembly."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from tbcad_verify.run.processes import at_once

from tbcad.cad.formats.assembly import (
    ColouredSolid,
    SolidGroup,
    coloured_meshes,
    display_mesh,
    write_assembly,
)
from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.formats.dxf import write_dxf
from tbcad.cad.formats.glb import Colour, write_glb
from tbcad.cad.formats.mesh_files import write_3mf, write_stl
from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.solids import from_bytes, pyramid, sphere, to_bytes
from tbcad.common.reuse import kept
from tbcad.common.schedule import Submit
from tbcad.core.camera.sheet import write_camera_sheet
from tbcad.core.geometry.primitives import Component
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import Spec, without_sections
from tbcad.prototype.arrangement import PrototypeModel, arrangements
from tbcad.prototype.assembly_steps.book import write_book
from tbcad.prototype.assembly_steps.machine import AssembledMachine
from tbcad.prototype.assembly_steps.steps import mounting_record
from tbcad.prototype.base.caps import cap_item, cap_limits, cap_sheet
from tbcad.prototype.drive.drive import base_torques, drive_loads
from tbcad.prototype.electronics import Wiring
from tbcad.prototype.fasteners import Fastener, fastener_axes, fastener_component
from tbcad.prototype.files import bom, controllers, tables
from tbcad.prototype.files.record import BALLS_FILE, GLB, STEP, prototype_record
from tbcad.prototype.frame.stock import Stock
from tbcad.prototype.gravity.sag import write_sag
from tbcad.prototype.light.shroud import pattern
from tbcad.prototype.model import build_prototype_model
from tbcad.prototype.printed import PrintedPart, Role, component_solid, part_mesh
from tbcad.prototype.purchased.parts import Prices, load_prices
from tbcad.prototype.registry import PARTS
from tbcad.prototype.slicing import print_estimate
from tbcad.records.prototype import NAME
from tbcad.records.tables import WiringRow
from tbcad.types import Progress

METAL: Colour = (0.55, 0.56, 0.58, 1.0)
FASTENER: Colour = (0.25, 0.26, 0.28, 1.0)
STEEL: Colour = (0.78, 0.80, 0.83, 1.0)
SEEN: Colour = (0.30, 0.60, 0.95, 0.35)
CARD: Colour = (0.05, 0.05, 0.06, 0.12)
LIGHT: Colour = (1.00, 0.85, 0.30, 0.15)
COLOURS: dict[Role, Colour] = {
    "base": (0.36, 0.45, 0.58, 1.0),
    "cap": (0.85, 0.70, 0.40, 1.0),
    "stage": (0.30, 0.30, 0.32, 1.0),
    "frame": (0.85, 0.50, 0.30, 1.0),
    "tool": (0.85, 0.50, 0.30, 1.0),
}
WIRING_DECIMALS = 3


def export_prototype(
    design: MirrorDesign,
    folder: Path,
    progress: Progress = lambda _: None,
    submit: Submit = at_once,
) -> Spec:
    """Build the prototype and write all of its files into a folder.

    Returns the design's spec with what was chosen for the prototype.

    SpecError when something does not fit; it says what to change; InvalidSolidError when the kernel
    fails.
    """
    prices = load_prices(design.spec.prototype.prices)
    built = build_prototype_model(arrangements(design), progress, submit)
    spec = built.spec
    progress("prototype: files")
    own = without_sections(spec, "optics", "camera", "mirrors", "shell", "prototype")
    prints = [submit(write_part, folder, part, own) for part in built.printed]
    if shroud := built.shroud:
        for panel in shroud.panels:
            submit(write_dxf, folder / f"{panel.name}.dxf", pattern(panel, shroud.sheet))
    _write_tables(built, folder)
    title = f"{spec.name}, n = {spec.optics.n}"  # in the title blocks of drawings
    for one in cap_limits(spec, built.base, built.layout):
        submit(cap_sheet(title, built.base, built.layout, one).write, folder)
    progress("prototype: assembly")
    groups = [group for group in assembly_groups(built) if group.bodies]
    meshes = coloured_meshes(groups)
    submit(write_glb, folder / GLB, "prototype", meshes)
    if built.sag:
        submit(write_sag, folder, built.sag)
    _write_step(folder, groups)
    bill = _bill(built, [estimate.result() for estimate in prints], prices)
    write_table(folder / bom.NAME, bom.COLUMNS, bill)
    listed = bom.PartsList(tuple(bill), title)
    drawings = [sheet for part in PARTS for sheet in part.sheets(built, built.frame, listed)]
    for sheet in drawings:
        submit(sheet.write, folder)
    record = prototype_record(built, bill, drawings)
    caps = enumerate(built.layout.balls.cap.tolist(), 1)
    sizes = {ball: "" for ball, cap in caps if not cap}
    steps = mounting_record(AssembledMachine(listed, record, (), sizes, built.parts))
    record.model_copy(update={"assembly_steps": steps}).write(folder / NAME)
    tools = coloured_meshes([_printed("tools", built, ("tool",))])  # on the bed, of no assembly
    submit(write_book, folder, [*meshes, *tools], title, spec.printer)
    radius = spec.optics.capture_diameter_mm / 2
    write_camera_sheet(folder, design.arrays[0], radius, built.rig_light)
    return spec


@kept("assembly")
def _write_step(folder: Path, groups: Sequence[SolidGroup]) -> None:
    write_assembly(folder / STEP, "prototype", groups)


@kept("files of printed parts")
def write_part(folder: Path, part: PrintedPart, spec: Spec) -> tuple[float, float]:
    """STEP as assembled, STL and 3MF on the printer's bed; an estimate of its print."""
    mesh, solid = part_mesh(part), Solid(part.name, part.solid.shape, ())
    write_step(folder / f"{part.name}.step", solid, spec.step.pcurves, part.solid.properties)
    write_stl(folder / f"{part.name}.stl", mesh)
    write_3mf(folder / f"{part.name}.3mf", part.name, mesh)
    return print_estimate(mesh, spec.printer.infill, spec.printer.nozzle_mm)


def _bill(built: PrototypeModel, estimates: list[tuple[float, float]], prices: Prices) -> list[Row]:
    """Rows of the parts list; estimates are of the printed parts, in their order."""
    layout, density = built.layout, built.spec.printer.density_g_cm3
    printed = [
        cap_item(layout, part.ball, part.solid.volume, estimate)
        if part.role == "cap"
        else bom.PrintedItem(
            part.name, part.what, part.solid.volume, estimate, tool=part.role == "tool"
        )
        for part, estimate in zip(built.printed, estimates, strict=True)
    ]
    rows = bom.bom_rows(layout, built.drive, built.purchased, printed, density, built.parts, prices)
    return [*rows, *bom.tool_rows(len(rows) + 1, prices)]


def _rounded(row: Row) -> Row:
    """A line of the wiring with figures as they are read: to a thousandth."""
    return {
        key: round(value, WIRING_DECIMALS) if isinstance(value, float) else value
        for key, value in row.items()
    }


def _write_tables(built: PrototypeModel, folder: Path) -> None:
    layout, motion = built.layout, built.spec.prototype.motion
    wires = [_rounded(controllers.wired(row, motion)) for row in built.frame.of(Wiring).rows]
    loads = drive_loads(built.drive, base_torques(built.balance, layout.stops.range, motion))
    for name, columns, rows in (
        (BALLS_FILE, tables.BALL_COLUMNS, tables.ball_rows(layout)),
        ("rotation_plan.csv", tables.PICTURE_COLUMNS, tables.picture_rows(layout)),
        ("stops.csv", tables.STOP_COLUMNS, tables.stop_rows(layout, built.balance, loads)),
        ("plate_holes.csv", tables.HOLE_COLUMNS, tables.hole_rows(built.frame.of(Stock))),
        (WiringRow.FILE, WiringRow.columns(), wires),
    ):
        write_table(folder / name, columns, rows)
    texts = controllers.controller_files(
        layout, built.drive, motion, len(built.stage.leds), built.spec.name
    )
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="ascii", newline="\n")


def assembly_groups(prototype: PrototypeModel) -> tuple[SolidGroup, ...]:
    """All bodies of the assembled prototype, the base at angle zero.

    Coupons are tools and left out. What light passes through is included to be looked at, and
    transparent: the capture sphere, and what the camera sees.
    """
    layout, centre = prototype.layout, prototype.layout.seated_centres()
    balls = (
        ColouredSolid(f"ball_{k + 1}", sphere(centre[k], float(layout.balls.body_radius[k])), STEEL)
        for k in (~layout.balls.cap).nonzero()[0].tolist()
    )
    card = (  # without flaps; transparent, so that the rig is seen
        _body(panel.component, panel.name, CARD)
        for panel in (prototype.shroud.panels if prototype.shroud else ())
    )
    purchased = (_body(component, component.name, METAL) for component in prototype.frame.purchased)
    return (
        _printed("base", prototype, ("base", "cap")),
        SolidGroup("balls", tuple(balls)),
        _printed("stage", prototype, ("stage",)),
        _printed("frame", prototype, ("frame",)),
        SolidGroup("bought", tuple(purchased)),
        SolidGroup("shroud", tuple(card)),
        SolidGroup("fasteners", tuple(_fasteners(prototype.fasteners))),
        _views(prototype),
    )


def _body(component: Component, name: str, colour: Colour) -> ColouredSolid:
    data, mesh = _solid_and_mesh(component)
    return ColouredSolid(name, from_bytes(data), colour, mesh)


@kept("bodies of the assembly")
def _solid_and_mesh(component: Component) -> tuple[bytes, Mesh]:
    solid = component_solid(component)
    return to_bytes(solid), display_mesh(solid)


def _printed(name: str, prototype: PrototypeModel, roles: tuple[Role, ...]) -> SolidGroup:
    solids = (
        ColouredSolid(part.name, part.solid.shape, COLOURS[part.role], part.solid.mesh)
        for part in prototype.printed
        if part.role in roles
    )
    return SolidGroup(name, tuple(solids))


def _fasteners(fasteners: Sequence[Fastener]) -> Iterator[ColouredSolid]:
    """Those of one part are copies of one solid, which is built and meshed once."""
    originals: dict[str, ColouredSolid] = {}
    for one in fasteners:
        name = one.part.name
        if name not in originals:
            at_origin = replace(one, place=np.zeros(3), along=np.eye(3)[0])
            originals[name] = _body(fastener_component(at_origin), name, FASTENER)
        yield originals[name].copy(one.name, fastener_axes(one.along), one.place)


def _views(prototype: PrototypeModel) -> SolidGroup:
    """The capture sphere, and what the camera sees up to the sphere's far end."""
    camera = prototype.layout.array.camera
    radius = prototype.spec.optics.capture_diameter_mm / 2
    length = float(norm(camera.pinhole)) + radius
    width = length * np.tan(camera.hfov / 2)
    height = width * camera.height_px / camera.width_px
    middle, up = camera.pinhole + length * camera.forward, np.cross(camera.right, camera.forward)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = middle + signs @ np.stack([width * camera.right, height * up])
    solids = (
        ColouredSolid("capture_sphere", sphere(np.zeros(3), radius), SEEN),
        ColouredSolid("camera_view", pyramid(camera.pinhole, corners), LIGHT),
    )
    return SolidGroup("views", solids)

"""What is bought, drilled and printed, worked out again from the record and the solids.

Quantities of fasteners and magnets are those of the holes that they go into, counted in the STEP
files. What no geometry shows (mass and text of a catalogue part) is only compared within the list.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart
from tbcad_verify.prototype.wiring_checks import bought as wired
from tbcad_verify.record.prototype import PARTS_LIST, PLATE_HOLES
from tbcad_verify.record.prototype_tables import PartsList
from tbcad_verify.report.checks import Check, CheckName, at_most, require, short_list
from tbcad_verify.step.solids_text import TextSolid, distance_to_line, holes
from tbcad_verify.types import Floats

ELECTRONICS = ("FUSE-2A", "GLUE-EPOXY", "GRBL-BOARD", "RELAY", "SUPPLY-24V")
MATERIAL, CAP_MATERIAL = "PETG", "resin"
HOLE_MM = 1e-6  # of radii and places
TAPPED_M5_MM, CLEARANCE_M5_MM, M5_INSERT_MM = 4.2, 5.5, 6.4
TRAVEL_MM = 5.0 + HOLE_MM  # of a bracket's screw in its slot, to either side
UPRIGHT_SCREWS = 8  # of the head and of two feet, each with a nut in the slot
HOLDERS = "lamp_holder_"  # on the uprights, with a nut in the slot for each hole
LEAST_GRIP_MM = 4.0  # of a screw beyond the flange
MOTOR_SCREWS = 4
HUB_INSERTS = {"nema17-belt": 4, "nema17-direct": 4, "stage-60": 0}  # for wheel or coupling
HUB_SCREWS = 4  # of wheel, coupling or stage, through the zero disc
BRACKET_SCREWS = SWITCH_SCREWS = 2
KEY_HOLE_MM = 3.1  # of the dowel between hub and zero disc
LOCK_SCREWS = {"set-screws": 2, "clamp": 1}  # of a shaft, each with an insert
CUT = ", cut to "  # of what is bought longer
METRE_MM = 1e3
SHARE = 1e-9  # of figures that follow from others
ROUNDED_G, ROUNDED_MM3 = 0.005, 0.5  # of masses and volumes in the list
CHECKS = {"parts list": "faults", "plate holes": "faults"}


@dataclass(frozen=True)
class Solids:
    """Solids whose holes are counted.

    Attributes:
        base: of all pieces of the carrier.
        caps: of all caps.
        assembly: of the assembly, by name.
    """

    base: list[TextSolid]
    caps: list[TextSolid]
    assembly: Mapping[str, TextSolid]

    def count(self, radius: float, *, caps: bool = False) -> int:
        """Holes of a radius in the base, or in base and caps."""
        some = [*self.base, *(self.caps if caps else ())]
        return sum(len(holes(solid.faces, radius, HOLE_MM)) for solid in some)

    def in_assembly(self, name: str, radius: float) -> int:
        """Holes of a radius in a solid of the assembly; none where it is missing."""
        solid = self.assembly.get(name)
        return len(holes(solid.faces, radius, HOLE_MM)) if solid else 0


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    parts: list[MeasuredPart],
    solids: Solids,
) -> list[Check]:
    """The parts list and the plate's holes, against record and solids."""
    bill, drilled = names
    return [
        _faults_check(bill, _list_faults(context, parts, solids)),
        _faults_check(drilled, _plate_faults(context, solids.assembly)),
    ]


def _faults_check(name: CheckName, faults: Iterator[str]) -> Check:
    found = list(faults)
    return at_most(name, len(found), 0, short_list(found))


def _list_faults(
    context: PrototypeContext, parts: list[MeasuredPart], solids: Solids
) -> Iterator[str]:
    bill = require(context.prototype.parts_list, f"there is no {PARTS_LIST}")
    names = bill.part.tolist()
    quantity = dict(zip(names, bill.quantity.tolist(), strict=True))
    if len(quantity) != len(names):
        yield "a part is listed twice"
    if not (bill.item == np.arange(1, len(bill) + 1)).all():
        yield "items are not numbered from 1"
    exact = _bought(context)
    patterns = _fasteners(context, solids) | _magnets(context, solids)
    exact |= {part.name: 1 for part in context.prototype.parts if part.role != "cap"}
    for name, count in exact.items():
        if quantity.pop(name, 0) != count:
            yield f"{name}: {count} are needed"
    for pattern, count in patterns.items():
        some = [name for name in quantity if re.fullmatch(pattern, name)]
        if sum(quantity.pop(name) for name in some) != count:
            yield f"{pattern.partition('x')[0]}: {count} are needed"
    yield from (f"{name} is not needed" for name in quantity)
    yield from _row_faults(context, parts, bill)


def _bought(context: PrototypeContext) -> dict[str, int]:
    """Quantities of parts whose names are known: balls, caps, bodies, LEDs."""
    prototype = context.prototype
    balls = prototype.balls
    counts = Counter(f"ball {size}" for size in balls.size[~balls.cap].tolist())
    counts.update(f"cap {k}" for k in balls.number[balls.cap].tolist())
    counts.update(one.part for one in prototype.bought if one.part)
    if prototype.lamps:  # bodies are parts of it, which is bought by the metre
        lamps = prototype.lamps
        metres = len(lamps.places) * lamps.strips * lamps.length / METRE_MM
        counts[lamps.strip] = math.ceil(metres - SHARE)
    if prototype.shroud:
        counts[prototype.shroud.sheet] = prototype.shroud.sheets
    counts.update(ELECTRONICS)
    counts.update(wired(context))
    return dict(+counts)


def _magnets(context: PrototypeContext, solids: Solids) -> dict[str, int]:
    """Quantities of magnets by diameter: how high each is follows from what holds its ball."""
    base = context.export.spec.prototype.base
    if base.hold != "magnet":
        return {}
    heights = "|".join(
        re.escape(f"{one:g}") for one in (base.magnet_height_mm, base.strong_magnet_height_mm)
    )
    return {
        rf"MAGNET-{re.escape(f'{diameter:g}')}x({heights})": solids.count(
            (diameter + base.magnet_play_mm) / 2, caps=True
        )
        for diameter in base.magnets_mm
    }


def _fasteners(context: PrototypeContext, solids: Solids) -> dict[str, int]:
    """Quantities of parts whose lengths are chosen, by a pattern of their names."""
    prototype, spec = context.prototype, context.export.spec.prototype
    base, stage = spec.base, spec.base.drive == "stage-60"
    inserts = solids.count(base.insert_hole_mm / 2)
    lock = 0 if stage else LOCK_SCREWS[base.lock]
    set_screws = lock if base.lock == "set-screws" else 0
    # Every other insert is a joint's, with a screw of its own.
    in_base = inserts - HUB_INSERTS[base.drive] - set_screws
    in_plate = len(prototype.plate_holes) if prototype.plate_holes else 0
    tilting = solids.in_assembly("camera_plate", M5_INSERT_MM / 2)
    in_fence = solids.in_assembly("camera_fence", CLEARANCE_M5_MM / 2)
    in_holders = sum(
        solids.in_assembly(name, CLEARANCE_M5_MM / 2)
        for name in solids.assembly
        if name.startswith(HOLDERS)
    )
    found = {
        r"TNUT-M5-\d+": UPRIGHT_SCREWS + in_holders,
        r"M5x\d+": UPRIGHT_SCREWS + in_holders + in_plate + tilting + in_fence,
        r"NUT-M5": 2 * tilting + in_fence,
        r"WASHER-5": in_plate + 2 * tilting + in_fence,
        r"INSERT-M5": tilting,
        r"INSERT-M4": 1,
        r"M4x\d+": 1,
        r"INSERT-M3": inserts + solids.in_assembly("bearing_head", base.insert_hole_mm / 2),
        r"ROD-4x\d+": 1,
        r"M2x\d+": SWITCH_SCREWS,
        r"UNC1/4-20x[\d.]+": int(spec.camera_diameter_mm > 0),
        r"GT2-\d+-\d+": int(base.drive == "nema17-belt"),
        r"DOWEL-\S+": sum(
            solids.count(diameter / 2)
            for diameter in {round(base.dowel_mm + base.dowel_press_mm, 9), KEY_HOLE_MM}
        ),
        r"SET-M3x\d+": 1 + set_screws,
        r"M3x\d+": in_base + BRACKET_SCREWS + (0 if stage else MOTOR_SCREWS + HUB_SCREWS),
        r"M6x\d+": MOTOR_SCREWS + HUB_SCREWS if stage else 0,
    }
    return {pattern: quantity for pattern, quantity in found.items() if quantity}


def _row_faults(
    context: PrototypeContext, parts: list[MeasuredPart], bill: PartsList
) -> Iterator[str]:
    """What is wrong with the figures of a row."""
    density, flange = context.export.spec.printer.density_g_cm3, _flange(context)
    volumes, texts = _volumes(context, parts), _texts(context)
    rows = zip(
        bill.part.tolist(),
        bill.quantity.tolist(),
        bill.what.tolist(),
        bill.material.tolist(),
        bill.mass_g.tolist(),
        bill.total_mass_g.tolist(),
        bill.print_volume_mm3.tolist(),
        bill.origin.tolist(),
        strict=True,
    )
    for name, quantity, what, material, mass, total, volume, origin in rows:
        if not abs(total - quantity * mass) <= SHARE * total or not mass > 0:
            yield f"{name}: its mass"
        if name in texts and what != texts[name]:
            yield f"{name}: its description"
        if (origin == "printed") != (name in volumes):
            yield f"{name} is {origin}"
        elif name in volumes:
            expected, tolerance = volumes[name]
            if not abs(volume - expected) <= tolerance + ROUNDED_MM3:
                yield f"{name}: its volume"
            rounded = ROUNDED_G + ROUNDED_MM3 * density / 1000
            made_of = CAP_MATERIAL if name.startswith("cap ") else MATERIAL
            if material != made_of or not abs(mass - volume * density / 1000) <= rounded:
                yield f"{name}: its material or mass"
        elif not np.isnan(volume):
            yield f"{name}: its volume"
        elif name.startswith("M5x") and float(name[3:]) < flange + LEAST_GRIP_MM:
            yield f"{name} is too short"


def _flange(context: PrototypeContext) -> float:
    return context.export.spec.prototype.frame.flange_mm


def _volumes(
    context: PrototypeContext, parts: list[MeasuredPart]
) -> dict[str, tuple[float, float]]:
    """Volume of what is printed, and its tolerance, mm^3, by the name in the list."""
    found = {}
    for part in parts:
        mass = require(part.mass, part.reason)
        name = f"cap {part.part.number}" if part.part.role == "cap" else part.part.name
        found[name] = mass.volume, mass.area * context.export.mesh_error_mm
    return found


def cap_volume(context: PrototypeContext) -> Floats:
    """(K,) volume of each cap without its magnet's pocket, mm^3.

    A ball whose front is replaced from a half angle of 45 degrees on by the flatter sphere; where
    the front is not flatter, nothing is replaced. By revolution about the normal.
    """
    balls = context.prototype.balls
    body, front = balls.body_radius_mm, balls.radius_mm
    edge = np.minimum(np.where(body < front, body / np.sqrt(2), body), front)
    height = np.sqrt(body**2 - edge**2)  # from the body's centre, of where both spheres meet
    behind = np.pi * (2 * body**3 / 3 + body**2 * height - height**3 / 3)
    rise = front - np.sqrt(front**2 - edge**2)
    return np.asarray(behind + np.pi * rise * (3 * edge**2 + rise**2) / 6)


def _texts(context: PrototypeContext) -> dict[str, str]:
    """Descriptions that follow from the record."""
    prototype, balls = context.prototype, context.prototype.balls
    found = {part.name: part.what for part in prototype.parts if part.role != "cap"}
    found |= {one.part: one.what for one in prototype.bought if one.part and CUT not in one.what}
    for k, size in enumerate(balls.size.tolist()):
        front, body = balls.radius_mm[k], balls.diameter_mm[k]
        if balls.cap[k]:
            text = f"front of radius {front:.1f} mm on a ball of {body:.3f} mm, polished and coated"
            text += " as drawn"
            found[f"cap {k + 1}"] = text
        else:
            found[f"ball {size}"] = f"steel ball {size} {balls.standard[k]} {balls.grade[k]}"
    return found


def frame_axes(context: PrototypeContext) -> Floats:
    """(3, 3) rows: level under the base's axis, across it, up."""
    w = context.frame[0]
    level = np.array([w[0], w[1], 0.0]) / np.hypot(w[0], w[1])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([level, np.cross(up, level), up])


def _plate_faults(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    """The table against the tapped holes of the plate, and those against what they hold."""
    table = require(context.prototype.plate_holes, f"there is no {PLATE_HOLES}")
    axes = frame_axes(context)
    plate = require(solids.get("plate"), "the assembly has no plate")
    corners = plate.corners @ axes.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    drilled = holes(plate.faces, TAPPED_M5_MM / 2, HOLE_MM)
    places = np.array([hole.point @ axes.T for hole in drilled]).reshape(-1, 3)[:, :2] - low[:2]
    listed = np.column_stack([table.x_mm, table.y_mm])
    if len(listed) != len(places):
        yield f"{len(listed)} holes, the plate has {len(places)}"
    if not (table.hole == np.arange(1, len(table) + 1)).all():
        yield "holes are not numbered from 1"
    for hole in drilled:
        if abs(hole.depth - (high - low)[2]) > HOLE_MM:
            yield "a hole is not through the plate"
    for k, place in enumerate(listed):
        near = np.abs(places - place).max(axis=1) <= HOLE_MM
        if near.sum() != 1:
            yield f"hole {k + 1} is elsewhere in the plate"
        if table.thread[k] != "M5":
            yield f"hole {k + 1} has thread {table.thread[k]}"
        point = np.array([*(place + low[:2]), low[2]]) @ axes
        if not _holds(solids.get(str(table.holds[k])), point):
            yield f"hole {k + 1} is under no hole of {table.holds[k]}"
    yield from _stock_faults(context, (high - low).tolist(), solids)


def _holds(solid: TextSolid | None, point: Floats) -> bool:
    """Whether a bracket has a screw's hole, or a slot's end, above a place of the plate."""
    if solid is None:
        return False
    up = np.array([0.0, 0.0, 1.0])
    return any(
        abs(hole.axis @ up) > 1 - HOLE_MM and distance_to_line(point, hole.point, up) <= TRAVEL_MM
        for hole in holes(solid.faces, CLEARANCE_M5_MM / 2, HOLE_MM)
    )


def _stock_faults(
    context: PrototypeContext, size: list[float], solids: Mapping[str, TextSolid]
) -> Iterator[str]:
    """The plate's name tells its size, the uprights' name their length before they are cut."""
    stock = context.prototype.frame_stock
    bought = {one.name: one.part for one in context.prototype.bought}
    if stock.plate != bought.get("plate"):
        yield "frame_stock has another plate"
    if stock.plate != "PLATE-" + "x".join(f"{round(side, 6):g}" for side in size):
        yield f"{stock.plate} is not {size[0]:g} x {size[1]:g} x {size[2]:g} mm"
    for name in ("upright_left", "upright_right"):
        solid = require(solids.get(name), f"the assembly has no {name}")
        length = float(np.ptp(solid.corners[:, 2]))
        if abs(length - stock.uprights_cut_to_mm) > HOLE_MM or stock.upright != bought.get(name):
            yield f"{name} is {length:g} mm of {bought.get(name)}"
        if float(stock.upright.rpartition("-")[2]) < length:
            yield f"{stock.upright} is shorter than {length:g} mm"

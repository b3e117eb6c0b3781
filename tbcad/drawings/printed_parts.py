"""Sheets of printed parts: their frames, fasteners and notes from the export's record."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from tbcad.cad.drafting.sheet import Sheet, TitleBlock
from tbcad.cad.drafting.views import Shape
from tbcad.cad.formats.step import read_named_solid
from tbcad.cad.kernel.features import RoundFace, bounds, cylinders
from tbcad.cad.kernel.solids import moved
from tbcad.drawings.export import DrawnExport
from tbcad.drawings.part_sheet import part_sheets
from tbcad.drawings.tables import ListedSeat, Mate, mm, purchased_mate, reamed_to, seats_table
from tbcad.prototype.assembly_steps.machine import AssembledMachine
from tbcad.records.prototype import PrintedPartRecord, Prototype
from tbcad.records.tables import BallRow
from tbcad.tolerancing.process.process import load_process
from tbcad.types import Floats

RESIN, RESIN_PROCESS, FILAMENT_PROCESS = "resin", "sla", "fdm"
MAKERS_SHARE = 4.0  # standard deviations that a maker's tolerance is taken for: decision 0007
BASE = "base"
ON_AXIS = (BASE, "frame")  # roles of parts that shaft and bearings may go into
ON_TOP = ("washers", "nuts")  # kinds that are on screws: a hole is for the screw
ON_AXIS_MM, PARALLEL_COS = 1e-3, 1 - 1e-9
CORNER = "lowest corner on the left and in front"
AXIS, VERTICAL = "axis of rotation", "axis of the stage"


def draw_part(export: DrawnExport, part: PrintedPartRecord) -> list[Sheet]:
    """All sheets of a printed part, in a frame of its own.

    InputError: its file is missing or not as it was written; it is not in the parts list.
    """
    assert export.machine is not None
    record = export.machine.record
    frame = np.array([record.frame.zero, record.frame.third, record.frame.axis])
    if part.role == BASE:  # as the machine is seen along its axis
        axes, origin = frame.T, np.zeros(3)
    else:  # as it lies on the printer's bed: its main faces are across x, y and z
        axes, origin = np.array(part.axes), np.array(part.origin_mm)
    path = export.file(part.step)
    shape = moved(read_named_solid(path).shape, axes, origin)
    datum, what = part_datum(shape, origin, {AXIS: frame[2] @ axes, VERTICAL: axes[2]})
    shape = moved(shape, np.eye(3), -datum)

    def at(point: Sequence[float] | Floats) -> Floats:
        return np.asarray(np.array(point) @ axes + origin - datum)

    fasteners = [
        (one.part, at(one.position_mm), np.array(one.along) @ axes)
        for one in record.fasteners
        if part.name in one.through and export.machine.kind(one.part) not in ON_TOP
    ]
    mates = [
        *(purchased_mate(export.machine.listed(name), *place) for name, *place in fasteners),
        *_on_axis(export.machine, part, at(np.zeros(3)), frame[2] @ axes),
    ]
    seats = list(_seats(export, at, axes)) if part.role == BASE else []
    mates += _spigots(record, seats)
    row = export.row(part)
    block = TitleBlock(
        title=str(row["part"]).replace("_", " "),
        design=export.title,
        item=f"{row['item']}: {row['part']}",
        quantity=int(row["quantity"] or 0),
        material=str(row["material"]),
    )
    words = [*_notes(part, block.material, what), *export.source(part.step)]
    tables = (fasteners, [one for one in mates if one], [seats_table(shape, seats)])
    return part_sheets(part.name, shape, block, words, *tables)


def _on_axis(
    machine: AssembledMachine, part: PrintedPartRecord, place: Floats, along: Floats
) -> Iterator[Mate | None]:
    """Shaft and bearings, which are on the axis of rotation."""
    if part.role not in ON_AXIS:
        return
    reamed = reamed_to(part.what)
    for name in sorted({one.part for one in machine.record.bought if one.part}):
        found = machine.listed(name)
        if found and found.kind in ("shafts", "bearings"):
            yield purchased_mate(found, place, along, reamed)


def _seats(
    export: DrawnExport, at: Callable[[Sequence[float] | Floats], Floats], axes: Floats
) -> Iterator[ListedSeat]:
    """All seats, by the balls' list and the record."""
    assert export.machine is not None
    export.file(BallRow.FILE)
    balls = {ball.number: ball for ball in BallRow.read(export.folder)}
    for one in export.machine.record.seats:
        row = balls[one.ball]
        takes = f"cap {one.ball}" if row.kind == "cap" else f"ball {row.size}"
        contacts = np.stack([at(contact) for contact in one.contacts_mm])
        yield ListedSeat(
            one.ball,
            takes,
            row.body_radius_mm,
            at((row.bx, row.by, row.bz)),
            np.array(one.axis) @ axes,
            contacts,
            one.pad_diameter_mm,
        )


def _spigots(record: Prototype, seats: Sequence[ListedSeat]) -> Iterator[Mate]:
    """Spigots of caps in the pockets of their seats, along the seats' axes."""
    caps = {cap.ball: cap for cap in record.caps}
    for seat in seats:
        if cap := caps.get(seat.number):
            words = f"spigot of cap {seat.number}"
            yield Mate(words, seat.centre, seat.axis, cap.spigot_mm, cap.socket_mm)


def _notes(part: PrintedPartRecord, material: str, origin: str) -> Iterator[str]:
    yield f"{part.what[:1].upper()}{part.what[1:]}."
    yield f"Origin of x, y, z: {origin}."
    process = load_process(RESIN_PROCESS if material == RESIN else FILAMENT_PROCESS)
    expected = MAKERS_SHARE * process.sphere_centre_um.magnitude / 1000
    yield f"Expected as printed ({process.name}): ±{mm(expected)} mm on short lengths."
    finish = f"Finish: {part.finish}. " if part.finish else ""
    yield f"{finish}Deburr; remove supports."


def part_datum(shape: Shape, point: Floats, directions: Mapping[str, Floats]) -> tuple[Floats, str]:
    """A drawing's origin: on an axis through a point that the part has a cylinder on.

    Directions by what they are of, which the origin is told by.
    """
    low = bounds(shape)[0]
    walls = cylinders(shape)
    for name, along in directions.items():
        if abs(along[2]) > PARALLEL_COS and any(_is_on(one, point, along) for one in walls):
            return np.array([point[0], point[1], low[2]]), f"{name}, lowest face"
    return low, CORNER


def _is_on(wall: RoundFace, point: Floats, along: Floats) -> bool:
    """Whether a cylinder's axis is a line."""
    off = np.cross(wall.start - point, along)
    return bool(abs(wall.axis @ along) > PARALLEL_COS and np.linalg.norm(off) < ON_AXIS_MM)

"""Sheets of printed parts: their frames, fasteners and notes from the export's record."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tbcad.cad.drafting.sheet import Sheet, TitleBlock
from tbcad.cad.formats.step import read_named_solid
from tbcad.cad.kernel.features import RoundFace, bounds, cylinders
from tbcad.cad.kernel.projection import Shape
from tbcad.cad.kernel.solids import moved
from tbcad.drawings.export import DrawnExport
from tbcad.drawings.fits import ListedSeat, Mate, purchased_mate, reamed_to, seats_table
from tbcad.drawings.holes import Fastener, mm
from tbcad.drawings.part_sheet import PartText, part_sheets
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
AXES = {"axis": "axis of rotation, lowest face", "vertical": "axis of the stage, lowest face"}


@dataclass(frozen=True)
class PartJob:
    """All that the sheets of a printed part follow from, to be sent to another process."""

    path: Path  # STEP file
    text: PartText  # of the sheets; the note on the origin is added
    axes: Floats  # what x, y and z become in the drawing, as rows, (3, 3)
    origin: Floats  # what the machine's origin becomes, (3,)
    # what may be the datum: its name, a point and a direction, in the drawing's frame
    lines: tuple[tuple[str, Floats, Floats], ...]
    fasteners: tuple[Fastener, ...]  # that go into it, in the drawing's frame
    mates: tuple[Mate, ...] = ()  # what fits into its holes, likewise
    seats: tuple[ListedSeat, ...] = ()  # that may be on it, likewise


def part_job(export: DrawnExport, part: PrintedPartRecord) -> PartJob:
    """What is needed to draw a printed part.

    InputError: its file is missing or not as it was written; it is not in the parts list.
    """
    assert export.machine is not None
    record, path = export.machine.record, export.file(part.step)
    frame = np.array([record.frame.zero, record.frame.third, record.frame.axis])
    if part.role == BASE:  # as the machine is seen along its axis
        axes, origin = frame.T, np.zeros(3)
    else:  # as it lies on the printer's bed: its main faces are across x, y and z
        axes, origin = np.array(part.axes), np.array(part.origin_mm)
    fasteners = tuple(
        (one.part, np.array(one.position_mm) @ axes + origin, np.array(one.along) @ axes)
        for one in record.fasteners
        if part.name in one.through and export.machine.kind(one.part) not in ON_TOP
    )
    directions = {"axis": frame[2], "vertical": np.array([0.0, 0.0, 1.0])}
    lines = tuple((name, origin, one @ axes) for name, one in directions.items())
    mates = [
        *(purchased_mate(export.machine.listed(name), *at) for name, *at in fasteners),
        *_on_axis(export.machine, part, origin, frame[2] @ axes),
    ]
    seats = list(_seats(export, axes, origin)) if part.role == BASE else []
    mates += _spigots(record, seats)
    return PartJob(
        path,
        _text(export, part),
        axes,
        origin,
        lines,
        fasteners,
        tuple(one for one in mates if one),
        tuple(seats),
    )


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


def _seats(export: DrawnExport, axes: Floats, origin: Floats) -> Iterator[ListedSeat]:
    """All seats, by the balls' list and the record."""
    assert export.machine is not None
    export.file(BallRow.FILE)
    balls = {ball.number: ball for ball in BallRow.read(export.folder)}
    for one in export.machine.record.seats:
        row = balls[one.ball]
        takes = f"cap {one.ball}" if row.kind == "cap" else f"ball {row.size}"
        centre = np.array([row.bx, row.by, row.bz]) @ axes + origin
        contacts = np.array(one.contacts_mm) @ axes + origin
        radius, pad = row.body_radius_mm, one.pad_diameter_mm
        axis = np.array(one.axis) @ axes
        yield ListedSeat(one.ball, takes, radius, centre, axis, contacts, pad)


def _spigots(record: Prototype, seats: Sequence[ListedSeat]) -> Iterator[Mate]:
    """Spigots of caps in the pockets of their seats, along the seats' axes."""
    for cap in record.caps:
        for seat in seats:
            if seat.number == cap.ball:
                yield Mate(
                    f"spigot of cap {seat.number}",
                    seat.centre,
                    seat.axis,
                    cap.spigot_mm,
                    cap.socket_mm,
                )


def _text(export: DrawnExport, part: PrintedPartRecord) -> PartText:
    row, name = export.row(part), part.name
    words = str(row["part"]).replace("_", " ")
    block = TitleBlock(
        title=words,
        design=export.title,
        item=f"{row['item']}: {row['part']}",
        quantity=int(row["quantity"] or 0),
        material=str(row["material"]),
    )
    return PartText(name, block, tuple(_notes(export, part, block.material)))


def _notes(export: DrawnExport, part: PrintedPartRecord, material: str) -> Iterator[str]:
    yield f"{part.what[:1].upper()}{part.what[1:]}."
    process = load_process(RESIN_PROCESS if material == RESIN else FILAMENT_PROCESS)
    expected = MAKERS_SHARE * process.sphere_centre_um.magnitude / 1000
    yield f"Expected as printed ({process.name}): ±{mm(expected)} mm on short lengths."
    finish = f"Finish: {part.finish}. " if part.finish else ""
    yield f"{finish}Deburr; remove supports."
    yield f"Shape and what has no size here: {part.step},"
    yield f"sha256 {export.digest(part.step)}..."


def draw_part(job: PartJob) -> list[Sheet]:
    """All sheets of a printed part."""
    shape = moved(read_named_solid(job.path).shape, job.axes, job.origin)
    datum, what = _datum(shape, job)
    shape = moved(shape, np.eye(3), -datum)
    fasteners = [(part, place - datum, along) for part, place, along in job.fasteners]
    first, *others = job.text.notes
    lines = (first, f"Origin of x, y, z: {what}.", *others)
    text = PartText(job.text.name, job.text.block, lines)
    mates = [replace(one, place=one.place - datum) for one in job.mates]
    seats = [
        replace(one, centre=one.centre - datum, contacts=one.contacts - datum) for one in job.seats
    ]
    return part_sheets(shape, fasteners, text, mates, [seats_table(shape, seats)])


def _datum(shape: Shape, job: PartJob) -> tuple[Floats, str]:
    """The drawing's origin: on an axis of the machine that the part has a cylinder on."""
    low = bounds(shape)[0]
    walls = cylinders(shape)
    for name, point, along in job.lines:
        if abs(along[2]) > PARALLEL_COS and any(_is_on(one, point, along) for one in walls):
            return np.array([point[0], point[1], low[2]]), AXES[name]
    return low, CORNER


def _is_on(wall: RoundFace, point: Floats, along: Floats) -> bool:
    """Whether a cylinder's axis is a line."""
    off = np.cross(wall.start - point, along)
    return bool(abs(wall.axis @ along) > PARALLEL_COS and np.linalg.norm(off) < ON_AXIS_MM)

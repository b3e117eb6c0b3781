"""Sheets of printed parts: three views, a picture, levels, table of holes, fasteners, notes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from tbcad.cad.drafting.dimensions import (
    across,
    centre_cross,
    labels,
    ruler_across,
    ruler_upward,
    upward,
)
from tbcad.cad.drafting.sheet import (
    A3,
    A4,
    BESIDE_MM,
    TABLE_ROW_MM,
    Sheet,
    TitleBlock,
    choose_scale,
    drawing_room,
)
from tbcad.cad.drafting.views import ABOVE, FRONT, LEFT, Shape, View, isometric, project, straight
from tbcad.cad.formats.entities import Circle, Entity, Layer, Point, Text
from tbcad.cad.formats.pdf import text_width
from tbcad.cad.formats.step import read_named_solid
from tbcad.cad.kernel.features import RoundFace, bounds, cylinders, plane_levels
from tbcad.cad.kernel.solids import moved
from tbcad.drawings.export import DrawnExport
from tbcad.drawings.tables import (
    HEAD,
    VIEWS,
    WIDTHS_MM,
    DrawnHole,
    Fastener,
    ListedSeat,
    Mate,
    SheetTable,
    drawn,
    fits_table,
    in_columns,
    mm,
    numbered_holes,
    purchased_mate,
    reamed_to,
    seats_table,
    table_rows,
)
from tbcad.prototype.assembly_steps.machine import AssembledMachine
from tbcad.records.prototype import PrintedPartRecord, Prototype
from tbcad.records.tables import BallRow
from tbcad.tolerancing.process.process import load_process
from tbcad.types import Floats

BEFORE_MM, BEHIND_MM = 30.0, 16.0  # room for levels left and below; for lengths above and right
BETWEEN_MM = 18.0  # from view to view
LENGTH_MM, LEVELS_MM = 9.0, 8.0  # of dimension lines, and of the levels' texts, from a view
NAME_MM, NAME_OFF_MM = 2.5, 4.5  # height of a view's name and its place below
# ISO 5455, with 1:2.5 of its extended list.
SCALES = (5.0, 2.0, 1.0, 0.5, 0.4, 0.2, 0.1)
MOST_HIDDEN = 300  # edges of a view; more hide what they are to show, and are left out
LEVELS = 12  # at most along each axis, those of the largest faces
PICTURE_MM, PICTURE_SHARE = 25.0, 0.9  # least room of the picture, and its share of it
NAMES = {"A": "A, from the front", "B": "B, from above", "C": "C, from the left"}
SAME_MM = 0.01


@dataclass(frozen=True)
class _Frame:
    """Where the views are on paper."""

    paper: Point
    scale: float
    views: dict[str, View]
    box: Floats
    right: float


def part_sheets(
    name: str,
    shape: Shape,
    block: TitleBlock,
    words: Sequence[str],
    fasteners: Sequence[Fastener],
    mates: Sequence[Mate] = (),
    others: Sequence[SheetTable] = (),
) -> list[Sheet]:
    """All sheets of a part: views and what fits of the tables, then the rest of the tables.

    Args:
        name: of the part and its files.
        shape: in the drawing's frame, x to the right and z up in view A, its origin the datum.
        block: title block, its sheet open.
        words: lines of notes.
        fasteners: that go into it, in the same frame.
        mates: what fits into its holes, in the same frame.
        others: tables besides those of holes and fits.
    """
    box, found = bounds(shape), cylinders(shape)
    holes = numbered_holes(found, fasteners)
    rows = tuple(row for number, hole in holes for row in table_rows(number, hole))
    tables = [SheetTable(HEAD, WIDTHS_MM, rows), fits_table(holes, mates), *others]
    frame = _frame(box, sum(len(one.rows) for one in tables))
    first, *columns = in_columns(tables, _rows(frame.paper), _rows(A4))
    pages = [columns[k : k + 2] for k in range(0, len(columns), 2)]
    lengths = [*_overall(frame, found)]
    _, _, right, high = drawing_room(frame.paper)
    entities = [
        *(one for letter in VIEWS for one in _view(shape, frame, letter, holes, straight(lengths))),
        *_picture(shape, frame),
        *_levels(shape, frame),
        *lengths,
        *drawn((right - sum(WIDTHS_MM), high), first),
    ]
    origin = frame.views["A"].origin
    count = 1 + len(pages)
    of = replace(block, sheet=f"1 of {count}")
    sheets = [Sheet.framed((name, name), of, frame.paper, frame.scale, origin, entities, words)]
    left, _, _, high = drawing_room(A4)
    places = [(left + BESIDE_MM + k * (sum(WIDTHS_MM) + BESIDE_MM), high) for k in range(2)]
    for number, page in enumerate(pages, start=2):  # what is left of the tables
        rest = chain.from_iterable(map(drawn, places, page))
        of = replace(block, sheet=f"{number} of {count}")
        sheets.append(Sheet.framed((f"{name}_{number}", name), of, A4, None, (0.0, 0.0), rest))
    return sheets


def _frame(box: Floats, rows: int) -> _Frame:
    """Paper, scale and places: the smaller paper where it takes as large a scale, or full size."""
    small, large = _scale(A4, box, rows), _scale(A3, box, rows)
    paper, scale = (A4, small) if small >= min(large, 1.0) else (A3, large)
    left, low, right, high = _room(paper, rows)
    width, depth, height = (scale * (box[1] - box[0])).tolist()
    spare_x = right - left - width - depth - BEFORE_MM - BETWEEN_MM - BEHIND_MM
    spare_y = high - low - height - depth - BEFORE_MM - BETWEEN_MM - BEHIND_MM
    x, y = left + BEFORE_MM + max(spare_x, 0.0) / 3, low + BEFORE_MM + max(spare_y, 0.0) / 2
    y_front, x_left = y + depth + BETWEEN_MM, x + width + BETWEEN_MM
    lo, hi = (scale * box).tolist()
    views = {
        "A": View(FRONT, (x - lo[0], y_front - lo[2]), scale),
        "B": View(ABOVE, (x - lo[0], y - lo[1]), scale),
        "C": View(LEFT, (x_left + hi[1], y_front - lo[2]), scale),
    }
    return _Frame(paper, scale, views, box, right)


def _scale(paper: Point, box: Floats, rows: int) -> float:
    left, low, right, high = _room(paper, rows)
    width, depth, height = (box[1] - box[0]).tolist()
    taken = BEFORE_MM + BETWEEN_MM + BEHIND_MM
    size, room = (width + depth, height + depth), (right - left - taken, high - low - taken)
    return choose_scale(size, room, SCALES)


def _room(paper: Point, rows: int) -> tuple[float, float, float, float]:
    """Room of the views: what border, title block and table leave."""
    left, low, right, high = drawing_room(paper)
    return left, low, right - (sum(WIDTHS_MM) + BESIDE_MM if rows else 0.0), high


def _view(
    shape: Shape,
    frame: _Frame,
    letter: str,
    holes: Sequence[tuple[str, DrawnHole]],
    lines: Sequence[tuple[Point, Point]],
) -> Iterator[Entity]:
    """A view with its name and the numbers of its holes, which keep off lines."""
    view = frame.views[letter]
    edges = project(shape, view.axes)
    crowded = len(edges.hidden) > MOST_HIDDEN
    drawn = view.drawn(replace(edges, hidden=()) if crowded else edges)
    (left, low), (_, high) = _outline(frame, letter)
    level = high + NAME_OFF_MM - NAME_MM if letter == "B" else low - NAME_OFF_MM
    words = f"{NAMES[letter]}, without hidden edges" if crowded else NAMES[letter]
    name = Text(Layer.DIMENSIONS, (left, level), NAME_MM, words)
    end = left + text_width(name.text, NAME_MM)
    shown = [(number, hole) for number, hole in holes if hole.view == letter]
    circles = [
        Circle(Layer.CUT, view.at(hole.mouth), hole.cylinder.radius * frame.scale)
        for _, hole in shown
    ]
    yield from (*drawn, name)
    for circle, (_, hole) in zip(circles, shown, strict=True):
        if not hole.is_tilted:
            yield from centre_cross(circle)
    numbers, taken = [number for number, _ in shown], [(left, level, end, level + NAME_MM)]
    yield from labels(circles, numbers, [*straight(drawn), *lines], taken)


def _outline(frame: _Frame, letter: str) -> tuple[Point, Point]:
    """Lower left and upper right corner of a view on paper."""
    one, other = (np.array(frame.views[letter].at(corner)) for corner in frame.box)
    low, high = np.minimum(one, other).tolist(), np.maximum(one, other).tolist()
    return (low[0], low[1]), (high[0], high[1])


def _picture(shape: Shape, frame: _Frame) -> Iterator[Entity]:
    """An isometric view where the views leave room, without hidden edges."""
    _, (left, _) = _outline(frame, "B")
    (_, top), _ = _outline(frame, "C")
    left, low = left + BETWEEN_MM, drawing_room(frame.paper)[1] + 2 * BESIDE_MM
    right, top = frame.right - BESIDE_MM, top - 2 * NAME_OFF_MM
    if min(right - left, top - low) < PICTURE_MM:
        return
    axes = isometric()
    corners = np.stack(np.meshgrid(*frame.box.T), -1).reshape(-1, 3)
    flat = corners @ axes[:2].T
    size, middle = np.ptp(flat, axis=0), (flat.min(axis=0) + flat.max(axis=0)) / 2
    fit = PICTURE_SHARE * float(np.min(np.array([right - left, top - low]) / size))
    scale = min(fit, frame.scale)
    origin = (left + right) / 2 - scale * middle[0], (low + top) / 2 - scale * middle[1]
    yield from View(axes, origin, scale).drawn(project(shape, axes, hidden=False))


def _levels(shape: Shape, frame: _Frame) -> Iterator[Entity]:
    """Running dimensions of plane faces: x below view B, y left of it, z left of view A."""
    x, y, z = (_chosen(shape, frame, k) for k in range(3))
    (left, low), _ = _outline(frame, "B")
    above, side = frame.views["B"], frame.views["A"]
    rulers = [(above.at(at * np.eye(3)[0])[0], mm(at)) for at in x]
    yield from ruler_across(rulers, above.origin[0], low, low - LEVELS_MM)
    rulers = [(above.at(at * np.eye(3)[1])[1], mm(at)) for at in y]
    yield from ruler_upward(rulers, above.origin[1], left, left - LEVELS_MM)
    (left, _), _ = _outline(frame, "A")
    rulers = [(side.at(at * np.eye(3)[2])[1], mm(at)) for at in z]
    yield from ruler_upward(rulers, side.origin[1], left, left - LEVELS_MM)


def _chosen(shape: Shape, frame: _Frame, axis: int) -> list[float]:
    """Levels along an axis: both ends, the datum, and those of the largest faces between."""
    ends = frame.box[:, axis].tolist()
    found = plane_levels(shape, np.eye(3)[axis])
    by_area = sorted(found, key=lambda one: (-round(one[1], 2), one[0]))
    chosen = [round(end, 2) + 0.0 for end in ends]
    for level in [0.0, *(level for level, _ in by_area)]:
        inside = ends[0] - SAME_MM < level < ends[1] + SAME_MM
        if len(chosen) < LEVELS and inside and all(abs(level - one) > SAME_MM for one in chosen):
            chosen.append(level)
    return sorted(chosen)


def _overall(frame: _Frame, found: Sequence[RoundFace]) -> Iterator[Entity]:
    """Length, depth and height over all; diameters of round parts are marked."""
    size = frame.box[1] - frame.box[0]
    width, depth, height = map(mm, size.tolist())
    round_part = any(
        not one.hollow
        and abs(one.axis[2]) > 1 - SAME_MM
        and np.allclose(size[:2], 2 * one.radius, atol=SAME_MM)
        for one in found
    )
    form = "Ø<>" if round_part else "<>"
    (left, _), (right, high) = _outline(frame, "A")
    yield across((left, high), (right, high), high + LENGTH_MM, width, form)
    (left, low), (right, high) = _outline(frame, "C")
    yield across((left, high), (right, high), high + LENGTH_MM, depth, form)
    yield upward((right, low), (right, high), right + LENGTH_MM, height)


def _rows(paper: Point) -> int:
    _, low, _, high = drawing_room(paper)
    return int((high - low - BESIDE_MM) / TABLE_ROW_MM)


RESIN, RESIN_PROCESS, FILAMENT_PROCESS = "resin", "sla", "fdm"
CAP = "cap"  # role of a part
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
    turned = part.role == CAP and block.material != RESIN
    block = block if turned else replace(block, tolerances=_as_printed(block.material))
    words = [*_notes(part, turned, what), *export.source(part.step)]
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


def _as_printed(material: str) -> str:
    """What the printer holds: four standard deviations of a position (decision 0007)."""
    process = load_process(RESIN_PROCESS if material == RESIN else FILAMENT_PROCESS)
    expected = MAKERS_SHARE * process.sphere_centre_um.magnitude / 1000
    return f"±{mm(expected)}, short lengths"


def _notes(part: PrintedPartRecord, turned: bool, origin: str) -> Iterator[str]:
    yield f"{part.what[:1].upper()}{part.what[1:]}."
    yield f"Origin of x, y, z: {origin}."
    if turned:
        yield f"Turned: drawing_{part.name}.pdf (ISO 10110) has the mirror and its tolerances."
        return
    finish = f"Finish: {part.finish}. " if part.finish else ""
    yield f"Printed. {finish}Deburr; remove supports."


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

"""assembly.pdf: the instructions on A4 sheets to print, the same words as assembly.html."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import trimesh

from tbcad.cad.drafting.sheet import (
    A4,
    BESIDE_MM,
    BORDER_MM,
    CELL_MM,
    LEFT_MM,
    TITLE_MM,
    Box,
    TitleBlock,
    cell,
    moved,
    rectangle,
    sheet_frame,
)
from tbcad.cad.formats.entities import Entity, Layer, Line, Text
from tbcad.cad.formats.glb import ColouredMesh
from tbcad.cad.formats.pdf import drawable, text_width, write_pages
from tbcad.core.spec.design import PrinterSpec
from tbcad.prototype.assembly_steps.instructions import Instructions, hours_text, instructions
from tbcad.prototype.assembly_steps.machine import AssembledMachine, read_machine
from tbcad.prototype.assembly_steps.steps import Step
from tbcad.prototype.assembly_steps.views import step_picture, whole_picture
from tbcad.prototype.files.bom import PRINTED
from tbcad.version import __version__

NAME, TITLE = "assembly.pdf", "assembly instructions"
PAPER = A4[1], A4[0]  # upright
STRIP_MM = 12.0  # height of the title strip of all sheets but the first
LEFT, RIGHT = LEFT_MM + BESIDE_MM, PAPER[0] - BORDER_MM - BESIDE_MM
TOP, LOW = PAPER[1] - BORDER_MM - BESIDE_MM, BORDER_MM + STRIP_MM + BESIDE_MM
HEAD_MM, HEADING_MM, WORDS_MM = 5.0, 3.5, 2.2  # heights of capitals
LINE, GAP = 1.85, 3.0  # from line to line, over the capitals' height; between blocks, mm
MARK_MM, BOX_MM = 7.0, 2.6  # room for a number or a box before a text; size of a box
SLACK_MM = 0.5  # of a sheet that is full
PICTURE_MM, COVER_MM = (55.0, 120.0), 185.0  # least and greatest heights of a picture
STRIP = (("Title", 68.0), ("Design", 52.0), ("Drawn by", 36.0), ("Sheet", 24.0))
PARTS_MM, PARTS = (11.0, 11.0, 40.0, 110.0), ("no.", "qty", "part", "designation")
LIST_MM = (11.0, 11.0, 40.0, 82.0, 28.0)
PICTURES = (
    "Thick lines are new in a step, thin ones are there already. New parts are drawn away from "
    "their places, each against the direction in which it goes in."
)


@dataclass(frozen=True)
class Block:
    """A block that stays on one sheet."""

    height: float  # mm
    draw: Callable[[float], Iterable[Entity]]  # by the height of its upper edge on paper, mm
    keep: bool = False  # on one sheet with what follows
    subject: str = ""  # of a new sheet, and of those that follow


def write_book(
    folder: Path, meshes: Sequence[ColouredMesh], design: str, printer: PrinterSpec
) -> None:
    """Write assembly.pdf into a folder with the lists and the record of a prototype.

    meshes: of all bodies, in their places. InputError: as `assembly_steps`.
    """
    machine = read_machine(folder)
    bodies = {one.name: trimesh.Trimesh(one.mesh.vertices, one.mesh.triangles) for one in meshes}
    pages = book(machine, bodies, design, printer)
    write_pages(folder / NAME, f"{design}: assembly", PAPER, pages)


def book(
    machine: AssembledMachine,
    bodies: dict[str, trimesh.Trimesh],
    design: str,
    printer: PrinterSpec,
) -> list[list[Entity]]:
    """The sheets, their entities in mm from the lower left corner."""
    told = instructions(machine, printer)
    blocks = [
        *_front(told),
        *_parts(machine, told),
        *(block for step in told.steps for block in _step(machine, told, step, bodies)),
    ]
    sheets = list(_sheets(blocks))
    count = 1 + len(sheets)
    cover = _cover(machine, told, bodies, design, count)
    others = (
        [*_frame(subject, design, number, count), *drawn]
        for number, (subject, drawn) in enumerate(sheets, 2)
    )
    return [cover, *others]


def _cover(
    machine: AssembledMachine,
    told: Instructions,
    bodies: dict[str, trimesh.Trimesh],
    design: str,
    count: int,
) -> list[Entity]:
    """Title, times, the whole machine apart, and the title block of ISO 7200."""
    low = BORDER_MM + TITLE_MM[1] + BESIDE_MM
    title = TitleBlock(
        title=TITLE,
        design=design,
        item="all",
        quantity=1,
        material="see the parts list",
        view="from the camera's side, taken apart",
        sheet=f"1 of {count}",
        tolerances="none",
    )
    total = hours_text(sum(told.minutes.values()))
    words = (
        f"{len(told.steps)} subassemblies, {sum(machine.bill.quantities.values())} parts, about "
        f"{total} of work. Numbers in circles and in brackets are those of the parts list.",
    )
    blocks = [_heading("Assembly instructions", HEAD_MM), *map(_paragraph, words)]
    y, drawn = TOP, list[Entity]()
    for block in blocks:
        drawn += block.draw(y)
        y -= block.height
    picture = whole_picture(machine, bodies, (LEFT, low, RIGHT, min(y - GAP, low + COVER_MM)))
    return [*sheet_frame(PAPER, None, title), *drawn, *picture]


def _front(told: Instructions) -> Iterator[Block]:
    """Blocks before the first step: about, tools, times."""
    yield from _section("Before the first step", map(_paragraph, (*told.about, PICTURES)))
    yield from _section("Tools", _listed(told.tools))
    rows = [(str(one.number), one.title, hours_text(told.minutes[one.key])) for one in told.steps]
    total = ("", "all", hours_text(sum(told.minutes.values())))
    yield from _section("Times", map(_paragraph, told.times))
    yield from _table((11.0, 131.0, 30.0), ("no.", "subassembly", "work"), [*rows, total])
    yield from _section("Printing", ())
    yield from _table((36.0, 136.0), ("setting", "value"), told.printing)


def _parts(machine: AssembledMachine, told: Instructions) -> Iterator[Block]:
    """The parts list with the steps that take each part; what is not drawn, and what was tried."""
    yield _heading("Parts", HEADING_MM)
    taken: dict[int, list[int]] = {}
    for step in told.steps:
        for use in step.parts:
            taken.setdefault(use.item, []).append(step.number)
    rows = []
    for row in machine.bill.rows:
        item = int(row["item"] or 0)
        how = " ".join(map(str, taken.get(item, ())))
        made = f"print: {row['what']}" if row["from"] == PRINTED else told.designations[item]
        rows.append((str(item), str(row["quantity"]), str(row["part"]), made, how))
    yield from _table(LIST_MM, (*PARTS, "in step"), rows)
    yield from _section("Not drawn", [*_listed(told.not_drawn)])
    yield from _section("Tested, and not tested", ())
    yield from _table((48.0, 124.0), ("with", "how far it was tried"), told.tested)


def _step(
    machine: AssembledMachine,
    told: Instructions,
    step: Step,
    bodies: dict[str, trimesh.Trimesh],
) -> list[Block]:
    """A subassembly: parts, tools and time, picture, what is done, torques and fits, checks."""
    title = f"{step.number}. {step.title}"
    tools = ", ".join(told.step_tools[step.key])
    time = f"About {hours_text(told.minutes[step.key])}."
    above = [
        _heading(title, HEADING_MM, title),
        _paragraph(f"{time} Tools: {tools}." if tools else time),
        *(_table(PARTS_MM, PARTS, told.uses(step)) if step.parts else ()),
    ]
    below = [_item(text, f"{number}.") for number, text in enumerate(step.does, 1)]
    below += _section("Torques and fits", _listed(step.fits)) if step.fits else ()
    below += _section("Check", (_item(text, "") for text in step.checks)) if step.checks else ()
    height = _picture_height(sum(one.height for one in (*above, *below)))
    drawn = step_picture(machine, step, bodies, (LEFT, 0.0, RIGHT, height))
    return [*above, *([_placed(drawn, height)] if drawn else ()), *below]


def _picture_height(others: float) -> float:
    """Such that a step has one sheet, if its words leave room for a picture."""
    rest = TOP - LOW - others - 2 * GAP - SLACK_MM
    return min(rest, PICTURE_MM[1]) if rest >= PICTURE_MM[0] else sum(PICTURE_MM) / 2


def _section(title: str, blocks: Iterable[Block]) -> Iterator[Block]:
    yield _heading(title, WORDS_MM * 1.25)
    yield from blocks


def _listed(texts: Iterable[str]) -> Iterator[Block]:
    return (_item(text, "-") for text in texts)


def _heading(text: str, height: float, subject: str = "") -> Block:
    def draw(top: float) -> Iterator[Entity]:
        base = top - GAP - height
        yield Text(Layer.FRAME, (LEFT, base), height, drawable(text))
        rule = Layer.FRAME if height >= HEADING_MM else Layer.DIMENSIONS
        yield Line(rule, (LEFT, base - height / 2), (RIGHT, base - height / 2))

    return Block(2 * GAP + 1.5 * height, draw, True, subject)


def _paragraph(text: str) -> Block:
    return _item(text, None)


def _item(text: str, mark: str | None) -> Block:
    """A text in lines, behind a mark: an empty one is a box to tick, None is no mark at all."""
    start = LEFT if mark is None else LEFT + MARK_MM
    lines = wrapped(drawable(text), RIGHT - start)
    step = LINE * WORDS_MM

    def draw(top: float) -> Iterator[Entity]:
        base = top - WORDS_MM
        if mark == "":
            corner = LEFT + (MARK_MM - BOX_MM) / 2
            low = base + (WORDS_MM - BOX_MM) / 2
            yield rectangle((corner, low, corner + BOX_MM, low + BOX_MM), Layer.DIMENSIONS)
        elif mark:
            yield Text(Layer.DIMENSIONS, (start - 2.0, base), WORDS_MM, mark, "right")
        for k, line in enumerate(lines):
            yield Text(Layer.DIMENSIONS, (start, base - k * step), WORDS_MM, line)

    return Block(len(lines) * step + 0.5 * WORDS_MM, draw)


def wrapped(text: str, width: float) -> list[str]:
    """A text in lines that fit into a width (mm); a longer word has a line of its own."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if text_width(longer, WORDS_MM) > width and lines[-1]:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def _table(
    widths: Sequence[float], head: Sequence[str], rows: Iterable[Sequence[str]]
) -> Iterator[Block]:
    """A table, each row a block; the head is kept with the first row."""
    yield _row(widths, head, keep=True)
    yield from (_row(widths, cells) for cells in rows)
    yield Block(GAP, lambda _: ())


def _row(widths: Sequence[float], cells: Sequence[str], *, keep: bool = False) -> Block:
    """A row, as high as the cell with most lines."""
    columns = [
        wrapped(drawable(text), width - 2 * CELL_MM)
        for text, width in zip(cells, widths, strict=True)
    ]
    step = LINE * WORDS_MM
    height = max(map(len, columns)) * step + CELL_MM / 2

    def draw(top: float) -> Iterator[Entity]:
        left = LEFT
        for width, lines in zip(widths, columns, strict=True):
            yield rectangle((left, top - height, left + width, top), Layer.DIMENSIONS)
            for k, line in enumerate(lines):
                base = top - CELL_MM / 2 - k * step - (step + WORDS_MM) / 2
                yield Text(Layer.DIMENSIONS, (left + CELL_MM, base), WORDS_MM, line)
            left += width

    return Block(height, draw, keep)


def _placed(drawn: Sequence[Entity], height: float) -> Block:
    """A picture with its border."""

    def draw(top: float) -> Iterator[Entity]:
        low = top - GAP - height
        yield rectangle((LEFT, low, RIGHT, low + height), Layer.RAYS)
        yield from (moved(one, (0.0, -low), 1.0) for one in drawn)

    return Block(height + 2 * GAP, draw)


def _sheets(blocks: Iterable[Block]) -> Iterator[tuple[str, list[Entity]]]:
    """Blocks on sheets, one below the other, each sheet with its subject."""
    y, drawn, kept, subject = TOP, list[Entity](), list[Block](), TITLE
    for block in blocks:
        kept.append(block)
        if block.keep:
            continue
        height = sum(one.height for one in kept)
        if drawn and (y - height < LOW or kept[0].subject):
            yield subject, drawn
            y, drawn = TOP, []
        subject = kept[0].subject or subject
        for one in kept:
            drawn += one.draw(y)
            y -= one.height
        kept = []
    yield subject, drawn


def _frame(subject: str, design: str, number: int, count: int) -> Iterator[Entity]:
    """The border, and a strip with what ISO 7200 asks of a sheet that follows."""
    yield rectangle((LEFT_MM, BORDER_MM, PAPER[0] - BORDER_MM, PAPER[1] - BORDER_MM), Layer.FRAME)
    values = (subject, design, f"tbcad {__version__}", f"{number} of {count}")
    left = LEFT_MM
    for (label, width), value in zip(STRIP, values, strict=True):
        box: Box = (left, BORDER_MM, left + width, BORDER_MM + STRIP_MM)
        yield from cell(box, label, drawable(value))
        left += width

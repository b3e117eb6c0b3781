"""Drawings as DXF, by group codes in plain Python, and as PDF; both by closed grammars.

A machine that cuts obeys units, hidden layers, blocks, bulges and extrusions as readily as lines.
So there are the sections, layers, kinds of entities and group codes that tbcad writes, and no
others. What is on the layers `cut` and `fold` is measured, all of it.

What is written on a PDF is paper, what a viewer does with it is not: it may run scripts, open
addresses, hold other files, or scale its pages. So its objects are those that tbcad writes, and its
pages show lines and texts at full size of the paper, whose frame is where ISO 5457 has it.
Sources: Autodesk's DXF reference for R2010; ISO 32000-1, chapters 7 to 9.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tbcad_verify.record.files import FileBytes
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats

CUT, FOLD = "cut", "fold"  # the layer of outlines and holes, and that of folds
X, Y, END_X, END_Y, RADIUS, LAYER, NAME, FLAGS, COLOUR = 10, 20, 11, 21, 40, 8, 2, 70, 62
MOST_CIRCLES = 1000
SECTIONS = ["HEADER", "CLASSES", "TABLES", "BLOCKS", "ENTITIES", "OBJECTS"]
# Variables that say what a number means, or where: all others only show something.
HEADER = {
    **{"$INSUNITS": "4", "$MEASUREMENT": "1", "$LUNITS": "2", "$AUNITS": "0", "$TILEMODE": "1"},
    **{"$ANGDIR": "0", "$ANGBASE": "0.0", "$INSBASE": "0.0", "$DIMLFAC": "1.0", "$DIMALT": "0"},
    **{"$THICKNESS": "0.0", "$ELEVATION": "0.0", "$UCSORG": "0.0", "$UCSXDIR": "1.0"},
    **{"$UCSYDIR": "0.0", "$DIMPOST": "", "$UCSNAME": ""},
}
LAYERS = re.compile("0|Defpoints|cut|fold|engrave|hidden|hatch|rays|centre|dimensions|frame")
BLOCKS = re.compile(r"\*(Model_Space|Paper_Space|D\d+)")
COMMON = {0, 5, 100, 330, LAYER, X, Y, 30}  # group codes of all entities; 30 and 31: z
CODES = {
    "LINE": {END_X, END_Y, 31},
    "CIRCLE": {RADIUS},
    "ARC": {RADIUS, 50, 51},
    "LWPOLYLINE": {90, FLAGS},
    "TEXT": {1, RADIUS, END_X, END_Y, 31, 50, 72},
    "DIMENSION": {
        *(1, NAME, 3, END_X, END_Y, 31, 13, 23, 33, 14, 24, 34, 15, 25, 35, 42, 50, FLAGS, 71, 280)
    },
}
DRAWN = {
    CUT: {"LINE", "CIRCLE", "ARC", "LWPOLYLINE"},
    FOLD: {"LINE"},
    "centre": {"LINE", "CIRCLE", "ARC"},
    "dimensions": {"LINE", "LWPOLYLINE", "TEXT", "DIMENSION"},
    "frame": {"LINE", "LWPOLYLINE", "TEXT"},
}

NUMBER = r"-?\d+(?:\.\d+)?"
TEXT = r"\((?:[^()\\\n]|\\[()\\])*\)"
PAGE = (
    "<</Type/Page/Parent 2 0 R/MediaBox[0 0 @ @]/Contents {} 0 R/Resources<</Font<</F1 4 0 R>>>>>>"
)
FONT = "<</Type/Font/Subtype/Type1/BaseFont/Helvetica/Encoding/WinAnsiEncoding>>"
CONTENTS = "<</Length #>>\nstream\n1 J 1 j\n2.8346 0 0 2.8346 0 0 cm\n%\nendstream"
TABLE = r"xref\n0 {0}\n(?:\d{{10}} \d{{5}} [nf] \n){{{0}}}"
TRAILER = "trailer\n<</Size {}/Root 1 0 R/Info {} 0 R>>\nstartxref\n#\n%%EOF\n"
KIDS, MOST_PAGES, ENDED = re.compile(r"/Kids\[([\d R]+)\]/Count (\d{1,3})>>"), 200, "\nendobj\n"
PLACES = {"@": rf"({NUMBER})", "#": r"\d+", "%": r"([^\0]*)", "$": TEXT}
FRAME = re.compile(rf"{NUMBER} w \[\] 0 d 20 10 m ({NUMBER}) 10 l \1 ({NUMBER}) l 20 \2 l h S")
LINE = re.compile(
    rf"{NUMBER} w \[[\d. ]*\] 0 d [-\d. mlch]+ S"
    rf"|BT /F1 {NUMBER} Tf (?:{NUMBER} ){{6}}Tm {TEXT} Tj ET"
)
HIDDEN = re.compile(r"<<|\bobj\b|stream")  # in a text: an object for who looks for one
POINTS_PER_MM, BORDER_MM, SAME_MM = 72 / 25.4, 10.0, 0.01

Group = tuple[int, str]
Entity = dict[int, list[str]]


class FlatDrawing(NamedTuple):
    """Cuts and folds of a DXF."""

    circles: Floats  # (N, 3) x, y and radius, mm
    outlines: list[Floats]  # (M, 2) corners of each, closed unless it has arcs beside it
    lines: Floats  # (L, 2, 2) both ends of other cuts, mm
    arcs: Floats  # (A, 3) x, y and radius, mm
    folds: Floats  # (F, 2, 2) both ends, mm

    @property
    def corners(self) -> Floats:
        """(M, 2) corners of all outlines."""
        return np.concatenate([np.zeros((0, 2)), *self.outlines])


def read_dxf(blob: FileBytes) -> FlatDrawing:
    """All that is to be cut and folded.

    Unknown: it is no DXF, or has something that tbcad does not write.
    """
    try:
        entities = _entities(blob.text())
    except (ValueError, KeyError) as error:
        raise Unknown(f"{blob.name}: no DXF of tbcad's ({error})") from None
    some = {
        (layer, kind): [one for one in entities if one[0] == [kind] and one[LAYER] == [layer]]
        for layer in (CUT, FOLD)
        for kind in CODES
    }
    circles, arcs = (_numbers(some[CUT, kind], (X, Y, RADIUS)) for kind in ("CIRCLE", "ARC"))
    if len(circles) > MOST_CIRCLES:
        raise Unknown(f"{blob.name}: {len(circles)} circles, allowed are {MOST_CIRCLES}")
    outlines = some[CUT, "LWPOLYLINE"]
    closed = "0" if len(arcs) else "1"
    if any(one[FLAGS] != [closed] for one in outlines):
        raise Unknown(f"{blob.name}: an outline is {'closed' if len(arcs) else 'open'}")
    lines, folds = (
        _numbers(some[layer, "LINE"], (X, Y, END_X, END_Y)).reshape(-1, 2, 2)
        for layer in (CUT, FOLD)
    )
    corners = [np.array([one[X], one[Y]], dtype=float).T for one in outlines]
    return FlatDrawing(circles, corners, lines, arcs, folds)


def _numbers(some: list[Entity], codes: tuple[int, ...]) -> Floats:
    return np.array([[one[code][0] for code in codes] for one in some], dtype=float).reshape(
        -1, len(codes)
    )


def _entities(text: str) -> list[Entity]:
    """Entities of the drawing itself, the values of each by group code.

    ValueError: something is not allowed, or no DXF; KeyError: a group is missing.
    """
    lines = [line.strip() for line in text.splitlines()]
    pairs = list(zip(map(int, lines[::2]), lines[1::2], strict=True))
    starts = [k for k, pair in enumerate(pairs) if pair == (0, "SECTION")]
    ends = [k for k, pair in enumerate(pairs) if pair == (0, "ENDSEC")]
    if [pairs[k + 1] for k in starts] != [(NAME, name) for name in SECTIONS]:
        raise ValueError(f"sections must be {', '.join(SECTIONS)}")
    whole = [0, *(k for pair in zip(starts, ends, strict=True) for k in pair), len(pairs) - 1]
    gaps = [b - a for a, b in zip(whole[::2], whole[1::2], strict=True)]
    if gaps != [0, *[1] * (len(SECTIONS) - 1), 1] or pairs[-1] != (0, "EOF"):
        raise ValueError("something stands between the sections")
    header, _, tables, blocks, entities, _ = (
        pairs[start + 2 : end] for start, end in zip(starts, ends, strict=True)
    )
    _refuse_header(header)
    _refuse_layers(_grouped(tables))
    _refuse_blocks(_grouped(blocks))
    found = _grouped(entities)
    for one in found:
        _refuse_entity(one)
    return found


def _grouped(pairs: list[Group]) -> list[Entity]:
    """Values by group code, of each that a group code 0 begins."""
    found: list[Entity] = []
    for code, value in pairs:
        if code == 0:
            found.append({})
        found[-1].setdefault(code, []).append(value)
    return found


def _refuse_header(pairs: list[Group]) -> None:
    names = [k for k, (code, _) in enumerate(pairs) if code == 9]
    values = {pairs[k][1]: pairs[k + 1][1] for k in names}
    for name, allowed in HEADER.items():
        if values.get(name) != allowed or len(values) < len(names):
            given = values.get(name, "missing")
            raise ValueError(f"{name} is {given}, allowed is {allowed}, once")


def _refuse_layers(tables: list[Entity]) -> None:
    """Refuse layers that are off, frozen, locked, or not plotted, and those of another name."""
    for one in tables:
        if one[0] == ["LAYER"]:
            shown = one[FLAGS] == ["0"] and int(one[COLOUR][0]) > 0
            plotted = one.get(290, ["1"]) == ["1"] or one[NAME] == ["Defpoints"]
            if not (LAYERS.fullmatch(one[NAME][0]) and shown and plotted):
                raise ValueError(f"layer {one[NAME][0]} is foreign or hidden")


def _refuse_blocks(blocks: list[Entity]) -> None:
    """Refuse blocks but the pictures of dimensions, which have no cuts."""
    for one in blocks:
        if one[0] == ["BLOCK"]:
            if not BLOCKS.fullmatch(one[NAME][0]):
                raise ValueError(f"a block {one[NAME][0]}")
            inside = one[NAME][0]
        elif one[0] != ["ENDBLK"]:
            _refuse_entity(one)
            if not inside.startswith("*D") or one[LAYER] != ["dimensions"]:
                raise ValueError(f"{one[0][0]} in block {inside}")


def _refuse_entity(one: Entity) -> None:
    (kind,), layer = one[0], one.get(LAYER, ["none"])
    if kind not in DRAWN.get(layer[0], ()) or len(layer) > 1:
        raise ValueError(f"{kind} on layer {layer[0]}")
    if foreign := one.keys() - COMMON - CODES[kind]:
        raise ValueError(f"{kind} on layer {layer[0]} with group code {min(foreign)}")
    if {*one.get(30, ()), *one.get(31, ())} - {"0.0"}:
        raise ValueError(f"{kind} on layer {layer[0]} is not in the plane of the paper")


def sheet_faults(blob: FileBytes) -> list[str]:
    """Contents of a drawing that tbcad does not write; empty for none."""
    text = blob.data.tobytes().decode("cp1252", errors="replace")
    found = KIDS.search(text)
    pages = min(int(found[2]), MOST_PAGES) if found else 1
    *objects, end = text.split(ENDED)
    forms = [*_forms(pages)]
    size = len(forms) + 1
    ended = re.fullmatch(TABLE.format(size) + _escaped(TRAILER.format(size, size - 1)), end)
    if not ended or len(objects) != len(forms):
        return [f"{blob.name}: other objects than pages of lines and texts"]
    sizes, drawn = [], []
    for number, (form, one) in enumerate(zip(forms, objects, strict=True), 1):
        begin = "%PDF-1.4\n" * (number == 1)
        match = re.fullmatch(_escaped(f"{begin}{number} 0 obj\n{form}"), one)
        if not match:
            return [f"{blob.name}: other objects than pages of lines and texts"]
        sizes += [match.groups()] if form.startswith("<</Type/Page/") else []
        drawn += [match[1].split("\n")] if form == CONTENTS else []
    pages_of = zip(sizes, drawn, strict=True)
    return [fault for page, lines in pages_of for fault in _page_faults(blob.name, page, lines)]


def _page_faults(name: str, size: tuple[str, ...], drawn: list[str]) -> list[str]:
    """Faults of a page of a size (points) and its lines; the frame is the first."""
    frame = FRAME.fullmatch(drawn[0])
    ends = [float(frame[k]) + BORDER_MM for k in (1, 2)] if frame else [math.nan, math.nan]
    page = [float(side) / POINTS_PER_MM for side in size]
    if not all(abs(end - side) < SAME_MM for end, side in zip(ends, page, strict=True)):
        return [f"{name}: a page of {page[0]:.0f} x {page[1]:.0f} mm, its frame is of another"]
    wrong = [line for line in drawn if not LINE.fullmatch(line) or HIDDEN.search(line)]
    return [f"{name}: {wrong[0][:40]!r} is neither a line nor a text"] if wrong else []


def _forms(pages: int) -> Iterator[str]:
    """Objects in their order: the first page is 3 and its contents are 5, then two a page."""
    numbers = [3, *range(6, 2 * pages + 4, 2)]
    yield "<</Type/Catalog/Pages 2 0 R>>"
    yield f"<</Type/Pages/Kids[{' '.join(f'{k} 0 R' for k in numbers)}]/Count {pages}>>"
    yield from (PAGE.format(5), FONT, CONTENTS)
    for number in numbers[1:]:
        yield from (PAGE.format(number + 1), CONTENTS)
    yield "<</Title$>>"


def _escaped(text: str) -> str:
    parts = re.split(r"([@#$]|(?<=\n)%(?=\n))", text)
    return "".join(PLACES.get(part, re.escape(part)) for part in parts)

"""The sheet of an order: on one page what a workshop asks before it makes the shells."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.cad.drafting.dimensions import labels, leader
from tbcad.cad.drafting.sheet import (
    A3,
    BESIDE_MM,
    TABLE_ROW_MM,
    Sheet,
    drawing_room,
    placed,
    sheet_frame,
    table,
)
from tbcad.cad.drafting.views import ABOVE, FRONT, LEFT, View, as_entities, straight
from tbcad.cad.formats.entities import Circle, Entity, Layer, Point, Text
from tbcad.cad.formats.pdf import text_width, write_pdf
from tbcad.cad.formats.step import read_named_solid
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.features import RoundFace, round_faces
from tbcad.cad.kernel.projection import section
from tbcad.core.spec.design import Spec
from tbcad.drawings.holes import mm
from tbcad.drawings.order_words import FIGURE_HEAD, blocks, figure_rows, title_block
from tbcad.drawings.shell_sheet import hatching
from tbcad.types import Floats

SOLIDS = ("shell_a", "mandrel_a")
AXES = (FRONT, LEFT, ABOVE)
NAMES = (
    "section y = 0, from the front",
    "section of the seam flange, from the left",
    "section of the foot flange, from above",
)
NAME_MM, NAME_OFF_MM = 2.0, 9.0  # height of a view's name and its place below
SCALES = (2.0, 1.0, 0.5, 0.4, 0.2, 0.1)
VIEWS_MM = 206.0  # width of views and holes; texts have the rest
BETWEEN_MM, AROUND_MM = 16.0, 10.0  # from view to view, and from the border
WORDS_MM, LINE = 20.0, 1.9  # width of heads, from line to line by the height of texts
TEXTS_MM = np.geomspace(2.5, 1.0, 20).tolist()  # heights of texts, tried in turn
HOLE_HEAD = ("hole", "Ø", "depth", "x", "± y", "z", "count")
HOLE_WIDTHS = (11.0, 9.0, 17.0, 13.0, 13.0, 13.0, 10.0)
FIGURE_WIDTHS = (40.0, 20.0, 23.0, 20.0, 75.0)
HOLE_MM = 2.2  # radius about which numbers stand, on the part
PLANES = ("", "seam", "foot")  # whose holes a view shows
ON = {"seam": "on B", "foot": "on A"}  # where the mouths of holes are
PREFIX = {"shell": "", "mandrel": "M"}
DIGITS = 3


@dataclass(frozen=True)
class PlaneHoles:
    """Equal holes of a solid in one of its planes, on both sides of y = 0."""

    number: str  # such as F1
    solid: str  # "shell" or "mandrel"
    plane: str  # "seam" or "foot"
    holes: tuple[RoundFace, ...]

    def middles(self) -> list[Floats]:
        """Of the holes' axes, mm, (3,) each."""
        return [np.asarray((one.start + one.end) / 2) for one in self.holes]

    def row(self) -> tuple[str, ...]:
        """In the table, below HOLE_HEAD."""
        x, y, z = map(mm, (*self.middles()[0],))
        place = (ON["seam"], y, z) if self.plane == "seam" else (x, y, ON["foot"])
        depth = f"{'through' if self.solid == 'shell' else 'blind'} {mm(self.holes[0].length)}"
        sizes = mm(2 * self.holes[0].radius), depth
        return self.number, *sizes, place[0], place[1].removeprefix("-"), place[2], self.count

    @property
    def count(self) -> str:
        """How many they are."""
        return f"{len(self.holes)}"


Cut = list[list[Entity]]
"""What a view cuts of each solid, in mm of the part."""


def write_sheet(folder: Path, export: Path, record: dict[str, Any], spec: Spec) -> None:
    """Write order.pdf."""
    sheet = order_sheet(export, record, spec)
    write_pdf(folder / f"{sheet.name}.pdf", sheet.title, sheet.paper, sheet.entities)


def order_sheet(export: Path, record: dict[str, Any], spec: Spec) -> Sheet:
    """The page by the record of an order, from the solids of camera a in the folder of a build."""
    names = (name for name in SOLIDS if f"{name}_tolerances.step" in record["files"])
    solids = [read_named_solid(export / f"{name}.step") for name in names]
    holes = [one for solid in solids for one in plane_holes(solid)]
    cuts = [_cut(k, solids, holes) for k in range(len(AXES))]
    views, box = _views(cuts)
    left, low, right, high = drawing_room(A3)
    edge = left + VIEWS_MM, right - BESIDE_MM
    figures = [FIGURE_HEAD, *figure_rows(record)]
    below = high - BESIDE_MM - (len(figures) + 1) * TABLE_ROW_MM
    block = title_block(record, spec)
    entities = [
        *sheet_frame(A3, views[0].scale, block),
        *chain.from_iterable(map(_drawn, views, cuts, NAMES)),
        *chain.from_iterable(map(_numbers, views, cuts, PLANES, repeat(holes))),
        *_datums(views, holes, record["foot_z_mm"]),
        *table(_beside(views[2], box), HOLE_WIDTHS, [HOLE_HEAD, *(one.row() for one in holes)]),
        *table((edge[0], high - BESIDE_MM), FIGURE_WIDTHS, figures),
        *_words(edge, (low + BESIDE_MM, below), blocks(record, spec)),
    ]
    scale, origin = views[0].scale, views[0].origin
    return Sheet("order", block.title, block.item, A3, scale, origin, tuple(entities))


def plane_holes(solid: Solid) -> list[PlaneHoles]:
    """Holes of seam and foot, those of one size at one place and its mirror image together."""
    found, kind = [], solid.name.rpartition("_")[0]
    for plane in ON:
        groups: dict[tuple[float, ...], list[RoundFace]] = {}
        for hole in round_faces(face for name, face in solid.faces if f"{plane}_hole" in name):
            x, y, z = ((hole.start + hole.end) / 2).tolist()
            place = tuple(round(one, DIGITS) + 0.0 for one in (x, -z, abs(y), hole.radius))
            groups.setdefault(place, []).append(hole)
        found += [
            PlaneHoles(f"{PREFIX[kind]}{plane[0].upper()}{k}", kind, plane, tuple(groups[place]))
            for k, place in enumerate(sorted(groups), 1)
        ]
    return found


def _cut(k: int, solids: Sequence[Solid], holes: Sequence[PlaneHoles]) -> Cut:
    """What view k cuts: the plane y = 0, or the middle of each solid's holes in seam or foot."""
    cut, axes = [], AXES[k]
    for solid in solids:
        kind, plane = solid.name.rpartition("_")[0], PLANES[k]
        own = (one for one in holes if (one.solid, one.plane) == (kind, plane))
        level = next((float(axes[2] @ one.middles()[0]) for one in own), 0.0)
        cut.append([*as_entities(section(solid.shape, axes, level), Layer.CUT)])
    return cut


def _views(cuts: Sequence[Cut]) -> tuple[list[View], Floats]:
    """Views from the front, from the left and from above, and what they show, mm, (2, 3)."""
    front, side, above = (
        np.array([straight(one for solid in cut for one in solid)]).reshape(-1, 2) for cut in cuts
    )
    along = (
        np.concatenate([front[:, 0], above[:, 0]]),
        np.concatenate([-side[:, 0], above[:, 1]]),
        np.concatenate([front[:, 1], side[:, 1]]),
    )
    box = np.array([[one.min() for one in along], [one.max() for one in along]])
    left, low, _, high = drawing_room(A3)
    wide, deep, tall = (box[1] - box[0]).tolist()
    spare = BETWEEN_MM + 2 * AROUND_MM
    rooms = (
        (VIEWS_MM - spare) / (wide + deep),
        (high - low - spare) / (tall + deep),
        (VIEWS_MM - spare - sum(HOLE_WIDTHS)) / wide,
    )
    scale = next((one for one in SCALES if one <= min(rooms)), SCALES[-1])
    (x0, _, z0), (x1, y1, z1) = (scale * box).tolist()
    x, y = left + AROUND_MM - x0, high - AROUND_MM - z1
    places = ((x, y), (x + x1 + BETWEEN_MM + y1, y), (x, y + z0 - BETWEEN_MM - y1))
    return [View(one, place, scale) for one, place in zip(AXES, places, strict=True)], box


def _beside(view: View, box: Floats) -> Point:
    """The upper left corner of what is right of the view from above."""
    x, y = view.at(box[1])
    return x + BETWEEN_MM, y


def _drawn(view: View, cut: Cut, name: str) -> Iterator[Entity]:
    """What a view cuts, the shell hatched, and its name."""
    shell, *others = (placed(entities, view.origin, view.scale) for entities in cut)
    yield from (*shell, *hatching(shell), *chain.from_iterable(others))
    x, y = np.array(straight(shell)).reshape(-1, 2).min(axis=0).tolist()
    yield Text(Layer.DIMENSIONS, (x, y - NAME_OFF_MM), NAME_MM, name)


def _numbers(view: View, cut: Cut, plane: str, holes: Sequence[PlaneHoles]) -> Iterator[Entity]:
    """Numbers beside the holes of a plane."""
    shown = [(one.number, at) for one in holes if one.plane == plane for at in one.middles()]
    circles = [Circle(Layer.CUT, view.at(at), HOLE_MM * view.scale) for _, at in shown]
    lines = straight(placed(chain.from_iterable(cut), view.origin, view.scale))
    yield from labels(circles, [number for number, _ in shown], lines)


def _datums(views: Sequence[View], holes: Sequence[PlaneHoles], foot: float) -> Iterator[Entity]:
    """Leaders to A, the foot plane, B, the seam plane, and C, a dowel hole of the foot."""
    first = {one.plane: one.middles()[0] for one in reversed(holes) if one.solid == "shell"}
    feet = [one for one in holes if (one.solid, one.plane) == ("shell", "foot")]
    x, y, _ = min(feet, key=lambda one: one.holes[0].radius).middles()[0].tolist()
    back = min(feet, key=lambda one: abs(one.middles()[0][1]))
    beside = float(back.middles()[0][0]) - 2 * back.holes[0].radius
    for view, tip, way, name in (
        (views[0], (beside, 0.0, foot), (-4.0, -5.0), "A"),
        (views[0], (0.0, 0.0, float(first["seam"][2])), (-4.0, 5.0), "B"),
        (views[2], (x, abs(y), 0.0), (8.0, 3.0), "C"),
    ):
        at = view.at(np.array(tip))
        yield from leader(at, (at[0] + way[0], at[1] + way[1]), name)


def _words(
    edges: Point, levels: Point, told: Sequence[tuple[str, Sequence[str]]]
) -> Iterator[Entity]:
    """Heads and texts between two edges, below the upper of two levels, as small as they must."""
    width, room = edges[1] - edges[0] - WORDS_MM, levels[1] - levels[0]
    tried = ((height, _wrapped(told, width, height)) for height in TEXTS_MM)
    height, lines = next(one for one in tried if len(one[1]) * LINE * one[0] <= room)
    for k, (head, text) in enumerate(lines, 1):
        y = levels[1] - k * LINE * height
        yield Text(Layer.DIMENSIONS, (edges[0], y), height, head)
        yield Text(Layer.DIMENSIONS, (edges[0] + WORDS_MM, y), height, text)


def _wrapped(
    told: Sequence[tuple[str, Sequence[str]]], width: float, height: float
) -> list[tuple[str, str]]:
    """Lines with the head of each first one, none wider than a width (mm)."""
    return [
        (head if k == 0 else "", line)
        for head, texts in told
        for k, line in enumerate(chain.from_iterable(_lines(text, width, height) for text in texts))
    ]


def _lines(text: str, width: float, height: float) -> list[str]:
    """A text in lines that are no wider, filled one after the other."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if text_width(longer, height) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines

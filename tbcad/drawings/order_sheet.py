"""The sheet of an order: on one page what a workshop asks before it makes the shells."""

from collections import Counter
from collections.abc import Iterator, Sequence
from importlib.resources import files
from itertools import chain, repeat
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from tbcad.cad.drafting.dimensions import labels, leader
from tbcad.cad.drafting.sheet import (
    A3,
    BESIDE_MM,
    TABLE_ROW_MM,
    Sheet,
    TitleBlock,
    drawing_room,
    placed,
    table,
)
from tbcad.cad.drafting.views import Curve, Shape, View, section, straight
from tbcad.cad.formats.entities import Circle, Entity, Layer, Point, Text
from tbcad.cad.formats.pdf import drawable, write_pdf
from tbcad.cad.formats.step import read_named_solid
from tbcad.cad.kernel.features import round_faces
from tbcad.cad.kernel.solids import faces
from tbcad.common.told import told
from tbcad.core.spec.csv_rows import read_toml
from tbcad.core.spec.design import Spec
from tbcad.drawings.shell_sheet import hatching
from tbcad.drawings.tables import HEAD, VIEWS, WIDTHS_MM, DrawnHole, numbered_holes, table_rows
from tbcad.mirror_limits.held import IN_STATISTICS, UNCERTAINTY_SHARE
from tbcad.types import Floats

PREFIX = {"shell_a": "", "mandrel_a": "M"}  # of the numbers of holes
NAMES = {"A": "A, section y = 0", "B": "B, section of the foot", "C": "C, section of the seam"}
NAME_MM, NAME_OFF_MM = 2.0, 9.0  # height of a view's name and its place below
SCALES = (2.0, 1.0, 0.5, 0.4, 0.2, 0.1)
VIEWS_MM = 206.0  # width of views and holes; texts have the rest
BETWEEN_MM, AROUND_MM = 16.0, 10.0  # from view to view, and from the border
WORDS_MM, LINE = 20.0, 1.9  # width of heads, from line to line by the height of texts
TEXTS_MM = np.geomspace(2.5, 1.0, 20).tolist()  # heights of texts, tried in turn
WIDE = 0.72  # of a character by the height of capitals
FIGURE_WIDTHS = (40.0, 20.0, 23.0, 20.0, 75.0)
FIGURE_HEAD = ("figure", "limit", "limit of 2 sigma", "chain, 2 sigma", "verdict")
ANY, WORDS = "any", "order_page.toml"
Holes = list[tuple[str, DrawnHole]]
Cut = list[tuple[Curve, ...]]
"""Section of each solid in a view, in mm of the part."""


def write_sheet(folder: Path, export: Path, record: dict[str, Any], spec: Spec) -> None:
    """Write order.pdf."""
    sheet = order_sheet(export, record, spec)
    write_pdf(folder / f"{sheet.name}.pdf", sheet.title, sheet.paper, sheet.entities)


def order_sheet(export: Path, record: dict[str, Any], spec: Spec) -> Sheet:
    """The page by the record of an order, from the solids of camera a in the folder of a build."""
    names = [name for name in PREFIX if f"{name}_tolerances.step" in record["files"]]
    shapes = [read_named_solid(export / f"{name}.step").shape for name in names]
    holes = [numbered_holes(round_faces(faces(shape)), ()) for shape in shapes]
    cuts = [_cut(letter, shapes, holes) for letter in VIEWS]
    views, box = _views(cuts)
    left, low, right, high = drawing_room(A3)
    edge = left + VIEWS_MM, right - BESIDE_MM
    numbered = [
        (PREFIX[name] + number, hole)
        for name, of_solid in zip(names, holes, strict=True)
        for number, hole in of_solid
    ]
    rows = [row[:-1] for number, hole in numbered for row in table_rows(number, hole)]
    figures = [FIGURE_HEAD, *_figure_rows(record)]
    below = high - BESIDE_MM - (len(figures) + 1) * TABLE_ROW_MM
    block = _title_block(record, spec)
    x, y = views[1].at(box[1])
    beside = x + BETWEEN_MM, y  # the corner right of the view from above
    drawn = [
        *chain.from_iterable(map(_drawn, views, cuts, VIEWS, repeat(numbered))),
        *_datums(views, holes[0], record["foot_z_mm"]),
        *table(beside, WIDTHS_MM[:-1], [HEAD[:-1], *rows]),
        *table((edge[0], high - BESIDE_MM), FIGURE_WIDTHS, figures),
        *_words(edge, (low + BESIDE_MM, below), list(_lines(record, spec, rows))),
    ]
    scale, origin = views[0].scale, views[0].origin
    return Sheet.framed(("order", block.item), block, A3, scale, origin, drawn)


def _cut(letter: str, shapes: Sequence[Shape], holes: Sequence[Holes]) -> Cut:
    """Section of a view: the plane y = 0, or the middle of holes that are round in it."""
    cut, axes = [], VIEWS[letter]
    for shape, numbered in zip(shapes, holes, strict=True):
        seen = (hole.cylinder for _, hole in numbered if hole.view == letter)
        level = next((float(axes[2] @ (one.start + one.end) / 2) for one in seen), 0.0)
        cut.append(section(shape, axes, level))
    return cut


def _views(cuts: Sequence[Cut]) -> tuple[list[View], Floats]:
    """Views from the front, from the left and from above, and what they show, mm, (2, 3)."""
    front, above, side = (
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
        (VIEWS_MM - spare - sum(WIDTHS_MM[:-1])) / wide,
    )
    scale = next((one for one in SCALES if one <= min(rooms)), SCALES[-1])
    (x0, _, z0), (x1, y1, z1) = (scale * box).tolist()
    x, y = left + AROUND_MM - x0, high - AROUND_MM - z1
    places = ((x, y), (x, y + z0 - BETWEEN_MM - y1), (x + x1 + BETWEEN_MM + y1, y))
    views = zip(VIEWS.values(), places, strict=True)
    return [View(axes, place, scale) for axes, place in views], box


def _drawn(
    view: View, cut: Cut, letter: str, holes: Sequence[tuple[str, DrawnHole]]
) -> Iterator[Entity]:
    """Section of a view, the shell hatched, its name, and the numbers of its holes."""
    shell, *others = (placed(entities, view.origin, view.scale) for entities in cut)
    yield from (*shell, *hatching(shell), *chain.from_iterable(others))
    x, y = np.array(straight(shell)).reshape(-1, 2).min(axis=0).tolist()
    yield Text(Layer.DIMENSIONS, (x, y - NAME_OFF_MM), NAME_MM, NAMES[letter])
    shown = [(number, one) for number, one in holes if one.view == letter]
    circles = [
        Circle(Layer.CUT, view.at(one.mouth), view.scale * one.cylinder.radius) for _, one in shown
    ]
    yield from labels(circles, [number for number, _ in shown], straight(chain(shell, *others)))


def _datums(views: Sequence[View], holes: Holes, foot: float) -> Iterator[Entity]:
    """Leaders to A, the foot plane, B, the seam plane, and C, a dowel hole of the foot."""
    feet, seam = ([one for _, one in holes if one.view == letter] for letter in "BC")
    back = min(feet, key=lambda one: abs(one.mouth[1]))
    dowel = min(feet, key=lambda one: (round(one.cylinder.radius, 6), -one.mouth[1]))
    beside = float(back.mouth[0]) - 2 * back.cylinder.radius
    top = max(float(one.mouth[2]) for one in seam)
    for view, tip, way, name in (
        (views[0], np.array((beside, 0.0, foot)), (-4.0, -5.0), "A"),
        (views[0], np.array((0.0, 0.0, top)), (-4.0, 5.0), "B"),
        (views[1], dowel.mouth, (8.0, 3.0), "C"),
    ):
        at = view.at(tip)
        yield from leader(at, (at[0] + way[0], at[1] + way[1]), name)


def _words(edges: Point, levels: Point, told: Sequence[tuple[str, str]]) -> Iterator[Entity]:
    """Heads and texts between two edges, below the upper of two levels, as small as they must."""
    width, room = edges[1] - edges[0] - WORDS_MM, levels[1] - levels[0]
    tried = ((height, _wrapped(told, int(width / WIDE / height))) for height in TEXTS_MM)
    height, lines = next(one for one in tried if len(one[1]) * LINE * one[0] <= room)
    for k, (head, text) in enumerate(lines, 1):
        y = levels[1] - k * LINE * height
        yield Text(Layer.DIMENSIONS, (edges[0], y), height, head)
        yield Text(Layer.DIMENSIONS, (edges[0] + WORDS_MM, y), height, text)


def _wrapped(told: Sequence[tuple[str, str]], characters: int) -> list[tuple[str, str]]:
    """Lines of so many characters at most, with the head of each first one."""
    return [
        ("" if k else head, line)
        for head, text in told
        for k, line in enumerate(wrap(text, characters))
    ]


def _title_block(record: dict[str, Any], spec: Spec) -> TitleBlock:
    named = [step["material"]["value"] for step in record["chain"]["steps"] if "material" in step]
    return TitleBlock(
        title=f"Order: shells by {record['chain']['name']}",
        design=f"{spec.name}, n = {spec.optics.n}",
        item="shell_a as drawn; shell_b mirrored at x = 0",
        quantity=len(record["samples"]["mirrors"]),
        material=named[-1] if named else "as agreed with the workshop",
        tolerances="of *_tolerances.step",
    )


def _figure_rows(record: dict[str, Any]) -> list[tuple[str, ...]]:
    """Each figure with its limits and what the chain holds."""
    return [
        (
            f"{one['name']}, {one['unit']}",
            *(ANY if one[key] is None else f"{one[key]:.3g}" for key in ("limit", "statistics")),
            f"{one['chain']:.3g}",
            one["verdict"],
        )
        for one in record["chain"]["figures"]
    ]


def _lines(
    record: dict[str, Any], spec: Spec, holes: Sequence[tuple[str, ...]]
) -> Iterator[tuple[str, str]]:
    """All that is told in words, heads and texts, from order_page.toml; holes are rows."""
    chain, ids = record["chain"], record["samples"]["mirrors"][0]
    fillet, mandrel = chain["figures"][-1], chain["mandrel_cutter_mm"] is not None
    in_statistics = any(one["verdict"] == IN_STATISTICS for one in chain["figures"])
    values = record | {
        "mandrel": mandrel,
        "no mandrel": not mandrel,
        "statistics": in_statistics,
        "spec": spec,
        "allowed": ANY if fillet["limit"] is None else f"{fillet['limit']:.3g} {fillet['unit']}",
        "rounded": f"{fillet['chain']:.3g} {fillet['unit']}",
        "steps": [_step(k, step) for k, step in enumerate(chain["steps"], 1)],
        "rq_uncertainty": UNCERTAINTY_SHARE * record["finish"]["rq_nm"],
        "seat_uncertainty": UNCERTAINTY_SHARE * record["limits"]["seat_um"],
        "holes": ", ".join(
            f"{n} x Ø {size}" for size, n in Counter(row[1] for row in holes).items()
        ),
        "ids": " ".join(ids),
        "count": len(ids),
        "both": 2 * len(ids),
    }
    lines = read_toml(files("tbcad.drawings").joinpath(WORDS), WORDS, "words")["line"]
    for head, text in told(lines, values):
        yield head, drawable(text)


def _step(number: int, step: dict[str, Any]) -> dict[str, Any]:
    facts = [step[key]["value"] for key in ("material", "treatment") if key in step]
    return {"number": number, "words": ": ".join(filter(None, (step["title"], "; ".join(facts))))}

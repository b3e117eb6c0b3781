"""The sheet of an order: on one page what a workshop asks before it makes the shells."""

from collections import Counter
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from tbcad.cad.drafting.sheet import (
    A3,
    BESIDE_MM,
    TABLE_ROW_MM,
    Sheet,
    TitleBlock,
    drawing_room,
    table,
)
from tbcad.cad.formats.entities import Entity, Layer, Point, Text
from tbcad.cad.formats.pdf import drawable, write_pdf
from tbcad.cad.formats.step import read_named_solid
from tbcad.common.told import told
from tbcad.core.spec.csv_rows import read_toml
from tbcad.core.spec.design import Spec
from tbcad.drawings.shell_views import HOLE_HEAD, HOLE_WIDTHS_MM, shell_views
from tbcad.mirror_limits.held import IN_STATISTICS, UNCERTAINTY_SHARE

PREFIX = {"shell_a": "", "mandrel_a": "M"}  # of the numbers of holes
VIEWS_MM = 206.0  # width of views and holes; texts have the rest
BETWEEN_MM, AROUND_MM = 16.0, 10.0  # from view to view, and from the border
WORDS_MM, LINE = 20.0, 1.9  # width of heads, from line to line by the height of texts
TEXTS_MM = np.geomspace(2.5, 1.0, 20).tolist()  # heights of texts, tried in turn
WIDE = 0.72  # of a character by the height of capitals
FIGURE_WIDTHS = (40.0, 20.0, 23.0, 20.0, 75.0)
FIGURE_HEAD = ("figure", "limit", "limit of 2 sigma", "chain, 2 sigma", "verdict")
ANY, WORDS = "any", "order_page.toml"


def write_sheet(folder: Path, export: Path, record: dict[str, Any], spec: Spec) -> None:
    """Write order.pdf."""
    sheet = order_sheet(export, record, spec)
    write_pdf(folder / f"{sheet.name}.pdf", sheet.title, sheet.paper, sheet.entities)


def order_sheet(export: Path, record: dict[str, Any], spec: Spec) -> Sheet:
    """The page by the record of an order, from the solids of camera a in the folder of a build."""
    names = [name for name in PREFIX if f"{name}_tolerances.step" in record["files"]]
    solids = {PREFIX[name]: read_named_solid(export / f"{name}.step").shape for name in names}
    shown = shell_views(solids, VIEWS_MM, BETWEEN_MM, AROUND_MM)
    left, low, right, high = drawing_room(A3)
    edge = left + VIEWS_MM, right - BESIDE_MM
    rows = shown.rows
    figures = [FIGURE_HEAD, *_figure_rows(record)]
    below = high - BESIDE_MM - (len(figures) + 1) * TABLE_ROW_MM
    block = _title_block(record, spec)
    x, y = shown.beside
    drawn = [
        *shown.entities(),
        *table((x + BETWEEN_MM, y), HOLE_WIDTHS_MM, [HOLE_HEAD, *rows]),
        *table((edge[0], high - BESIDE_MM), FIGURE_WIDTHS, figures),
        *_words(edge, (low + BESIDE_MM, below), list(_lines(record, spec, rows))),
    ]
    front = shown.views[0]
    return Sheet.framed(("order", block.item), block, A3, front.scale, front.origin, drawn)


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

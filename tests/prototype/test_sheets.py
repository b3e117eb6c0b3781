"""Sheets: nothing outside the border, no text over another, dimensions that are true."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from tbcad.cad.drafting.dimensions import labels
from tbcad.cad.drafting.sheet import BORDER_MM, LEFT_MM, Sheet
from tbcad.cad.formats.entities import Circle, Dimension, Layer, Line, Text, simple
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.files.bom import PartsList
from tbcad.prototype.frame.driven import WHEEL
from tbcad.prototype.frame.stock import PLATE, UPRIGHT
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.light.lamps import LAMP
from tbcad.prototype.part import FrameLayout, Site
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.registry import PARTS
from tests.sheet_texts import check_texts, covered

LISTED = load_parts()
BILL = PartsList(
    tuple({"item": 41, "quantity": 1, "part": part, "from": "bought"} for part in LISTED),
    "turtleback, n = 18",
)


def sheets(site: Site, frame: FrameLayout) -> dict[str, Sheet]:
    return {sheet.name: sheet for part in PARTS for sheet in part.sheets(site, frame, BILL)}


@pytest.fixture(scope="module")
def drawn(site: Site, frame: FrameLayout) -> dict[str, Sheet]:
    return sheets(site, frame)


def test_what_there_is_not_is_not_drawn(site: Site, frame: FrameLayout) -> None:
    direct = next(one for one in load_drives(LISTED) if one.coupling)
    bare = FrameLayout(tuple(one for one in frame.mounted if not isinstance(one, LampLayout)))
    assert [*sheets(replace(site, drive=direct), bare)] == [PLATE, UPRIGHT]


@pytest.mark.parametrize(("name", "count"), [(PLATE, 2), (WHEEL, 3), (UPRIGHT, 3), (LAMP, 3)])
def test_sheets_are_legible_and_dimensions_true(
    drawn: dict[str, Sheet], name: str, count: int
) -> None:
    """No text over another, no line over the border; sizes at full size, as far as digits go."""
    sheet = drawn[name]
    check_texts(sheet)
    ends = [
        end
        for one in simple(sheet.entities)
        if isinstance(one, Line)
        for end in (one.start, one.end)
    ]
    assert np.min(ends, axis=0)[0] > LEFT_MM
    assert np.max(ends, axis=0)[0] < sheet.paper[0] - BORDER_MM

    found = [one for one in sheet.full_size() if isinstance(one, Dimension)]
    assert len(found) >= count
    for one in found:
        digits = len(one.size.partition(".")[2])
        assert one.measured == pytest.approx(float(one.size), abs=0.5001 * 10.0**-digits)
        assert sum(isinstance(part, Text) for part in one.drawn) == 1


def test_labels_of_near_holes_keep_apart() -> None:
    """Four holes of 4 mm on a square of 6 mm: on one side there is no room."""
    circles = [Circle(Layer.CUT, (x, y), 2.0) for x in (0.0, 6.0) for y in (0.0, 6.0)]
    texts = [one for one in labels(circles, ["1", "2", "3", "4"]) if isinstance(one, Text)]
    for one, two in combinations(map(covered, texts), 2):
        assert one[2] <= two[0] or two[2] <= one[0] or one[3] <= two[1] or two[3] <= one[1]
    for text in texts:
        left, low, right, high = covered(text)
        for circle in circles:
            near = np.clip(circle.centre, (left, low), (right, high))
            assert math.dist(near, circle.centre) >= circle.radius

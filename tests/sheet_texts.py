"""Texts of a sheet: what each covers, and that none meets another or the border."""

import math
from itertools import combinations

import numpy as np

from tbcad.cad.drafting.sheet import BORDER_MM, LEFT_MM, Sheet
from tbcad.cad.formats.entities import Text, simple
from tbcad.cad.formats.pdf import text_width


def texts(sheet: Sheet) -> list[Text]:
    return [one for one in simple(sheet.entities) if isinstance(one, Text)]


def covered(text: Text) -> tuple[float, float, float, float]:
    """What a text covers on paper: left, bottom, right, top."""
    width, turn = text_width(text.text, text.height), math.radians(text.turn_deg)
    back = {"left": 0.0, "centre": 0.5, "right": 1.0}[text.align] * width
    along, up = (math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))
    corners = [
        [text.place[k] + s * along[k] + t * up[k] for k in (0, 1)]
        for s in (-back, width - back)
        for t in (0.0, text.height)
    ]
    (left, low), (right, high) = np.min(corners, axis=0), np.max(corners, axis=0)
    return left, low, right, high


def check_texts(sheet: Sheet) -> None:
    """No text meets another or the border."""
    boxes = [(one.text, covered(one)) for one in texts(sheet)]
    for (text, one), (word, two) in combinations(boxes, 2):
        apart = one[2] <= two[0] or two[2] <= one[0] or one[3] <= two[1] or two[3] <= one[1]
        assert apart, (text, word)
    for text, (left, low, right, high) in boxes:
        assert left > LEFT_MM, text
        assert right < sheet.paper[0] - BORDER_MM, text
        assert BORDER_MM < low < high < sheet.paper[1] - BORDER_MM, text

"""Flat drawings in DXF, read by group codes in plain Python: circles and outlines to be cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats

CUT = "cut"  # the layer of outlines and holes
X, Y, RADIUS, LAYER, NAME = 10, 20, 40, 8, 2  # group codes
MOST_CIRCLES = 1000
SAME_MM = 1e-6

Entity = dict[int, list[str]]


@dataclass(frozen=True)
class FlatDrawing:
    """What a DXF says is to be cut.

    Attributes:
        circles: (N, 3) x, y and radius, mm.
        corners: (M, 2) of the outlines.
    """

    circles: Floats
    corners: Floats


def read_dxf(text: str) -> FlatDrawing:
    """Circles and outlines on the layer to be cut.

    Raises:
        Unknown: it is no DXF, or has too many circles.
    """
    cut = [one for one in dxf_entities(text) if one.get(LAYER) == [CUT]]
    circles = [
        [float(one[code][0]) for code in (X, Y, RADIUS)] for one in cut if one[0] == ["CIRCLE"]
    ]
    if len(circles) > MOST_CIRCLES:
        raise Unknown(f"a drawing has {len(circles)} circles")
    corners = [
        [float(x), float(y)]
        for one in cut
        if one[0] == ["LWPOLYLINE"]
        for x, y in zip(one[X], one[Y], strict=True)
    ]
    return FlatDrawing(np.array(circles).reshape(-1, 3), np.array(corners).reshape(-1, 2))


def dxf_entities(text: str) -> list[Entity]:
    """Entities of a DXF, the values of each by group code.

    Raises:
        Unknown: it is no DXF.
    """
    lines = [line.strip() for line in text.splitlines()]
    try:
        codes = [int(line) for line in lines[::2]]
        pairs = list(zip(codes, lines[1::2], strict=True))
        begin = pairs.index((NAME, "ENTITIES"))
        end = pairs.index((0, "ENDSEC"), begin)
    except ValueError:
        raise Unknown("a drawing is no DXF") from None
    found: list[Entity] = []
    for code, value in pairs[begin + 1 : end]:
        if code == 0:
            found.append({})
        if found:
            found[-1].setdefault(code, []).append(value)
    return found

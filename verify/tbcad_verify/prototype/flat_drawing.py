"""Flat drawings in DXF, read by group codes in plain Python: circles and outlines to be cut.

Another unit, or a layer that tbcad does not draw on, is refused: who cuts may take it for a cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats

CUT = "cut"  # the layer of outlines and holes
LAYERS = frozenset({CUT, "fold", "centre", "dimensions", "frame"})
X, Y, RADIUS, LAYER, NAME, VARIABLE, VALUE = 10, 20, 40, 8, 2, 9, 70  # group codes
MILLIMETRES = "4"
MOST_CIRCLES = 1000
SAME_MM = 1e-6

Entity = dict[int, list[str]]


@dataclass(frozen=True)
class FlatDrawing:
    """What a DXF says is to be cut."""

    circles: Floats  # (N, 3) x, y and radius, mm
    corners: Floats  # (M, 2) of the outlines


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
        Unknown: it is no DXF, in another unit than millimetres, or on a layer of another name.
    """
    lines = [line.strip() for line in text.splitlines()]
    try:
        codes = [int(line) for line in lines[::2]]
        pairs = list(zip(codes, lines[1::2], strict=True))
        begin = pairs.index((NAME, "ENTITIES"))
        end = pairs.index((0, "ENDSEC"), begin)
    except ValueError:
        raise Unknown("a drawing is no DXF") from None
    unit = [k for k, pair in enumerate(pairs) if pair == (VARIABLE, "$INSUNITS")]
    if [pairs[k + 1] for k in unit] != [(VALUE, MILLIMETRES)]:
        raise Unknown("a drawing is not in millimetres")
    found: list[Entity] = []
    for code, value in pairs[begin + 1 : end]:
        if code == 0:
            found.append({})
        if found:
            found[-1].setdefault(code, []).append(value)
    if others := {layer for one in found for layer in one.get(LAYER, ())} - LAYERS:
        raise Unknown(f"a drawing has a layer {min(others)}")
    return found

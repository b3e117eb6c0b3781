"""Numbers in relief, made of squares: no font, so the same shape on every computer."""

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepTools import BRepTools
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

from tbcad.cad.kernel.solids import moved, polygon, prism
from tbcad.types import Floats

Corner = tuple[int, int]

ROWS = 5
# Squares that touch by a corner alone would not be a solid: no sign has such a pair.
SIGNS = {
    "0": ("###", "# #", "# #", "# #", "###"),
    "1": ("## ", " # ", " # ", " # ", "###"),
    "2": ("###", "  #", "###", "#  ", "###"),
    "3": ("###", "  #", "###", "  #", "###"),
    "4": ("# #", "# #", "###", "  #", "  #"),
    "5": ("###", "#  ", "###", "  #", "###"),
    "6": ("###", "#  ", "###", "# #", "###"),
    "7": ("###", "  #", "  #", "  #", "  #"),
    "8": ("###", "# #", "###", "# #", "###"),
    "9": ("###", "# #", "###", "  #", "###"),
    "S": ("###", "#  ", "###", "  #", "###"),
    "+": ("   ", " # ", "###", " # ", "   "),
    "-": ("   ", "   ", "###", "   ", "   "),
    ".": (" ", " ", " ", " ", "#"),
}
GAP = 1  # squares between signs


def text_width(text: str) -> int:
    """Width of a text in squares."""
    return sum(len(SIGNS[sign][0]) + GAP for sign in text) - GAP


def relief(
    text: str, height: float, raised: float, sunk: float, axes: Floats, at: Floats
) -> list[TopoDS_Shape]:
    """Solids of a text of the signs above, of a height (mm), about a point of a plane face (3,).

    They are raised above the face and sunk into the part by lengths, mm; rows of axes (3, 3) are to
    the right, up and out of the face.
    """
    square, start, solids = height / ROWS, -text_width(text) / 2, []
    for sign in text:
        face = _face(SIGNS[sign], start, square, sunk)
        solids.append(moved(prism(face, np.array([0.0, 0.0, raised + sunk])), axes, at))
        start += len(SIGNS[sign][0]) + GAP
    return solids


def fitting_height(text: str, height: float, radius: float) -> float:
    """Largest height, mm, up to a limit at which a text fits in a circle of a radius, mm."""
    half_diagonal = float(np.hypot(text_width(text), ROWS)) / ROWS / 2
    return min(height, radius / half_diagonal)


def _face(rows: tuple[str, ...], start: float, square: float, sunk: float) -> TopoDS_Face:
    """Face of one sign on z = -sunk: one outer loop, and the loops of its holes."""
    outer: list[Floats] = []
    holes: list[Floats] = []
    shift = np.array([start, -ROWS / 2])
    for loop in loops(rows):
        place = (np.array(loop, dtype=float) + shift) * square
        points = np.column_stack([place, np.full(len(place), -sunk)])
        (outer if _area(place) > 0 else holes).append(points)
    (outline,) = outer
    face = BRepBuilderAPI_MakeFace(polygon(outline))
    for hole in holes:
        face.Add(TopoDS.Wire_s(BRepTools.OuterWire_s(polygon(hole[::-1])).Reversed()))
    return face.Face()


def _area(points: Floats) -> float:
    x, y = points.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def loops(rows: tuple[str, ...]) -> list[list[Corner]]:
    """Corners of the outlines of a sign's squares: the outer to the left, holes to the right."""
    sides, outlines = _border(rows), []
    while sides:
        start = corner = min(sides)
        loop = []
        while corner in sides:
            loop.append(corner)
            corner = sides.pop(corner)
        assert corner == start
        outlines.append(_corners(loop))
    return outlines


def _border(rows: tuple[str, ...]) -> dict[Corner, Corner]:
    """Sides of squares that no other square shares, each from its start to its end."""
    filled = {
        (x, ROWS - 1 - y) for y, row in enumerate(rows) for x, sign in enumerate(row) if sign == "#"
    }
    border: dict[Corner, Corner] = {}
    for x, y in sorted(filled):
        sides = {
            (x, y - 1): ((x, y), (x + 1, y)),
            (x + 1, y): ((x + 1, y), (x + 1, y + 1)),
            (x, y + 1): ((x + 1, y + 1), (x, y + 1)),
            (x - 1, y): ((x, y + 1), (x, y)),
        }
        border |= {start: end for other, (start, end) in sides.items() if other not in filled}
    return border


def _corners(loop: list[Corner]) -> list[Corner]:
    """A loop without the points at which it goes straight on."""
    turns = []
    for k, (x, y) in enumerate(loop):
        before, after = loop[k - 1], loop[(k + 1) % len(loop)]
        if (x - before[0], y - before[1]) != (after[0] - x, after[1] - y):
            turns.append((x, y))
    return turns

"""Numbers in relief, made of squares: no font, so the same shape on every computer."""

import numpy as np
from manifold3d import CrossSection, OpType
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
STRAIGHT = 0.1  # corners less off the line of their neighbours than this are none


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
    squares = [
        CrossSection.square((1, 1)).translate((x, ROWS - 1 - y))
        for y, row in enumerate(rows)
        for x, sign in enumerate(row)
        if sign == "#"
    ]
    found = []
    for outline in CrossSection.batch_boolean(squares, OpType.Add).simplify(STRAIGHT).to_polygons():
        corners = [(round(x), round(y)) for x, y in outline.tolist()]
        first = corners.index(min(corners))
        found.append(corners[first:] + corners[:first])
    return sorted(found)

"""Numbers in relief, from squares: no font, so the same shape on every machine."""

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepTools import BRepTools
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

from tbcad.cad.solids import moved, polygon, prism
from tbcad.types import Floats

Step = tuple[int, int]

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
SPACE = 1  # squares between signs


def text_width(text: str) -> int:
    """Squares across a text."""
    return sum(len(SIGNS[sign][0]) + SPACE for sign in text) - SPACE


def relief(
    text: str, height: float, raised: float, sunk: float, axes: Floats, at: Floats
) -> list[TopoDS_Shape]:
    """Solids of a text about a point of a plane face.

    Args:
        text: of the signs above.
        height: of the signs, mm.
        raised: how far they stand out of the face, mm.
        sunk: how far they reach into the part, mm.
        axes: rows to the right, up and out of the face, (3, 3).
        at: middle of the text on the face, mm, (3,).
    """
    square, start, found = height / ROWS, -text_width(text) / 2, []
    for sign in text:
        for face in _faces(SIGNS[sign], start, square, sunk):
            solid = prism(face, np.array([0.0, 0.0, raised + sunk]))
            found.append(moved(solid, axes, at))
        start += len(SIGNS[sign][0]) + SPACE
    return found


def fitting_height(text: str, height: float, radius: float) -> float:
    """Height at which a text, no higher than this, fits in a circle of a radius (mm)."""
    reach = float(np.hypot(text_width(text), ROWS)) / ROWS / 2
    return min(height, radius / reach)


def _faces(rows: tuple[str, ...], start: float, square: float, sunk: float) -> list[TopoDS_Face]:
    """Faces of one sign on z = -sunk: one outer loop, and the loops of its holes."""
    outer: list[Floats] = []
    holes: list[Floats] = []
    shift = np.array([start, -ROWS / 2])
    for loop in loops(rows):
        place = (np.array(loop, dtype=float) + shift) * square
        points = np.column_stack([place, np.full(len(place), -sunk)])
        (outer if _area(place) > 0 else holes).append(points)
    (line,) = outer
    made = BRepBuilderAPI_MakeFace(polygon(line))
    for hole in holes:
        made.Add(TopoDS.Wire_s(_wire(hole)))
    return [made.Face()]


def _wire(points: Floats) -> TopoDS_Shape:
    return BRepTools.OuterWire_s(polygon(points[::-1])).Reversed()


def _area(points: Floats) -> float:
    x, y = points.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def loops(rows: tuple[str, ...]) -> list[list[Step]]:
    """Corners of the outlines of a sign's squares: the outer to the left, holes to the right."""
    follow = _border(rows)
    found = []
    while follow:
        start = at = min(follow)
        loop = []
        while at in follow:
            loop.append(at)
            at = follow.pop(at)
        assert at == start
        found.append(_corners(loop))
    return found


def _border(rows: tuple[str, ...]) -> dict[Step, Step]:
    """Sides of squares that no other square shares, each from its start to its end."""
    filled = {
        (x, ROWS - 1 - y) for y, row in enumerate(rows) for x, sign in enumerate(row) if sign == "#"
    }
    follow: dict[Step, Step] = {}
    for x, y in sorted(filled):
        sides = {
            (x, y - 1): ((x, y), (x + 1, y)),
            (x + 1, y): ((x + 1, y), (x + 1, y + 1)),
            (x, y + 1): ((x + 1, y + 1), (x, y + 1)),
            (x - 1, y): ((x, y + 1), (x, y)),
        }
        follow |= {start: end for other, (start, end) in sides.items() if other not in filled}
    return follow


def _corners(loop: list[Step]) -> list[Step]:
    """A loop without the points at which it goes straight on."""
    turns = []
    for k, (x, y) in enumerate(loop):
        before, after = loop[k - 1], loop[(k + 1) % len(loop)]
        if (x - before[0], y - before[1]) != (after[0] - x, after[1] - y):
            turns.append((x, y))
    return turns

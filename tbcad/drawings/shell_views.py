"""Shells and their negatives in three sections: numbered holes, their table, datums."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from tbcad.cad.drafting.dimensions import labels, leader
from tbcad.cad.drafting.sheet import A3, drawing_room, placed
from tbcad.cad.drafting.views import Curve, Shape, View, section, straight
from tbcad.cad.formats.entities import Circle, Entity, Layer, Line, Point, Text
from tbcad.cad.kernel.features import round_faces
from tbcad.cad.kernel.solids import faces
from tbcad.drawings.tables import HEAD, VIEWS, WIDTHS_MM, DrawnHole, numbered_holes, table_rows
from tbcad.types import Floats

NAMES = {"A": "A, section y = 0", "B": "B, section of the foot", "C": "C, section of the seam"}
NAME_MM, NAME_OFF_MM = 2.0, 9.0  # height of a view's name and its place below
SCALES = (2.0, 1.0, 0.5, 0.4, 0.2, 0.1)
HATCH_MM = 2.0  # from line to line, on paper, at 45 degrees (ISO 128-3)
UP_DEG = 45.0
HOLE_HEAD, HOLE_WIDTHS_MM = HEAD[:-1], WIDTHS_MM[:-1]
Holes = list[tuple[str, DrawnHole]]
Cut = list[tuple[Curve, ...]]
"""What a view cuts of each solid, in mm of the part."""


@dataclass(frozen=True)
class ShellViews:
    """The sections of solids that are drawn as one, the first of them hatched."""

    views: tuple[View, ...]  # from the front, from above, from the left
    cuts: tuple[Cut, ...]  # of each view
    holes: tuple[Holes, ...]  # of each solid, with their numbers
    box: Floats  # what is shown, mm, (2, 3)

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Rows of the table of holes below HOLE_HEAD."""
        return [row[:-1] for named in chain(*self.holes) for row in table_rows(*named)]

    @property
    def beside(self) -> Point:
        """The upper right corner of the view from above, on paper."""
        return self.views[1].at(self.box[1])

    def entities(self) -> Iterator[Entity]:
        """The views, and leaders to the datums of the first solid."""
        numbered = list(chain(*self.holes))
        for view, cut, letter in zip(self.views, self.cuts, VIEWS, strict=True):
            yield from _drawn(view, cut, letter, numbered)
        yield from _datums(self.views, self.holes[0])


def shell_views(
    shapes: Mapping[str, Shape], width: float, between: float, around: float
) -> ShellViews:
    """Three sections on A3, from its left border on, at the largest scale with room for all.

    shapes: by what the numbers of their holes begin with. width: of views and table, mm; between:
    from view to view; around: from the border.
    """
    numbered = [numbered_holes(round_faces(faces(shape)), ()) for shape in shapes.values()]
    cuts = tuple(_cut(letter, list(shapes.values()), numbered) for letter in VIEWS)
    named = tuple(
        [(prefix + number, hole) for number, hole in of_solid]
        for prefix, of_solid in zip(shapes, numbered, strict=True)
    )
    box = _shown(cuts)
    return ShellViews(_views(box, width, between, around), cuts, named, box)


def _cut(letter: str, shapes: Sequence[Shape], holes: Sequence[Holes]) -> Cut:
    """What a view cuts: the plane y = 0, or the middle of holes that are round in it."""
    cut, axes = [], VIEWS[letter]
    for shape, numbered in zip(shapes, holes, strict=True):
        seen = (hole.cylinder for _, hole in numbered if hole.view == letter)
        level = next((float(axes[2] @ (one.start + one.end) / 2) for one in seen), 0.0)
        cut.append(section(shape, axes, level))
    return cut


def _shown(cuts: Sequence[Cut]) -> Floats:
    """Least and greatest x, y, z of what the views show, mm, (2, 3)."""
    front, above, side = (
        np.array([straight(one for solid in cut for one in solid)]).reshape(-1, 2) for cut in cuts
    )
    along = (
        np.concatenate([front[:, 0], above[:, 0]]),
        np.concatenate([-side[:, 0], above[:, 1]]),
        np.concatenate([front[:, 1], side[:, 1]]),
    )
    return np.array([[one.min() for one in along], [one.max() for one in along]])


def _views(box: Floats, width: float, between: float, around: float) -> tuple[View, ...]:
    left, low, _, high = drawing_room(A3)
    wide, deep, tall = (box[1] - box[0]).tolist()
    spare = between + 2 * around
    rooms = (
        (width - spare) / (wide + deep),
        (high - low - spare) / (tall + deep),
        (width - spare - sum(HOLE_WIDTHS_MM)) / wide,
    )
    scale = next((one for one in SCALES if one <= min(rooms)), SCALES[-1])
    (x0, _, z0), (x1, y1, z1) = (scale * box).tolist()
    x, y = left + around - x0, high - around - z1
    places = ((x, y), (x, y + z0 - between - y1), (x + x1 + between + y1, y))
    return tuple(View(axes, at, scale) for axes, at in zip(VIEWS.values(), places, strict=True))


def _drawn(
    view: View, cut: Cut, letter: str, holes: Sequence[tuple[str, DrawnHole]]
) -> Iterator[Entity]:
    """What a view cuts, the first solid hatched, its name, and the numbers of its holes."""
    shell, *others = (placed(entities, view.origin, view.scale) for entities in cut)
    yield from (*shell, *hatching(shell), *chain.from_iterable(others))
    x, y = np.array(straight(shell)).reshape(-1, 2).min(axis=0).tolist()
    yield Text(Layer.DIMENSIONS, (x, y - NAME_OFF_MM), NAME_MM, NAMES[letter])
    shown = [(number, one) for number, one in holes if one.view == letter]
    circles = [
        Circle(Layer.CUT, view.at(one.mouth), view.scale * one.cylinder.radius) for _, one in shown
    ]
    yield from labels(circles, [number for number, _ in shown], straight(chain(shell, *others)))


def _datums(views: Sequence[View], holes: Holes) -> Iterator[Entity]:
    """Leaders to A, the foot plane, B, the seam plane, and C, a dowel hole of the foot."""
    feet, seam = ([one for _, one in holes if one.view == letter] for letter in "BC")
    back = min(feet, key=lambda one: abs(one.mouth[1]))
    dowel = min(feet, key=lambda one: (round(one.cylinder.radius, 6), -one.mouth[1]))
    side = math.copysign(1.0, back.mouth[0])  # b is a's mirror image
    beside = float(back.mouth[0]) - side * 2 * back.cylinder.radius
    foot = min(float(one[2]) for one in (back.cylinder.start, back.cylinder.end))
    top = max(float(one.mouth[2]) for one in seam)
    for view, tip, way, name in (
        (views[0], np.array((beside, 0.0, foot)), (-4.0 * side, -5.0), "A"),
        (views[0], np.array((0.0, 0.0, top)), (-4.0 * side, 5.0), "B"),
        (views[1], dowel.mouth, (8.0 * side, 3.0), "C"),
    ):
        at = view.at(tip)
        yield from leader(at, (at[0] + way[0], at[1] + way[1]), name)


def hatching(outline: Sequence[Entity]) -> list[Entity]:
    """Lines at 45 degrees inside closed outlines, by where each crosses them (even-odd rule)."""
    pieces = np.array(straight(outline)).reshape(-1, 2, 2)
    turn = math.radians(UP_DEG)
    along = np.array([math.cos(turn), math.sin(turn)])
    up = np.array([-math.sin(turn), math.cos(turn)])
    s, t = pieces @ along, pieces @ up
    first = math.ceil(t.min() / HATCH_MM) if len(pieces) else 0
    last = math.floor(t.max() / HATCH_MM) if len(pieces) else -1
    lines: list[Entity] = []
    for k in range(first, last + 1):
        level = (k + 1e-6) * HATCH_MM  # off corners on round places
        crossed = (t[:, 0] < level) != (t[:, 1] < level)
        share = (level - t[crossed, 0]) / (t[crossed, 1] - t[crossed, 0])
        places = np.sort(s[crossed, 0] + share * (s[crossed, 1] - s[crossed, 0]))
        for a, b in zip(places[::2], places[1::2], strict=False):
            (x, y), (right, high) = ((at * along + level * up).tolist() for at in (a, b))
            lines.append(Line(Layer.HATCH, (x, y), (right, high)))
    return lines

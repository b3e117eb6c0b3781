"""The sheet of a shell or its negative: a section, and where its mirrors are listed."""

import math
from collections.abc import Sequence

import numpy as np

from tbcad.cad.drafting.dimensions import across, upward
from tbcad.cad.drafting.sheet import A3, Sheet, TitleBlock, choose_scale, drawing_room, placed
from tbcad.cad.drafting.views import FRONT, section, straight
from tbcad.cad.formats.entities import Circle, Entity, Layer, Line, Point
from tbcad.cad.formats.step import read_named_solid
from tbcad.drawings.export import DrawnExport
from tbcad.drawings.tables import mm
from tbcad.records.design import MandrelRecord
from tbcad.types import Floats

SCALES = (5.0, 2.0, 1.0, 0.5, 0.4, 0.2, 0.1)
AROUND_MM, LENGTH_MM, DOT_MM = 25.0, 10.0, 0.6
HATCH_MM = 2.0  # from line to line, on paper, at 45 degrees (ISO 128-3)
UP_DEG = 45.0


def draw_shell(export: DrawnExport, name: str) -> list[Sheet]:
    """The sheet of a shell or a negative. InputError: its file is not as it was written."""
    step = f"{name}.step"
    block = TitleBlock(
        title=name.replace("_", " "),
        design=export.title,
        item=name,
        quantity=1,
        material="by process",
        view="section y = 0",
        tolerances="of tbcad order",
    )
    flat = section(read_named_solid(export.file(step)).shape, FRONT, 0.0)
    points = np.array(straight(flat)).reshape(-1, 2)
    low, high = points.min(axis=0), points.max(axis=0)
    left, bottom, right, top = drawing_room(A3)
    least, most = np.minimum(low, 0.0), np.maximum(high, 0.0)  # with the origin
    room = right - left - 2 * AROUND_MM, top - bottom - 2 * AROUND_MM
    scale = choose_scale((most - least).tolist(), room, SCALES)
    x, y = ((most + least) / 2).tolist()
    origin = (left + right) / 2 - scale * x, (bottom + top) / 2 - scale * y
    outline = placed(flat, origin, scale)
    drawn = [
        *hatching(outline),
        *outline,
        Circle(Layer.DIMENSIONS, origin, DOT_MM),
        *_lengths(low, high, origin, scale),
    ]
    words = (*_notes(export, name), *export.source(step))
    return [Sheet.framed((name, name), block, A3, scale, origin, drawn, words)]


def _notes(export: DrawnExport, name: str) -> tuple[str, ...]:
    spec, camera = export.design.spec, name[-1]
    for record in export.design.mandrels:
        if record.name == name:
            coat = spec.mirrors.coating_um
            return (
                f"Negative of shell_{camera}. Concave mirrors, of the same names: centres and "
                "radii, the",
                f"latter with the coat of {coat:g} um, in mirrors.csv (camera {camera}).",
                _release(record),
                "x = 0 and z = foot flat; blind holes. Dot: O, centre of the capture sphere.",
            )
    return (
        f"Wall {spec.shell.wall_mm:g} mm behind the deepest valley of the mirrors.",
        f"Mirrors: centres and radii in mirrors.csv (camera {camera}); limits of each in",
        f"inspection_{camera}.csv and {name}_tolerances.step, by tbcad order.",
        "Mirror side polished and coated. Dot: O, centre of the capture sphere.",
    )


def _release(record: MandrelRecord) -> str:
    if record.draft_deg < 0:
        return "Undercut: the shell cannot be drawn off; dissolve the mandrel, or melt it out."
    pull = " ".join(f"{one + 0.0:.3f}" for one in record.pull)
    return f"The shell is drawn along ({pull}), draft {record.draft_deg:.1f} degrees."


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


def _lengths(low: Floats, high: Floats, origin: Point, scale: float) -> list[Entity]:
    """Width and height of the section, and its lowest and highest level from the origin."""
    (left, bottom), (right, top) = (
        (origin[0] + scale * float(x), origin[1] + scale * float(y)) for x, y in (low, high)
    )
    width, height = (high - low).tolist()
    return [
        across((left, top), (right, top), top + LENGTH_MM, mm(width)),
        upward((right, bottom), (right, top), right + LENGTH_MM, mm(height)),
        upward(origin, (left, top), left - LENGTH_MM, mm(float(high[1]))),
    ]

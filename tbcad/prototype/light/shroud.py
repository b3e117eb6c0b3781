"""The shroud: a box of matt black card round the whole rig, and the pattern of its panels.

Floor and lid cover the walls' edges; front and back stand between the sides. Flaps along the edges
of front, back and right side are folded inward by 90 degrees and glued.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from tbcad.cad.formats.entities import Entity, Layer, Line, Polyline, Text
from tbcad.core.geometry.primitives import Component, Primitive, box, enclosing_triangles
from tbcad.core.geometry.rotations import even_angles, rotated, unit_circle
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import LightSpec
from tbcad.core.spec.section import AUTO
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.part import Part
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, of_kind
from tbcad.types import Floats

FLAP_MM, FLAP_SLOPE_MM = 15.0, 5.0  # width of a flap, and by how much its ends slope inward
# Width and height of the notch for cables, in the lower edge of the back.
NOTCH_MM = (40.0, 15.0)
TEXT_MM = 8.0
SWING_STEP_RAD = np.radians(3.0)
BALL_SIDES = 24  # of a polygon round a ball
PREFIX = "shroud_"

Ranges: TypeAlias = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Panel:
    """One piece of card: a rectangle with flaps."""

    component: Component  # in its place, without flaps
    size: tuple[float, float]  # width and height as drawn, mm
    flaps: tuple[str, ...] = ()  # edges that have one: "left", "right", "top"
    notched: bool = False  # whether cables go out through its lower edge

    @property
    def name(self) -> str:
        """Of the panel and of its pattern."""
        return self.component.name

    @property
    def cut_size(self) -> tuple[float, float]:
        """Width and height with flaps, mm."""
        wide = self.size[0] + FLAP_MM * sum(flap in self.flaps for flap in ("left", "right"))
        return wide, self.size[1] + FLAP_MM * ("top" in self.flaps)


@dataclass(frozen=True)
class ShroudLayout:
    """The panels, and the sheets they are cut from."""

    panels: tuple[Panel, ...]
    sheet: PurchasedPart
    sheets: int


def shroud_layout(
    light: LightSpec, static: Iterable[Component], keep_out: KeepOut, floor: float, parts: Parts
) -> ShroudLayout | None:
    """The shroud round static parts and what the base sweeps; the floor is z of the plate's foot.

    None without, also where "auto" finds no sheet large enough.

    SpecError when the spec asks for one and no sheet is large enough.
    """
    if light.shroud is False:
        return None
    bodies = [body for component in static for body in component.added]
    low, high = _reach(bodies, keep_out)
    low, high = low - light.shroud_gap_mm, high + light.shroud_gap_mm
    low[2] = floor
    sheets = of_kind(parts, "sheets")
    panels = [_panels(low, high, sheet) for sheet in sheets]
    fitting = [
        (sheet, some)
        for sheet, some in zip(sheets, panels, strict=True)
        if max(max(panel.cut_size) for panel in some) <= sheet["length_mm"]
        and max(min(panel.cut_size) for panel in some) <= min(sheet["width_mm"], sheet["length_mm"])
    ]
    if not fitting:
        if light.shroud == AUTO:
            return None
        largest = max(max(panel.cut_size) for panel in panels[0])
        raise SpecError(
            f"no sheet in sheets.csv is large enough for the shroud's panel of {largest:.0f} mm: "
            "set prototype.light.shroud to false or auto"
        )
    sheet, chosen = min(fitting, key=lambda pair: pair[0]["length_mm"] * pair[0]["width_mm"])
    return ShroudLayout(chosen, sheet, _sheets(chosen, sheet))


def pattern(panel: Panel, sheet: PurchasedPart) -> list[Entity]:
    """Cuts and folds of a panel, its lower left corner at the origin, seen from inside."""
    (width, height), folds = panel.size, []
    corners: list[tuple[float, float]] = [(0.0, 0.0)]
    if panel.notched:
        half, deep = NOTCH_MM[0] / 2, NOTCH_MM[1]
        corners += [
            *((width / 2 - half, 0.0), (width / 2 - half, deep)),
            *((width / 2 + half, deep), (width / 2 + half, 0.0)),
        ]
    edges = {
        "right": ((width, 0.0), (width, height), (FLAP_MM, 0.0)),
        "top": ((width, height), (0.0, height), (0.0, FLAP_MM)),
        "left": ((0.0, height), (0.0, 0.0), (-FLAP_MM, 0.0)),
    }
    for name, (start, end, out) in edges.items():
        corners.append(start)
        if name in panel.flaps:
            along = FLAP_SLOPE_MM * np.sign(np.subtract(end, start))
            corners += [
                (start[0] + out[0] + along[0], start[1] + out[1] + along[1]),
                (end[0] + out[0] - along[0], end[1] + out[1] - along[1]),
            ]
            folds.append(Line(Layer.FOLD, start, end))
    note = f"{panel.name}: {width:.1f} x {height:.1f} mm, {sheet['thickness_mm']:g} mm card"
    outline = tuple((float(x) + 0.0, float(y) + 0.0) for x, y in corners)
    text = Text(Layer.DIMENSIONS, (width / 2, height / 2), TEXT_MM, note, "centre")
    return [Polyline(Layer.CUT, outline), *folds, text]


def _panels(low: Floats, high: Floats, sheet: PurchasedPart) -> tuple[Panel, ...]:
    """Six panels round the box between two corners (3,)."""
    thick = sheet["thickness_mm"]
    (x0, y0, z0), (x1, y1, z1) = low.tolist(), high.tolist()
    out_x, out_y = (x0 - thick, x1 + thick), (y0 - thick, y1 + thick)
    in_y, up = (y0, y1), (z0, z1)
    back, front = (x0 - thick, x0), (x1, x1 + thick)
    right, left = (y0 - thick, y0), (y1, y1 + thick)
    middle, half = (y0 + y1) / 2, NOTCH_MM[0] / 2
    end = back[1] + 1.0, middle + half, z0 + NOTCH_MM[1]
    notch = (box((back[0] - 1.0, middle - half, z0 - 1.0), end),)
    flaps = ("left", "right", "top")
    return (
        _panel("floor", "floor of the shroud below the plate", (out_x, out_y, (z0 - thick, z0))),
        _panel("lid", "lid of the shroud", (out_x, out_y, (z1, z1 + thick))),
        _panel("front", "wall of the shroud behind the camera", (front, in_y, up), flaps),
        _panel("back", "wall of the shroud behind the uprights", (back, in_y, up), flaps, notch),
        _panel("left", "wall of the shroud that comes off", (out_x, left, up)),
        _panel("right", "wall of the shroud opposite", (out_x, right, up), ("top",)),
    )


def _panel(
    name: str,
    what: str,
    ranges: Ranges,
    flaps: tuple[str, ...] = (),
    notch: tuple[Primitive, ...] = (),
) -> Panel:
    """A panel that fills ranges of x, y and z."""
    low, high = np.array(ranges).T
    component = Component(PREFIX + name, what, (box(low, high),), notch)
    width, height = np.delete(high - low, np.argmin(high - low)).tolist()
    return Panel(component, (width, height), flaps, bool(notch))


def _sheets(panels: Iterable[Panel], sheet: PurchasedPart) -> int:
    """Sheets that the panels need, in rows across the sheet, the highest first."""
    length, width = sheet["length_mm"], sheet["width_mm"]
    free: list[float] = []  # width left of each row, and length left of each sheet
    rows: list[tuple[float, float]] = []  # height and width left of each row
    for wide, high in sorted((sorted(panel.cut_size) for panel in panels), reverse=True):
        # The shorter side along the sheet's length, the longer one across it where that fits.
        along, across = (wide, high) if high <= width else (high, wide)
        for k, (row, left) in enumerate(rows):
            if along <= row and across <= left:
                rows[k] = row, left - across
                break
        else:
            rows.append((along, width - across))
            place = next((k for k, left in enumerate(free) if along <= left), None)
            if place is None:
                free.append(length - along)
            else:
                free[place] -= along
    return len(free)


def _reach(bodies: Iterable[Primitive], keep_out: KeepOut) -> tuple[Floats, Floats]:
    """Corners (3,) of the upright box round bodies and what the base sweeps."""
    outline = unit_circle(even_angles(BALL_SIDES)) / np.cos(np.pi / BALL_SIDES)
    points = [enclosing_triangles(body).reshape(-1, 3) for body in bodies]
    for (z, r), radius, (first, last) in zip(
        keep_out.centre, keep_out.radius, keep_out.swung, strict=True
    ):
        circle = np.array([z, r]) + radius * outline
        points.append(_swept(keep_out, circle, first, last))
    for section in keep_out.sections:
        points.append(_swept(keep_out, section.polygon, section.low, section.high))
    every = np.vstack(points)
    return every.min(axis=0), every.max(axis=0)


def _swept(keep_out: KeepOut, section: Floats, first: float, last: float) -> Floats:
    """Points (n, 3) round a section (p, 2) of (z, r) that turns about the axis."""
    steps = 1 + int(np.ceil((last - first) / SWING_STEP_RAD))
    angle = np.linspace(first, last, steps)
    axis, zero, _ = keep_out.frame
    r = section[:, 1:] / np.cos(SWING_STEP_RAD / 2)
    upright = section[:, :1] * axis + r * zero
    return np.asarray(rotated(upright[:, None], axis, angle[None]).reshape(-1, 3))


@planned("Shroud", "shroud_*", loose=("sheets",))
def shroud_step(machine: AssembledMachine) -> Values:
    """The box of card."""
    box = machine.record.shroud
    assert box is not None
    return {"panels": [{"one": one} for one in box.panels]}


SHROUD = Part((shroud_step,))

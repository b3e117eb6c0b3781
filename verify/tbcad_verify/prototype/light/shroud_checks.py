"""The shroud: a closed box of card round everything, and patterns that fold to its panels."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.bodies import NOT_BODIES
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.flat_drawing import CUT, X, Y, dxf_entities
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype_sections import Panel, Shroud
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, short_list
from tbcad_verify.step.solids_text import TextSolid
from tbcad_verify.types import Floats

LAYER, FOLD = 8, "fold"
END_X, END_Y = 11, 21  # group codes of a line's end
FLAP_MM = 15.0  # width of a flap
FLAPS = {"shroud_front": 3, "shroud_back": 3, "shroud_right": 1}  # folds of panels that have any
PREFIX = "shroud_"
SAME_MM = 1e-6
SINGLE_MM = 2e-3  # of the GLB's single precision
SHEET = re.compile(r"CARD-(\d+)x(\d+)x(\d+)")
CHECKS = {"shroud": "faults"}


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    drawn: Mapping[str, Shape],
    solids: Mapping[str, TextSolid],
) -> list[Check]:
    """Panels against the assembly, patterns against panels, and all bodies inside."""
    shroud = context.prototype.shroud
    if shroud is None:
        asked = context.export.spec.prototype.light.shroud is True
        return [at_most(names[0], float(asked), 0, "the spec has a shroud, the record has none")]
    faults = [*_faults(context, shroud, drawn, solids)]
    return [at_most(names[0], len(faults), 0, short_list(faults))]


def _faults(
    context: PrototypeContext,
    shroud: Shroud,
    drawn: Mapping[str, Shape],
    solids: Mapping[str, TextSolid],
) -> Iterator[str]:
    sheet = SHEET.fullmatch(shroud.sheet)
    if not sheet:
        yield f"{shroud.sheet} is no sheet of card"
        return
    length, width, thick = (float(size) for size in sheet.groups())
    boxes: dict[str, Floats] = {}
    for panel in shroud.panels:
        if panel.name not in solids:
            raise Unknown(f"the assembly has no {panel.name}")
        corners = solids[panel.name].corners
        boxes[panel.name] = np.stack([corners.min(axis=0), corners.max(axis=0)])
        yield from _panel_faults(context, panel, boxes[panel.name], thick, (length, width))
    if shroud.sheets * length * width < sum(_area(panel) for panel in shroud.panels):
        yield f"{shroud.sheets} sheets are too few"
    yield from _box_faults(context, boxes, drawn, thick)


def _area(panel: Panel) -> float:
    return float(np.prod(panel.size))


def _panel_faults(
    context: PrototypeContext,
    panel: Panel,
    box: Floats,
    thick: float,
    sheet: tuple[float, float],
) -> Iterator[str]:
    """One panel's size, and its pattern: outline less flaps, and folds on the panel's edges."""
    sides = np.sort(box[1] - box[0])
    size = np.array(panel.size)
    if np.abs(sides - np.sort([thick, *size])).max() > SAME_MM:
        yield f"{panel.name} is drawn {sides[1]:g} x {sides[2]:g} mm and {sides[0]:g} mm thick"
    entities = dxf_entities(read(context.export.folder, panel.dxf, MAX_TEXT_BYTES).text())
    outlines = [one for one in entities if (one[0], one.get(LAYER)) == (["LWPOLYLINE"], [CUT])]
    folds = [one for one in entities if (one[0], one.get(LAYER)) == (["LINE"], [FOLD])]
    if len(outlines) != 1:
        yield f"{panel.dxf}: {len(outlines)} outlines"
        return
    corners = np.array([outlines[0][X], outlines[0][Y]], dtype=float).T
    flaps = np.zeros(4)  # below, left, above, right
    for one in folds:
        line = np.array([[one[X][0], one[Y][0]], [one[END_X][0], one[END_Y][0]]], dtype=float)
        edges = [line[:, 1], line[:, 0], size[1] - line[:, 1], size[0] - line[:, 0]]
        on = [np.abs(edge).max() < SAME_MM for edge in edges]
        flaps += FLAP_MM * np.array(on)
    if len(folds) != FLAPS.get(panel.name, 0) or (flaps > 0).sum() != len(folds):
        yield f"{panel.dxf}: {len(folds)} folds"
    low, high = -flaps[[1, 0]], size + flaps[[3, 2]]
    if np.abs(np.stack([corners.min(axis=0) - low, corners.max(axis=0) - high])).max() > SAME_MM:
        yield f"{panel.dxf}: its outline is not that of the panel with its flaps"
    if (np.sort(high - low) > np.sort(sheet) + SAME_MM).any():
        yield f"{panel.name} is larger than its sheet"


def _box_faults(
    context: PrototypeContext, boxes: Mapping[str, Floats], drawn: Mapping[str, Shape], thick: float
) -> Iterator[str]:
    """The panels close a box, and every body is inside, not nearer to the walls than asked."""
    inner = _inner_box(boxes)
    whole = np.stack(list(boxes.values()))
    outer = np.stack([whole[:, 0].min(axis=0), whole[:, 1].max(axis=0)])
    if np.abs(outer - inner - [[-thick], [thick]]).max() > SAME_MM:
        yield "the panels do not close a box"
    gap = context.export.spec.prototype.light.shroud_gap_mm - SINGLE_MM
    for name, (points, _) in drawn.items():
        if name in NOT_BODIES or name.startswith(PREFIX):
            continue
        near = np.minimum(points.min(axis=0) - inner[0], inner[1] - points.max(axis=0))
        near[2] = inner[1, 2] - points[:, 2].max()
        if near.min() < gap or points[:, 2].min() < inner[0, 2] - SINGLE_MM:
            yield f"{name} is {near.min():.2f} mm from the shroud"


def _inner_box(boxes: Mapping[str, Floats]) -> Floats:
    """(2, 3) corners of the room between the panels."""
    low, high = ("back", "right", "floor"), ("front", "left", "lid")
    return np.array(
        [
            [boxes[PREFIX + name][1, k] for k, name in enumerate(low)],
            [boxes[PREFIX + name][0, k] for k, name in enumerate(high)],
        ]
    )

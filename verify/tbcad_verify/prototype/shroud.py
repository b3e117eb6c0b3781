"""The shroud: a closed box of card round everything, and patterns that fold to its panels."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.assembly import SINGLE_MM, VIEWS, Shape
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.cut_checks import SAME_MM, flat_drawing
from tbcad_verify.record.prototype import Panel, Shroud
from tbcad_verify.report.checks import Check, CheckName, at_most, no_faults, require
from tbcad_verify.step.solids_text import TextSolid
from tbcad_verify.types import Floats

FILE = "shroud_*.dxf"
CHECKS = {"shroud": "faults"}
FLAP_MM = 15.0  # width of a flap
FLAPS = {"shroud_front": 3, "shroud_back": 3, "shroud_right": 1}  # folds of panels that have any
PREFIX = "shroud_"
SHEET = re.compile(r"CARD-(\d+)x(\d+)x(\d+)")


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
    return [no_faults(names[0], _shroud_faults(context, shroud, drawn, solids))]


def _shroud_faults(
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
        corners = require(solids.get(panel.name), f"the assembly has no {panel.name}").corners
        boxes[panel.name] = np.stack([corners.min(axis=0), corners.max(axis=0)])
        yield from _panel_faults(context, panel, boxes[panel.name], thick, (length, width))
    yield from _box_faults(context, boxes, drawn, thick)


def _panel_faults(
    context: PrototypeContext, panel: Panel, box: Floats, thick: float, sheet: tuple[float, float]
) -> Iterator[str]:
    """One panel's size, and its pattern: outline less flaps, and folds on the panel's edges."""
    sides, size = np.sort(box[1] - box[0]), np.array(panel.size)
    if np.abs(sides - np.sort([thick, *size])).max() > SAME_MM:
        yield f"{panel.name} is drawn {sides[1]:g} x {sides[2]:g} mm and {sides[0]:g} mm thick"
    flat = flat_drawing(context, panel.dxf)
    if [len(one) for one in (flat.outlines, flat.circles, flat.lines, flat.arcs)] != [1, 0, 0, 0]:
        yield f"{panel.dxf}: another cut than one outline"
        return
    corners, folds = flat.corners, flat.folds
    inside = np.minimum(corners, size - corners).min(axis=1)
    if inside.max() > FLAP_MM + SAME_MM:
        yield f"{panel.dxf}: its outline is {inside.max():g} mm inside the panel"
    flaps = np.zeros(4)  # below, left, above, right
    for line in folds:
        edges = [line[:, 1], line[:, 0], size[1] - line[:, 1], size[0] - line[:, 0]]
        flaps += FLAP_MM * np.array([np.abs(edge).max() < SAME_MM for edge in edges])
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
    walls = (("back", "right", "floor"), 1), (("front", "left", "lid"), 0)
    inner = np.array(
        [[boxes[PREFIX + name][end, k] for k, name in enumerate(some)] for some, end in walls]
    )
    whole = np.stack(list(boxes.values()))
    outer = np.stack([whole[:, 0].min(axis=0), whole[:, 1].max(axis=0)])
    if np.abs(outer - inner - [[-thick], [thick]]).max() > SAME_MM:
        yield "the panels do not close a box"
    gap = context.export.spec.prototype.light.shroud_gap_mm - SINGLE_MM
    for name, (points, _) in drawn.items():
        if name in VIEWS or name.startswith(PREFIX):
            continue
        near = np.minimum(points.min(axis=0) - inner[0], inner[1] - points.max(axis=0))
        near[2] = inner[1, 2] - points[:, 2].max()
        if near.min() < gap or points[:, 2].min() < inner[0, 2] - SINGLE_MM:
            yield f"{name} is {near.min():.2f} mm from the shroud"

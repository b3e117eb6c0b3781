"""The assembly: the whole machine from several sides, call-outs by number of the parts list."""

from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
import trimesh

from tbcad.cad.drafting.callouts import EDGE, PIXELS, balloons
from tbcad.cad.drafting.line_pictures import LinePicture, axes_toward, line_picture
from tbcad.cad.drafting.sheet import (
    A3,
    BESIDE_MM,
    Box,
    Sheet,
    TitleBlock,
    choose_scale,
    drawing_room,
    placed,
    table,
)
from tbcad.cad.formats.entities import Point
from tbcad.cad.formats.glb import read_glb
from tbcad.drawings.export import DrawnExport

NAME = "assembly"
# Toward the eye: from the camera's side, from behind the uprights, from below to the balls.
EYES = ((1.0, -1.0, 0.6), (-1.0, -1.0, 0.6), (0.6, -1.0, -0.35))
NOTES = (
    "Numbers are those of the parts list, bom.csv.",
    "What is hidden here is on another sheet; what is nowhere is inside others or has no body.",
)
VIEWS = (
    "from the camera's side, without shroud",
    "from behind, without shroud",
    "from below, without shroud",
)
LEFT_OUT = ("shroud_", "capture_sphere", "camera_view")  # would hide the rest, or are no parts
SCALES = (0.5, 0.4, 0.2, 0.1)
PIECE_MM = 2.0  # edges are tested in pieces as long
HEAD, WIDTHS_MM = ("no.", "qty", "part"), (9.0, 9.0, 42.0)
Called: TypeAlias = Mapping[str, tuple[int, int, Point]]
"""Number and quantity of parts, and a point of each in a picture, mm."""


def draw_assembly(export: DrawnExport) -> list[Sheet]:
    """A sheet for each side of the machine. InputError: its file is not as it was written."""
    machine = export.machine
    assert machine is not None
    path = export.file(machine.record.assembly.glb)
    parts = {**machine.bodies, **{one.name: one.part for one in machine.fasteners}}
    listed = {
        part: (item, machine.bill.quantities[part]) for part, item in machine.bill.items.items()
    }
    return assembly_sheets(path, parts, listed, export.title)


def assembly_sheets(
    path: Path, parts: Mapping[str, str], listed: Mapping[str, tuple[int, int]], design: str
) -> list[Sheet]:
    """A sheet for each side, with the numbers of what is seen there first.

    From the GLB file of all bodies, the part of each, and each part's number and quantity.
    """
    bodies = {
        one.name: trimesh.Trimesh(one.mesh.vertices, one.mesh.triangles)
        for one in read_glb(path)
        if not one.name.startswith(LEFT_OUT)
    }
    sheets, seen = list[Sheet](), set[str]()
    for k, eye in enumerate(EYES):
        picture = line_picture(bodies, axes_toward(eye), PIECE_MM)
        anchors: dict[str, Point] = {}  # of each part that has no number yet: its first body's
        for body, point in picture.anchors.items():
            part = parts.get(body, "")
            if part in listed and part not in seen:
                anchors.setdefault(part, point)
        seen |= anchors.keys()
        shown = {part: (*listed[part], point) for part, point in anchors.items()}
        sheets.append(_sheet(picture, shown, design, k))
    return sheets


def _sheet(picture: LinePicture, shown: Called, design: str, k: int) -> Sheet:
    left, low, right, high = drawing_room(A3)
    column = right - sum(WIDTHS_MM) - BESIDE_MM
    room = left, low, column, high
    scale, origin = _fitted(picture, room)
    block = TitleBlock(
        title="general assembly",
        design=design,
        item="all",
        quantity=1,
        material="see the parts list",
        view=VIEWS[k],
        sheet=f"{k + 1} of {len(EYES)}",
        tolerances="none",
    )
    rows = sorted((item, quantity, part) for part, (item, quantity, _) in shown.items())
    cells = [(str(item), str(quantity), part) for item, quantity, part in rows]
    points = [
        (number, (origin[0] + scale * x, origin[1] + scale * y))
        for number, _, (x, y) in shown.values()
    ]
    drawn = [
        *placed(picture.lines, origin, scale),
        *balloons(points, room),
        *table((column + BESIDE_MM, high), WIDTHS_MM, (HEAD, *cells)),
    ]
    name = NAME if k == 0 else f"{NAME}_{k + 1}"
    return Sheet.framed((name, NAME), block, A3, scale, origin, drawn, NOTES)


def _fitted(picture: LinePicture, room: Box) -> tuple[float, Point]:
    """Scale and place of a picture between two columns of numbers."""
    points = np.array([end for line in picture.lines for end in (line.start, line.end)])
    low, high = points.min(axis=0), points.max(axis=0)
    edge = 2 * EDGE / PIXELS
    space = room[2] - room[0] - 2 * edge, room[3] - room[1] - 2 * BESIDE_MM
    scale = choose_scale((high - low).tolist(), space, SCALES)
    middle = np.array([room[0] + room[2], room[1] + room[3]]) / 2 - scale * (low + high) / 2
    return scale, (float(middle[0]), float(middle[1]))

"""What is cut or drilled: outlines and holes of DXF and drill table are those of the assembly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.flat_drawing import SAME_MM, FlatDrawing, read_dxf
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype import PLATE_HOLES
from tbcad_verify.report.checks import Check, CheckName, at_most, require, short_list
from tbcad_verify.step.solids_text import TextSolid, holes
from tbcad_verify.types import Floats

CHECKS = {"drawings": "faults", "plate holes": "faults"}
DRAWN = ("plate", "upright_left", "wheel", "lamp_1")  # bodies of the assembly, where there are such
TAPPED_M5_MM = 4.2
CORNERS = 4  # of a strip


def checks(
    names: list[CheckName], context: PrototypeContext, assembly: Mapping[str, TextSolid]
) -> list[Check]:
    """All drawings, and the drill table of the plate."""
    found = [list(faults(context, assembly)) for faults in (_faults, _table_faults)]
    return [
        at_most(name, len(faults), 0, short_list(faults))
        for name, faults in zip(names, found, strict=True)
    ]


def _faults(context: PrototypeContext, assembly: Mapping[str, TextSolid]) -> Iterator[str]:
    bought = {one.name: one.part for one in context.prototype.bought}
    drawings = {one.part: one.dxf for one in context.prototype.drawings}
    needed = {name: str(bought[name]) for name in DRAWN if bought.get(name)}
    for part in drawings.keys() ^ set(needed.values()):
        yield f"{part}: drawn without need" if part in drawings else f"{part}: no drawing"
    for name, part in needed.items():
        if part not in drawings or name not in assembly:
            continue
        flat = read_dxf(_text(context, drawings[part]))
        solid = assembly[name]
        if name == "lamp_1":
            yield from _strip_faults(context, solid, flat)
        elif name == "wheel":
            yield from _wheel_faults(context, solid, flat)
        else:
            yield from _board_faults(context, name, solid, flat)


def _text(context: PrototypeContext, file: str) -> str:
    return read(context.export.folder, file, MAX_TEXT_BYTES).text()


def _board_faults(
    context: PrototypeContext, name: str, solid: TextSolid, flat: FlatDrawing
) -> Iterator[str]:
    """A plate from above, or an upright that lies: outline and all its holes."""
    axes = context.level_axes[[0, 1] if name == "plate" else [2, 1]]
    corners = solid.corners @ axes.T
    low, size = corners.min(axis=0), np.ptp(corners, axis=0)
    outline = flat.corners if len(flat.corners) else np.zeros((1, 2))
    ends = np.stack([outline.min(axis=0), outline.max(axis=0) - size])
    if np.abs(ends).max() > SAME_MM:
        yield f"{name}: its outline is not {size[0]:g} x {size[1]:g} mm"
    places = {
        radius: np.array(
            [axes @ hole.point - low for hole in holes(solid.faces, radius, SAME_MM)]
        ).reshape(-1, 2)
        for radius in _radii(solid)
    }
    yield from _hole_faults(name, places, flat.circles)


def _strip_faults(context: PrototypeContext, solid: TextSolid, flat: FlatDrawing) -> Iterator[str]:
    """The strips of a lamp side by side, their length across the paper, and no holes."""
    lamps = context.prototype.lamps
    size = np.sort(np.ptp(solid.corners, axis=0)[1:])[::-1]
    if lamps is None or len(flat.corners) != CORNERS * lamps.strips:
        yield "lamp_1: its drawing does not have each strip's outline"
        return
    if lamps.length < lamps.width:
        size = size[::-1]
    own = flat.corners.reshape(lamps.strips, CORNERS, 2)
    low, high = own.min(axis=1), own.max(axis=1)
    wide = size[1] / lamps.strips
    ends = np.column_stack([np.zeros(lamps.strips), wide * np.arange(lamps.strips)])
    off = max(np.abs(low - ends).max(), np.abs(high - ends - [size[0], wide]).max())
    if off > SAME_MM or len(flat.circles):
        yield f"lamp_1: its outlines are not {lamps.strips} of {size[0]:g} x {wide:g} mm"


def _wheel_faults(context: PrototypeContext, solid: TextSolid, flat: FlatDrawing) -> Iterator[str]:
    """The wheel about its axis: its outline is a circle too."""
    places = {
        radius: np.array(
            [(context.frame @ hole.point)[1:] for hole in holes(solid.faces, radius, SAME_MM)]
        ).reshape(-1, 2)
        for radius in _radii(solid)
    }
    outer = max(face.radius for face in solid.faces if not face.hollow)
    places[outer] = np.vstack([places.get(outer, np.zeros((0, 2))), [[0.0, 0.0]]])
    yield from _hole_faults("wheel", places, flat.circles)


def _radii(solid: TextSolid) -> list[float]:
    """Radii of a solid's holes, each once."""
    found: list[float] = []
    for face in solid.faces:
        if face.hollow and all(abs(face.radius - radius) > SAME_MM for radius in found):
            found.append(face.radius)
    return found


def _hole_faults(name: str, places: Mapping[float, Floats], circles: Floats) -> Iterator[str]:
    """Every hole of the solid has its circle, and every circle its hole."""
    if len(circles) != sum(map(len, places.values())):
        yield f"{name}: {len(circles)} circles for {sum(map(len, places.values()))} holes"
    for radius, points in places.items():
        for x, y in points:
            away = np.abs(circles - [x, y, radius]).max(axis=1, initial=0.0)
            if not (away <= SAME_MM).any():
                yield f"{name}: no circle of {radius:g} mm radius at {x:.2f}, {y:.2f}"


def _table_faults(context: PrototypeContext, assembly: Mapping[str, TextSolid]) -> Iterator[str]:
    """The drill table against the tapped holes of the plate, from its corner."""
    table = require(context.prototype.plate_holes, f"there is no {PLATE_HOLES}")
    plate, axes = require(assembly.get("plate"), "the assembly has no plate"), context.level_axes
    low, high = (end(plate.corners @ axes.T, axis=0) for end in (np.min, np.max))
    drilled = holes(plate.faces, TAPPED_M5_MM / 2, SAME_MM)
    places = np.array([hole.point @ axes.T for hole in drilled]).reshape(-1, 3)[:, :2] - low[:2]
    if len(table) != len(places):
        yield f"{len(table)} holes, the plate has {len(places)}"
    if any(abs(hole.depth - (high - low)[2]) > SAME_MM for hole in drilled):
        yield "a hole is not through the plate"
    for k, place in enumerate(np.column_stack([table.x_mm, table.y_mm]), 1):
        if (np.abs(places - place).max(axis=1) <= SAME_MM).sum() != 1:
            yield f"hole {k} is elsewhere in the plate"

"""Drawings of what is cut or drilled: holes and outlines of the DXF are those of the assembly.

The PDF must say the same in words, and every dimension what is measured between its points.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.flat_drawing import SAME_MM, FlatDrawing, read_dxf
from tbcad_verify.prototype.purchases import frame_axes
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype_sections import Drawing
from tbcad_verify.report.checks import Check, CheckName, at_most, short_list
from tbcad_verify.step.solids_text import TextSolid, holes
from tbcad_verify.types import Floats

CHECKS = {"drawings": "faults"}
DRAWN = ("plate", "upright_left", "wheel", "lamp_1")  # bodies of the assembly, where there are such
PDF_HEAD = b"%PDF-1."
PDF_TEXT = re.compile(rb"\(((?:[^()\\]++|\\.)*+)\) Tj")
CORNERS = 4  # of a strip


def checks(
    names: list[CheckName], context: PrototypeContext, assembly: Mapping[str, TextSolid]
) -> list[Check]:
    """The one check, over all drawings."""
    (name,) = names
    found = list(_faults(context, assembly))
    return [at_most(name, len(found), 0, short_list(found))]


def _faults(context: PrototypeContext, assembly: Mapping[str, TextSolid]) -> Iterator[str]:
    bought = {one.name: one.part for one in context.prototype.bought}
    drawings = {one.part: one for one in context.prototype.drawings}
    needed = {name: str(bought[name]) for name in DRAWN if bought.get(name)}
    for part in drawings.keys() ^ set(needed.values()):
        yield f"{part}: drawn without need" if part in drawings else f"{part}: no drawing"
    for name, part in needed.items():
        if part not in drawings or name not in assembly:
            continue
        flat = read_dxf(_text(context, drawings[part].dxf))
        solid = assembly[name]
        if name == "lamp_1":
            yield from _strip_faults(context, solid, flat)
        elif name == "wheel":
            yield from _wheel_faults(context, solid, flat)
        else:
            yield from _board_faults(context, name, solid, flat)
        yield from _words(context, drawings[part], flat)
        for fault in flat.dimension_faults():
            yield f"{drawings[part].dxf}: {fault}"


def _text(context: PrototypeContext, file: str) -> str:
    return read(context.export.folder, file, MAX_TEXT_BYTES).text()


def _board_faults(
    context: PrototypeContext, name: str, solid: TextSolid, flat: FlatDrawing
) -> Iterator[str]:
    """A plate from above, or an upright that lies: outline and all its holes."""
    axes = frame_axes(context)[[0, 1] if name == "plate" else [2, 1]]
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


def _words(context: PrototypeContext, drawing: Drawing, flat: FlatDrawing) -> Iterator[str]:
    """The PDF has the texts of the DXF, the part's name among them."""
    data = read(context.export.folder, drawing.pdf, MAX_TEXT_BYTES).data.tobytes()
    if not data.startswith(PDF_HEAD):
        yield f"{drawing.pdf} is no PDF"
        return
    words = Counter(
        re.sub(rb"\\(.)", rb"\1", found).decode("cp1252", "replace")
        for found in PDF_TEXT.findall(data)
    )
    if words != flat.texts:
        yield f"{drawing.pdf} does not say what {drawing.dxf} does"
    if not any(text.endswith(f": {drawing.part}") for text in words):
        yield f"{drawing.pdf} does not name {drawing.part}"

"""Cut and drilled parts: DXF files and drill table against bodies of the assembly.

All that is on the layer `cut` is a cut of the body.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.drawing_files import FlatDrawing, read_dxf, sheet_faults
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype import PLATE_HOLES
from tbcad_verify.report.checks import Check, CheckName, no_faults, require
from tbcad_verify.step.solids_text import TextSolid, holes

FILE = "drawing_*.dxf, plate_holes.csv"
CHECKS = {"drawings": "faults", "plate holes": "faults"}
DRAWN = ("plate", "upright_left", "wheel", "lamp_1")  # bodies of the assembly, where there are such
TAPPED_M5_MM = 4.2
ASSEMBLY = "assembly.pdf"
ROUND = ("cylinder", "sphere")
CORNERS = 4  # of a strip
SAME_MM = 1e-6


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """All drawings, and the drill table of the plate."""
    drawings = [*_drawing_faults(context, solids), *_cap_faults(context, solids)]
    folder, record = context.export.folder, context.prototype
    for name in [ASSEMBLY, *(one.pdf for one in record.drawn)]:
        if (folder / name).exists():
            drawings += sheet_faults(read(folder, name, MAX_TEXT_BYTES))
    faults = drawings, _table_faults(context, solids)
    return [no_faults(*pair) for pair in zip(names, faults, strict=True)]


def _drawing_faults(context: PrototypeContext, assembly: Mapping[str, TextSolid]) -> Iterator[str]:
    bought = {one.name: one.part for one in context.prototype.bought}
    drawings = {one.part: one.dxf for one in context.prototype.drawings}
    needed = {name: str(bought[name]) for name in DRAWN if bought.get(name)}
    for part in drawings.keys() ^ set(needed.values()):
        yield f"{part}: drawn without need" if part in drawings else f"{part}: no drawing"
    for name, part in needed.items():
        if part in drawings and name in assembly:
            flat = flat_drawing(context, drawings[part])
            if name == "lamp_1":
                yield from _strip_faults(context, assembly[name], flat)
            else:
                yield from _board_faults(context, name, assembly[name], flat)


def flat_drawing(context: PrototypeContext, file: str) -> FlatDrawing:
    """A drawing of the build, as it is cut. Unknown: it cannot be read."""
    return read_dxf(read(context.export.folder, file, MAX_TEXT_BYTES))


def _strip_faults(context: PrototypeContext, solid: TextSolid, flat: FlatDrawing) -> Iterator[str]:
    """The strips of a lamp side by side, their length across the paper, and no holes."""
    lamps = context.prototype.lamps
    size = np.sort(np.ptp(solid.corners, axis=0)[1:])[::-1]
    if lamps is None or [len(one) for one in flat.outlines] != [CORNERS] * lamps.strips:
        yield "lamp_1: its drawing does not have each strip's outline"
        return
    if lamps.length < lamps.width:
        size = size[::-1]
    own = flat.corners.reshape(lamps.strips, CORNERS, 2)
    low, high = own.min(axis=1), own.max(axis=1)
    wide = size[1] / lamps.strips
    ends = np.column_stack([np.zeros(lamps.strips), wide * np.arange(lamps.strips)])
    off = max(np.abs(low - ends).max(), np.abs(high - ends - [size[0], wide]).max())
    if off > SAME_MM or any(map(len, (flat.circles, flat.lines, flat.arcs))):
        yield f"lamp_1: its outlines are not {lamps.strips} of {size[0]:g} x {wide:g} mm"


def _board_faults(
    context: PrototypeContext, name: str, solid: TextSolid, flat: FlatDrawing
) -> Iterator[str]:
    """A plate from above, an upright that lies, or a wheel about its axis, which is round too.

    Every hole of the solid has its circle, and every circle its hole.
    """
    level = context.level_axes
    axes = {"plate": level[:2], "wheel": context.frame[1:]}.get(name, level[[2, 1]])
    corners, low = solid.corners @ axes.T, np.zeros(2)
    size = np.ptp(corners, axis=0)
    if name == "wheel" and flat.outlines:
        yield f"{name}: {len(flat.outlines)} outlines, where circles are its outline"
    if name != "wheel":
        low = corners.min(axis=0)
        box = np.array([[0, 0], [size[0], 0], size, [0, size[1]]])
        if flat.corners.shape != box.shape or np.abs(flat.corners - box).max() > SAME_MM:
            yield f"{name}: its outline is not {size[0]:g} x {size[1]:g} mm"
    if len(flat.arcs) or (len(flat.lines) and name != "upright_left"):
        yield f"{name}: {len(flat.lines)} lines and {len(flat.arcs)} arcs to be cut"
    elif len(flat.lines) and np.abs(np.ptp(flat.lines, axis=1) - [size[0], 0]).max() > SAME_MM:
        yield f"{name}: a line to be cut does not run along all of it"
    radii: list[float] = []
    for face in solid.faces:
        if face.hollow and all(abs(face.radius - radius) > SAME_MM for radius in radii):
            radii.append(face.radius)
    wanted = [
        (*(axes @ hole.point - low), radius)
        for radius in radii
        for hole in holes(solid.faces, radius, SAME_MM)
    ]
    if name == "wheel":
        wanted.append((0.0, 0.0, max(face.radius for face in solid.faces if not face.hollow)))
    if len(flat.circles) != len(wanted):
        yield f"{name}: {len(flat.circles)} circles for {len(wanted)} holes"
    for x, y, radius in wanted:
        away = np.abs(flat.circles - [x, y, radius]).max(axis=1, initial=0.0)
        if not (away <= SAME_MM).any():
            yield f"{name}: no circle of {radius:g} mm radius at {x:.2f}, {y:.2f}"


def _cap_faults(context: PrototypeContext, assembly: Mapping[str, TextSolid]) -> Iterator[str]:
    """The profile of a cap, drawn at full size: arcs of its spheres, corners on its round faces."""
    for cap in context.prototype.caps:
        name = f"cap_{cap.ball}"
        flat, solid = (
            flat_drawing(context, cap.dxf),
            require(assembly.get(name), f"there is no {name}"),
        )
        radii = {kind: [one.radius for one in solid.faces if one.kind == kind] for kind in ROUND}
        off = [away(flat.arcs[:, 2], radii["sphere"]), away(radii["sphere"], flat.arcs[:, 2])]
        out = np.abs(flat.corners[1:-1, 0])
        off += [away(out, radii["cylinder"]), away(radii["cylinder"], out)]
        others = len(flat.circles), len(flat.lines), len(flat.folds), len(flat.outlines) - 1
        if max(off) > SAME_MM or any(others):
            yield f"{cap.dxf}: not the profile of {name}"


def away(values: ArrayLike, others: ArrayLike) -> float:
    """Largest distance of values (N,) from the nearest of others (M,)."""
    apart = np.abs(np.subtract.outer(np.asarray(values), np.asarray(others)))
    return float(apart.min(axis=1, initial=np.inf).max(initial=0.0))


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

"""Files of the printed parts: STEP as assembled, STL and 3MF on the printer's bed."""

from pathlib import Path
from typing import Any

from tbcad.cad.brep import Solid
from tbcad.formats.step import write_step
from tbcad.formats.stl import write_stl
from tbcad.formats.threemf import write_3mf
from tbcad.prototype.printing.parts import PrintedPart, part_mesh

KINDS = ("step", "stl", "3mf")


def file_names(part: PrintedPart) -> dict[str, str]:
    """Names of a part's files by their kind."""
    return {kind: f"{part.name}.{kind}" for kind in KINDS}


def write_part(folder: Path, part: PrintedPart, tolerance: float, pcurves: bool) -> None:
    """Write a part's files.

    Args:
        folder: to write into.
        part: with its solid.
        tolerance: largest distance of facets from the surface, mm.
        pcurves: as `write_step`.
    """
    names, mesh = file_names(part), part_mesh(part, tolerance)
    write_step(folder / names["step"], Solid(part.name, part.solid.shape, ()), pcurves)
    write_stl(folder / names["stl"], mesh)
    write_3mf(folder / names["3mf"], part.name, mesh)


def part_record(part: PrintedPart) -> dict[str, Any]:
    """Record of a part for prototype.json; y = x @ axes + origin is a point on the bed."""
    return {
        "name": part.name,
        "what": part.what,
        **file_names(part),
        "role": part.role,
        "ball": part.ball + 1 if part.ball >= 0 else None,
        "quantity": 1,
        "axes": (part.solid.axes + 0.0).tolist(),
        "origin_mm": (part.solid.origin + 0.0).tolist(),
    }

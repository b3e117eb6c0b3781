"""Files of the printed parts: STEP where they stand in the rig, STL and 3MF on the bed."""

from pathlib import Path
from typing import Any

from tbcad.cad.brep import Solid
from tbcad.formats.step import write_step
from tbcad.formats.stl import write_stl
from tbcad.formats.threemf import write_3mf
from tbcad.prototype.printing.parts import PrintedPart, printed

KINDS = ("step", "stl", "3mf")


def files(piece: PrintedPart) -> dict[str, str]:
    """Names of a part's files by their kind."""
    return {kind: f"{piece.name}.{kind}" for kind in KINDS}


def write_piece(folder: Path, piece: PrintedPart, tolerance: float, pcurves: bool) -> None:
    """Write a part's files.

    Args:
        folder: to write into.
        piece: the part.
        tolerance: largest distance of facets from the surface, mm.
        pcurves: as `write_step`.
    """
    names, mesh = files(piece), printed(piece, tolerance)
    write_step(folder / names["step"], Solid(piece.name, piece.part.shape, ()), pcurves)
    write_stl(folder / names["stl"], mesh)
    write_3mf(folder / names["3mf"], piece.name, mesh)


def record(piece: PrintedPart) -> dict[str, Any]:
    """Record of a part for prototype.json; y = x @ axes + origin is a point on the bed."""
    part = piece.part
    return {
        "name": piece.name,
        "what": piece.what,
        **files(piece),
        "role": piece.role,
        "ball": piece.ball + 1 if piece.ball >= 0 else None,
        "quantity": piece.quantity,
        "axes": (part.axes + 0.0).tolist(),
        "origin_mm": (part.origin + 0.0).tolist(),
    }

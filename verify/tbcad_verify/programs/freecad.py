"""FreeCAD opens a STEP file without a window."""

from __future__ import annotations

from tbcad_verify.programs.answers import (
    SCRIPT_END,
    SOLID,
    SPHERES,
    VOLUME,
    script_figures,
    solid_checks,
)
from tbcad_verify.programs.program_query import ExpectedPart, ProgramQuery, Sandbox, on_path
from tbcad_verify.report.checks import Check, CheckName, at_most

KEYS = ("solids", "invalid", "open", "loose", "spheres", "volume")

# FreeCAD runs this inside itself and ends with 0 even when it breaks, unless it says otherwise.
SCRIPT = """
import json, sys

def look():
    import Part
    shape = Part.Shape()
    shape.read("given.step")
    solids = shape.Solids
    return {
        "solids": len(solids),
        "invalid": sum(not solid.isValid() for solid in solids),
        "open": sum(not solid.isClosed() for solid in solids),
        "loose": len(shape.Faces) - sum(len(solid.Faces) for solid in solids),
        "spheres": sum(type(face.Surface).__name__ == "Sphere" for face in shape.Faces),
        "volume": shape.Volume,
    }

def message(error):
    first = error.args[0] if error.args else error
    return str(first.get("sErrMsg", first)) if isinstance(first, dict) else str(error)
"""


def ask(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """One valid, closed solid with the mirrors' faces and the mesh's volume.

    Raises:
        Unknown: the program gives no answer.
    """
    script = sandbox.folder / "look.py"
    script.write_text(SCRIPT + SCRIPT_END, encoding="utf-8")
    figures = script_figures(sandbox.run(script), sandbox.folder, KEYS)
    solids, spheres, volume = solid_checks([names[0], *names[2:]], figures, expected)
    return [solids, _valid(names[1], figures), spheres, volume]


def _valid(name: CheckName, figures: dict[str, float]) -> Check:
    flaws = sum(abs(figures[key]) for key in ("invalid", "open", "loose"))
    detail = (
        f"{figures['solids']:.0f} solids, {figures['invalid']:.0f} of them not valid, "
        f"{figures['open']:.0f} not closed; {figures['loose']:.0f} faces of no solid"
    )
    return at_most(name, flaws + (figures["solids"] < 1), 0, detail)


STEP = ProgramQuery(
    program="freecad",
    kind="step",
    install="apt install freecad",
    questions={
        "freecad solids": SOLID,
        "freecad valid": "flaws",
        "freecad spheres": SPHERES,
        "freecad volume": VOLUME,
    },
    find=lambda: on_path("freecadcmd", "FreeCADCmd"),
    ask=ask,
)

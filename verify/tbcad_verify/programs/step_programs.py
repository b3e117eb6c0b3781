"""gmsh and FreeCAD open a STEP file without a window."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

from tbcad_verify.programs.program_query import (
    SCRIPT_END,
    SOLID,
    SPHERES,
    VOLUME,
    Command,
    ExpectedPart,
    ProgramQuery,
    Sandbox,
    on_path,
    script_figures,
    solid_checks,
)
from tbcad_verify.report.checks import Check, CheckName, at_most

INSTALL = "pip install gmsh"
GMSH_KEYS = ("solids", "spheres", "volume")

# In a process of its own: it is native code that may crash, and it takes over signals.
GMSH_SCRIPT = """
import importlib.util, json, sys

def look():
    spec = importlib.util.spec_from_file_location("gmsh", sys.argv[1])
    gmsh = sys.modules["gmsh"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(gmsh)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.importShapes("given.step")
    gmsh.model.occ.synchronize()
    solids = gmsh.model.getEntities(3)
    kinds = [gmsh.model.getType(*surface) for surface in gmsh.model.getEntities(2)]
    return {
        "solids": len(solids),
        "spheres": kinds.count("Sphere"),
        "volume": sum(gmsh.model.occ.getMass(*solid) for solid in solids),
    }

message = str
"""

FREECAD_KEYS = ("solids", "invalid", "open", "loose", "spheres", "volume")

# FreeCAD runs this inside itself and ends with 0 even when it breaks, unless it says otherwise.
FREECAD_SCRIPT = """
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


def find_gmsh() -> Command:
    """Python with the package's file; the program alone does not tell what faces are."""
    spec = importlib.util.find_spec("gmsh") if sys.executable else None
    if spec is None or not spec.origin or not Path(spec.origin).is_file():
        return ()
    script = GMSH_SCRIPT + SCRIPT_END
    return sys.executable, "-I", "-c", script, str(Path(spec.origin).absolute())


def ask_gmsh(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """One solid with the mirrors' faces and the mesh's volume.

    Unknown: the package gives no answer.
    """
    figures = script_figures(sandbox.run(), sandbox.folder, GMSH_KEYS)
    return list(solid_checks(names, figures, expected))


GMSH = ProgramQuery(
    program="gmsh",
    kind="step",
    install=INSTALL,
    questions={"gmsh solids": SOLID, "gmsh spheres": SPHERES, "gmsh volume": VOLUME},
    find=find_gmsh,
    ask=ask_gmsh,
)


def ask_freecad(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """One valid, closed solid with the mirrors' faces and the mesh's volume.

    Unknown: the program gives no answer.
    """
    script = sandbox.folder / "look.py"
    script.write_text(FREECAD_SCRIPT + SCRIPT_END, encoding="utf-8")
    figures = script_figures(sandbox.run(script), sandbox.folder, FREECAD_KEYS)
    solids, spheres, volume = solid_checks([names[0], *names[2:]], figures, expected)
    return [solids, _valid(names[1], figures), spheres, volume]


def _valid(name: CheckName, figures: dict[str, float]) -> Check:
    flaws = sum(abs(figures[key]) for key in ("invalid", "open", "loose"))
    detail = (
        f"{figures['solids']:.0f} solids, {figures['invalid']:.0f} of them not valid, "
        f"{figures['open']:.0f} not closed; {figures['loose']:.0f} faces of no solid"
    )
    return at_most(name, flaws + (figures["solids"] < 1), 0, detail)


FREECAD = ProgramQuery(
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
    ask=ask_freecad,
)

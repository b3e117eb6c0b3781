"""gmsh opens a STEP file: as a Python package, or else as a program that counts no spheres."""

from __future__ import annotations

import importlib.util
import math
import re
import sys
from pathlib import Path

from tbcad_verify.programs.answers import (
    NO_ANSWER,
    SCRIPT_END,
    SOLID,
    SPHERES,
    VOLUME,
    script_figures,
    skipped,
    solid_checks,
    text_of,
)
from tbcad_verify.programs.program_query import (
    Command,
    ExpectedPart,
    ProgramQuery,
    Sandbox,
    on_path,
)
from tbcad_verify.report.checks import Check, CheckName, Unknown

INSTALL = "pip install gmsh"
KEYS = ("solids", "spheres", "volume")

# In a process of its own: it is native code that may crash, and it takes over signals.
SCRIPT = """
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

GEO = """
SetFactory("OpenCASCADE");
shapes() = ShapeFromFile("given.step");
volumes() = Volume{:};
total = 0;
For k In {0 : #volumes() - 1}
  mass() = Mass Volume{volumes(k)};
  total = total + mass(0);
EndFor
Printf("solids %g volume %.17g", #volumes(), total);
"""


def find() -> Command:
    """Python with the package's file, or the program."""
    spec = importlib.util.find_spec("gmsh") if sys.executable else None
    if spec is not None and spec.origin and Path(spec.origin).is_file():
        return (sys.executable, "-I", "-c", SCRIPT + SCRIPT_END, str(Path(spec.origin).absolute()))
    return on_path("gmsh")


def ask(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """One solid with the mirrors' faces and the mesh's volume.

    Raises:
        Unknown: the program gives no answer.
    """
    is_package = len(sandbox.command) > 1
    if is_package:
        figures = script_figures(sandbox.run(), sandbox.folder, KEYS)
    else:
        figures = _program(sandbox)
    solids, spheres, volume = solid_checks(names, figures, expected)
    if not is_package:
        spheres = skipped(names[1], f"only its package counts them: {INSTALL}")
    return [solids, spheres, volume]


def _program(sandbox: Sandbox) -> dict[str, float]:
    script = sandbox.folder / "look.geo"
    script.write_text(GEO, encoding="utf-8")
    text = text_of(sandbox.run(script, "-parse_and_exit"))
    match = re.search(r"solids (\d{1,9}) volume ([-+.e\d]{1,30})\s", text)
    if match is None:
        raise Unknown(NO_ANSWER)
    return {"solids": float(match[1]), "spheres": math.nan, "volume": float(match[2])}


STEP = ProgramQuery(
    program="gmsh",
    kind="step",
    install=INSTALL,
    questions={"gmsh solids": SOLID, "gmsh spheres": SPHERES, "gmsh volume": VOLUME},
    find=find,
    ask=ask,
)

"""gmsh opens a STEP file: as a Python package, or else as a program, which knows no spheres."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

from tbcad_verify.programs.answers import figures, skipped, text_of
from tbcad_verify.programs.program_query import (
    Command,
    ExpectedPart,
    ProgramQuery,
    Sandbox,
    on_path,
)
from tbcad_verify.programs.solid_checks import SOLID, SPHERES, VOLUME, one_solid, spheres, volume
from tbcad_verify.report.checks import Check, Unknown

INSTALL = "pip install gmsh"
KEYS = ("solids", "spheres", "volume")

# In a process of its own: it is native code that may crash, and it takes over signals.
LOOK = """
import importlib.util, json, sys

def look(path):
    spec = importlib.util.spec_from_file_location("gmsh", path)
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

try:
    answer = look(sys.argv[1])
except BaseException as error:
    answer = {"error": type(error).__name__ + ": " + str(error)}
with open("answer.json", "w") as stream:
    json.dump(answer, stream)
sys.exit(3 if "error" in answer else 0)
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
        return (sys.executable, "-I", "-c", LOOK, str(Path(spec.origin).absolute()))
    return on_path("gmsh")


def ask(room: Sandbox, wanted: ExpectedPart) -> list[Check]:
    """One solid with the mirrors' faces and the mesh's volume.

    Raises:
        Unknown: there is no answer.
    """
    is_package = len(room.command) > 1
    seen = _package(room) if is_package else _program(room)
    return [
        one_solid("gmsh", room.file, seen),
        spheres("gmsh", room.file, seen, wanted) if is_package else _no_spheres(room.file),
        volume("gmsh", room.file, seen, wanted),
    ]


def _package(room: Sandbox) -> dict[str, float]:
    return figures(room.run(), room.place / "answer.json", KEYS)


def _program(room: Sandbox) -> dict[str, float]:
    script = room.place / "look.geo"
    script.write_text(GEO, encoding="utf-8")
    text = text_of(room.run(script, "-parse_and_exit"))
    found = re.search(r"solids (\d{1,9}) volume ([-+.e\d]{1,30})\s", text)
    if found is None:
        raise Unknown("ended well, but left no readable answer")
    return {"solids": float(found[1]), "volume": float(found[2])}


def _no_spheres(file: str) -> Check:
    return skipped(("gmsh spheres", file, SPHERES), f"only its package tells: {INSTALL}")


STEP = ProgramQuery(
    program="gmsh",
    kind="step",
    install=INSTALL,
    questions={"gmsh solids": SOLID, "gmsh spheres": SPHERES, "gmsh volume": VOLUME},
    find=find,
    ask=ask,
)

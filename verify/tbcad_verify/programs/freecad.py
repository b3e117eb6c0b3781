"""FreeCAD opens a STEP file, without a window."""

from __future__ import annotations

from tbcad_verify.programs.answers import figures
from tbcad_verify.programs.program_query import ExpectedPart, ProgramQuery, Sandbox, on_path
from tbcad_verify.programs.solid_checks import SOLID, SPHERES, VOLUME, one_solid, spheres, volume
from tbcad_verify.report.checks import Check, at_most

KEYS = ("solids", "invalid", "open", "loose", "spheres", "volume")

# FreeCAD runs this inside itself and ends with 0 even when it breaks, unless it says otherwise.
LOOK = """
import json, sys

def look(Part):
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

def words(error):
    first = error.args[0] if error.args else error
    return str(first.get("sErrMsg", first)) if isinstance(first, dict) else str(error)

try:
    import Part
    answer = look(Part)
except BaseException as error:
    answer = {"error": type(error).__name__ + ": " + words(error)}
with open("answer.json", "w") as stream:
    json.dump(answer, stream)
sys.exit(3 if "error" in answer else 0)
"""


def ask(room: Sandbox, wanted: ExpectedPart) -> list[Check]:
    """One valid, closed solid with the mirrors' faces and the mesh's volume.

    Raises:
        Unknown: there is no answer.
    """
    script = room.place / "look.py"
    script.write_text(LOOK, encoding="utf-8")
    seen = figures(room.run(script), room.place / "answer.json", KEYS)
    return [
        one_solid("freecad", room.file, seen),
        _valid(room.file, seen),
        spheres("freecad", room.file, seen, wanted),
        volume("freecad", room.file, seen, wanted),
    ]


def _valid(file: str, seen: dict[str, float]) -> Check:
    flaws = sum(abs(seen[key]) for key in ("invalid", "open", "loose"))
    detail = (
        f"{seen['solids']:.0f} solids, {seen['invalid']:.0f} of them not valid, "
        f"{seen['open']:.0f} not closed; {seen['loose']:.0f} faces of no solid"
    )
    return at_most(("freecad valid", file, "flaws"), flaws + (seen["solids"] < 1), 0, detail)


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

"""Programs that users open our files with. Each is skipped when it is not installed."""

import json
import math
import shutil
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest
from tbcad_verify.programs import (
    ExpectedPart,
    check_with_programs,
    is_skipped,
)
from tbcad_verify.programs.mesh_programs import ADMESH, PRUSA_3MF, PRUSA_STL
from tbcad_verify.programs.program_query import on_path, sandbox
from tbcad_verify.programs.step_programs import FREECAD, GMSH
from tbcad_verify.report.checks import Check
from tbcad_verify.run.child import Limits

from tbcad.app.cli import run
from tests.exported_files import read_csv

pytestmark = [pytest.mark.clients, pytest.mark.slow]

SAMPLE = Path(__file__).parents[2] / "docs" / "sample"
PROGRAMS = {
    "freecad": ["solids", "valid", "spheres", "volume"],
    "gmsh": ["solids", "spheres", "volume"],
    "prusa": ["manifold", "parts", "volume"] * 2 + ["slices", "filament", "time"],
    "admesh": ["repairs", "parts", "volume"],
}
READERS = {
    ("freecad", "step"): FREECAD,
    ("gmsh", "step"): GMSH,
    ("prusa", "stl"): PRUSA_STL,
    ("prusa", "3mf"): PRUSA_3MF,
    ("admesh", "stl"): ADMESH,
}
KINDS = """
import json, sys
from collections import Counter
try:
    import Part
    shape = Part.Shape()
    shape.read("given.step")
    kinds = Counter(type(face.Surface).__name__ for face in shape.Faces)
    open("kinds.json", "w").write(json.dumps(kinds))
except Exception as error:
    print(error)
    sys.exit(3)
"""


def wanted(export: Path, relative: float) -> list[ExpectedPart]:
    """What the records and the meshes say; volumes may differ by this share."""
    import trimesh

    design = json.loads((export / "design.json").read_text())
    record = export / "prototype.json"
    made = json.loads(record.read_text()) if record.exists() else {"parts": []}
    found = []
    for part in [*design["parts"], *made["parts"]]:
        volume = float(trimesh.load_mesh(export / part["stl"]).volume)
        files = {kind: part[kind] for kind in ("step", "stl", "3mf")}
        spheres = mirrors(export, part["camera"]) if "camera" in part else None
        found.append(ExpectedPart(part["name"], files, spheres, volume, relative * volume))
    return found


def trimesh_volume(stl: Path) -> float:
    import trimesh

    return float(trimesh.load_mesh(stl).volume)


def mirrors(export: Path, camera: str) -> int:
    """Number of a camera's curved mirrors."""
    rows = read_csv(export / "mirrors.csv")
    return sum(row["camera"] == camera and row["radius_mm"] != "" for row in rows)


def of(program: str, checks: Iterable[Check]) -> list[Check]:
    """One program's checks."""
    mine = [check for check in checks if check.name.split()[0] == program]
    if all(map(is_skipped, mine)):
        pytest.skip(mine[0].detail)
    return mine


@pytest.fixture(scope="module")
def mandrels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's shells with their negatives."""
    out = tmp_path_factory.mktemp("clients") / "mandrels"
    options = ["--parts", "shell", "--set", "shell.negative=true", "--no-verify"]
    assert run(["build", "--out", str(out), *options]) == 0
    return out


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's design, both halves and the prototype."""
    out = tmp_path_factory.mktemp("clients") / "exports"
    assert run(["build", "--out", str(out), "--no-verify"]) == 0
    return out


@pytest.fixture(scope="module")
def parts(export: Path) -> list[ExpectedPart]:
    found = wanted(export, 5e-3)
    shells = [(part.name, part.spheres) for part in found[:2]]
    assert shells == [("shell_a", 847), ("shell_b", 847)]
    assert "carrier" in {part.name for part in found[2:]}
    return found


@pytest.fixture(scope="module")
def checks(export: Path, parts: list[ExpectedPart]) -> list[Check]:
    before = {path: path.stat() for path in export.iterdir()}
    found = check_with_programs(export, parts)
    assert {path: path.stat().st_mtime_ns for path in export.iterdir()} == {
        path: stat.st_mtime_ns for path, stat in before.items()
    }
    return found


@pytest.mark.parametrize("program", PROGRAMS)
def test_each_program_passes_every_part(
    checks: list[Check], parts: list[ExpectedPart], program: str
) -> None:
    mine = of(program, checks)
    names = [f"{program} {question}" for question in PROGRAMS[program]]
    assert [check.name for check in mine] == names * len(parts)
    for check in mine:
        assert check.passed is True, check
        assert check.measured is not None, check


def test_a_print_takes_filament_and_hours(checks: list[Check]) -> None:
    told = {(c.name, c.file): c.measured for c in of("prusa", checks) if c.limit is None}
    for shell in ("shell_a.stl", "shell_b.stl"):
        assert told["prusa filament", shell] == pytest.approx(82.8, rel=0.05)
        assert told["prusa time", shell] == pytest.approx(13.8, rel=0.2)


def test_meshes_are_fine(export: Path) -> None:
    """What was checked above were no coarse stand-ins."""
    assert all((export / f"shell_{c}.stl").stat().st_size > 50 * 100_000 for c in "ab")


@pytest.mark.parametrize("camera", ["a", "b"])
def test_freecad_sees_bolt_and_dowel_holes(export: Path, camera: str) -> None:
    command = on_path("freecadcmd", "FreeCADCmd")
    if not command:
        pytest.skip("freecadcmd is not installed")
    with sandbox(command, export, f"shell_{camera}.step", "step", Limits()) as given:
        (given.folder / "look.py").write_text(KINDS)
        done = given.run(given.folder / "look.py")
        assert done.code == 0, done
        kinds = json.loads((given.folder / "kinds.json").read_text())
    assert kinds["Sphere"] == 847
    assert kinds["Cylinder"] == 15


@pytest.mark.parametrize("program", ["freecad", "gmsh", "admesh"])
def test_each_program_passes_a_mandrel(mandrels: Path, program: str) -> None:
    volume = trimesh_volume(mandrels / "mandrel_a.stl")
    files = {kind: f"mandrel_a.{kind}" for kind in ("step", "stl", "3mf")}
    part = ExpectedPart("mandrel_a", files, 847, volume, 1e-3 * volume)
    for check in of(program, check_with_programs(mandrels, [part])):
        assert check.passed is True, check
        assert check.measured is not None, check


@pytest.mark.parametrize("camera", ["a", "b"])
def test_freecad_sees_a_mandrels_blind_holes(mandrels: Path, camera: str) -> None:
    command = on_path("freecadcmd", "FreeCADCmd")
    if not command:
        pytest.skip("freecadcmd is not installed")
    with sandbox(command, mandrels, f"mandrel_{camera}.step", "step", Limits()) as given:
        (given.folder / "look.py").write_text(KINDS)
        done = given.run(given.folder / "look.py")
        assert done.code == 0, done
        kinds = json.loads((given.folder / "kinds.json").read_text())
    assert kinds == {"Sphere": 847, "Cylinder": 15, "Plane": 2 + 15}


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def rubbish(path: Path) -> None:
    path.write_text(
        "ISO-10303-21;\nHEADER;\nthis is no STEP file, and no STL file either\n" * 9,
        encoding="utf-8",
    )


def empty(path: Path) -> None:
    path.write_bytes(b"")


def without_a_facet(path: Path) -> None:
    data = bytearray(path.read_bytes()[:-50])
    data[80:84] = (int.from_bytes(data[80:84], "little") - 1).to_bytes(4, "little")
    path.write_bytes(data)


def turned_facet(path: Path) -> None:
    """Two corners of the last one swapped."""
    data = path.read_bytes()
    first, second = data[-38:-26], data[-26:-14]
    path.write_bytes(data[:-38] + second + first + data[-14:])


def without_a_face(path: Path) -> None:
    """The shell lists a face less, and so is open."""
    head, mark, tail = path.read_text(encoding="utf-8").partition("CLOSED_SHELL('',(")
    assert mark
    path.write_text(head + mark + tail.partition(",")[2], encoding="utf-8")


def an_inch(path: Path) -> None:
    """Another unit, all else as it was."""
    text = path.read_text(encoding="utf-8")
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    path.write_text(
        text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"), encoding="utf-8"
    )


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return Path(shutil.copytree(SAMPLE, tmp_path / "sample"))


def asked(sample: Path, kind: str, program: str, **others: float) -> dict[str, bool | None]:
    """Verdicts on shell_a's one file of a kind."""
    part = replace(wanted(SAMPLE, 0.02)[0], **others)
    said = of(program, check_with_programs(sample, [part], queries=[READERS[program, kind]]))
    return {check.name.split()[1]: check.passed for check in said}


@pytest.mark.parametrize("program", ["freecad", "gmsh"])
@pytest.mark.parametrize("damage", [cut, rubbish, empty])
def test_a_broken_step_passes_nothing(
    sample: Path, program: str, damage: Callable[[Path], None]
) -> None:
    damage(sample / "shell_a.step")
    verdicts = asked(sample, "step", program)
    assert len(verdicts) == len(PROGRAMS[program])
    assert True not in verdicts.values()


@pytest.mark.parametrize("program", ["freecad", "gmsh"])
def test_an_open_step_is_no_solid(sample: Path, program: str) -> None:
    without_a_face(sample / "shell_a.step")
    verdicts = asked(sample, "step", program)
    assert verdicts["solids"] is False
    assert verdicts.get("valid", False) is False


@pytest.mark.parametrize("program", ["freecad", "gmsh"])
def test_a_step_in_another_unit(sample: Path, program: str) -> None:
    assert asked(sample, "step", program)["volume"] is True
    an_inch(sample / "shell_a.step")
    verdicts = asked(sample, "step", program)
    assert verdicts["volume"] is False
    assert verdicts["solids"] is True


@pytest.mark.parametrize("program", ["freecad", "gmsh"])
def test_spheres_that_are_none(sample: Path, program: str) -> None:
    """The sample's mirrors are planar."""
    verdicts = asked(sample, "step", program, spheres=1)
    assert verdicts.pop("spheres") is False
    assert {*verdicts.values()} == {True}


@pytest.mark.parametrize(("program", "question"), [("prusa", "manifold"), ("admesh", "repairs")])
@pytest.mark.parametrize("damage", [without_a_facet, turned_facet])
def test_a_holed_or_turned_mesh_fails(
    sample: Path, program: str, question: str, damage: Callable[[Path], None]
) -> None:
    damage(sample / "shell_a.stl")
    assert asked(sample, "stl", program, volume=math.nan)[question] is False


@pytest.mark.parametrize("program", ["prusa", "admesh"])
@pytest.mark.parametrize("damage", [rubbish, empty])
def test_a_broken_mesh_passes_nothing(
    sample: Path, program: str, damage: Callable[[Path], None]
) -> None:
    damage(sample / "shell_a.stl")
    assert True not in asked(sample, "stl", program).values()


def test_a_broken_3mf_passes_nothing(sample: Path) -> None:
    cut(sample / "shell_a.3mf")
    assert True not in asked(sample, "3mf", "prusa").values()

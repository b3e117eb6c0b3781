"""Programs that users open our files with. Each is skipped when it is not installed."""

import json
import math
import shutil
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from tbcad_verify.programs import (
    ExpectedPart,
    check_with_programs,
    is_skipped,
)
from tbcad_verify.programs.program_query import on_path, sandbox
from tbcad_verify.programs.programs import FREECAD, GMSH, PRUSA_3MF, PRUSA_STL
from tbcad_verify.report.checks import Check
from tbcad_verify.run.child import Limits

from tbcad.app.cli import run
from tests.exported_files import read_csv

pytestmark = [pytest.mark.clients, pytest.mark.slow]

Damage = Callable[[bytes], bytes]

SAMPLE = Path(__file__).parents[2] / "docs" / "sample"
PROGRAMS = {
    "freecad": ["solids", "valid", "spheres", "volume"],
    "gmsh": ["solids", "spheres", "volume"],
    "prusa": ["manifold", "parts", "volume"] * 2 + ["slices", "filament", "time"],
}
READERS = {
    ("freecad", "step"): FREECAD,
    ("gmsh", "step"): GMSH,
    ("prusa", "stl"): PRUSA_STL,
    ("prusa", "3mf"): PRUSA_3MF,
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
    for part in [*design["parts"], *design.get("mandrels", ()), *made["parts"]]:
        volume = float(trimesh.load_mesh(export / part["stl"]).volume)
        files = {kind: part[kind] for kind in ("step", "stl", "3mf")}
        spheres = mirrors(export, part["camera"]) if "camera" in part else None
        found.append(ExpectedPart(part["name"], files, spheres, volume, relative * volume))
    return found


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


SMALL = ["--n", "6", "--set", "camera.width_px=1040", "--set", "camera.height_px=776"]
MIRRORS = 103  # of n = 6, a camera


def built(out: Path, *options: str) -> Path:
    """The paper's design with options."""
    assert run(["build", "--out", str(out), *options, "--no-verify"]) == 0
    return out


@pytest.fixture(scope="module")
def mandrels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Shells with their negatives."""
    out = tmp_path_factory.mktemp("clients") / "mandrels"
    return built(out, *SMALL, "--parts", "shell", "--set", "shell.negative=true")


@pytest.fixture(scope="module")
def pedestals(tmp_path_factory: pytest.TempPathFactory) -> list[Check]:
    """What programs say of both halves on pedestals."""
    out = tmp_path_factory.mktemp("clients") / "pedestals"
    built(out, *SMALL, "--parts", "shell", "--set", "shell.edges=pedestal")
    parts = wanted(out, 5e-3)
    assert [part.name for part in parts] == ["shell_a", "shell_b"]
    return check_with_programs(out, parts)


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's design, both halves and the prototype."""
    return built(tmp_path_factory.mktemp("clients") / "exports")


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


def check_passed(checks: Iterable[Check]) -> None:
    for check in checks:
        assert check.passed is True, check
        assert check.measured is not None, check


@pytest.mark.parametrize("program", PROGRAMS)
def test_each_program_passes_every_part(
    checks: list[Check], parts: list[ExpectedPart], program: str
) -> None:
    mine = of(program, checks)
    names = [f"{program} {question}" for question in PROGRAMS[program]]
    assert [check.name for check in mine] == names * len(parts)
    check_passed(mine)


def test_a_print_takes_filament_and_hours(checks: list[Check]) -> None:
    told = {(c.name, c.file): c.measured for c in of("prusa", checks) if c.limit is None}
    for shell in ("shell_a.stl", "shell_b.stl"):
        assert told["prusa filament", shell] == pytest.approx(82.8, rel=0.05)
        assert told["prusa time", shell] == pytest.approx(13.8, rel=0.2)


def test_meshes_are_fine(export: Path) -> None:
    """What was checked above were no coarse stand-ins."""
    assert all((export / f"shell_{c}.stl").stat().st_size > 50 * 100_000 for c in "ab")


@pytest.mark.parametrize("program", PROGRAMS)
def test_each_program_takes_shells_on_pedestals(pedestals: list[Check], program: str) -> None:
    mine = of(program, pedestals)
    assert {check.name for check in mine} == {f"{program} {one}" for one in PROGRAMS[program]}
    check_passed(mine)


@pytest.mark.parametrize("program", PROGRAMS)
def test_each_program_passes_a_mandrel(mandrels: Path, program: str) -> None:
    (part,) = (one for one in wanted(mandrels, 1e-3) if one.name == "mandrel_a")
    queries = [query for (name, _), query in READERS.items() if name == program]
    check_passed(check_with_programs(mandrels, [part], queries=queries))


@pytest.mark.parametrize("camera", ["a", "b"])
@pytest.mark.parametrize("body", ["shell", "mandrel"])
def test_freecad_sees_bolt_and_dowel_holes(mandrels: Path, body: str, camera: str) -> None:
    """Those of a mandrel are blind."""
    command = on_path("freecadcmd", "FreeCADCmd")
    if not command:
        pytest.skip("freecadcmd is not installed")
    with sandbox(command, mandrels, f"{body}_{camera}.step", "step", Limits()) as given:
        (given.folder / "look.py").write_text(KINDS)
        done = given.run(given.folder / "look.py")
        assert done.code == 0, done
        kinds = json.loads((given.folder / "kinds.json").read_text())
    assert (kinds["Sphere"], kinds["Cylinder"]) == (MIRRORS, 15)
    if body == "mandrel":
        assert kinds == {"Sphere": MIRRORS, "Cylinder": 15, "Plane": 2 + 15}


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def rubbish(_: bytes) -> bytes:
    return b"ISO-10303-21;\nHEADER;\nthis is no STEP file, and no STL file either\n" * 9


def empty(_: bytes) -> bytes:
    return b""


def without_a_facet(data: bytes) -> bytes:
    count = int.from_bytes(data[80:84], "little") - 1
    return data[:80] + count.to_bytes(4, "little") + data[84:-50]


def turned_facet(data: bytes) -> bytes:
    """Two corners of the last one swapped."""
    return data[:-38] + data[-26:-14] + data[-38:-26] + data[-14:]


def without_a_face(data: bytes) -> bytes:
    """The shell lists a face less, and so is open."""
    head, mark, tail = data.partition(b"CLOSED_SHELL('',(")
    assert mark
    return head + mark + tail.partition(b",")[2]


def an_inch(data: bytes) -> bytes:
    """Another unit, all else as it was."""
    assert b"SI_UNIT(.MILLI.,.METRE.)" in data
    return data.replace(b"SI_UNIT(.MILLI.,.METRE.)", b"SI_UNIT(.CENTI.,.METRE.)")


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return Path(shutil.copytree(SAMPLE, tmp_path / "sample"))


def asked(
    sample: Path, kind: str, program: str, damage: Damage = bytes, **others: float
) -> dict[str, bool | None]:
    """Verdicts on shell_a's one file of a kind, damaged."""
    file = sample / f"shell_a.{kind}"
    file.write_bytes(damage(file.read_bytes()))
    part = replace(wanted(SAMPLE, 0.02)[0], **others)
    said = of(program, check_with_programs(sample, [part], queries=[READERS[program, kind]]))
    return {check.name.split()[1]: check.passed for check in said}


@pytest.mark.parametrize(
    ("program", "kind", "damage"),
    [
        *product(("freecad", "gmsh"), ("step",), (cut, rubbish, empty)),
        *product(("prusa",), ("stl",), (rubbish, empty)),
        ("prusa", "3mf", cut),
    ],
)
def test_a_broken_file_passes_nothing(
    sample: Path, program: str, kind: str, damage: Damage
) -> None:
    verdicts = asked(sample, kind, program, damage)
    assert kind != "step" or len(verdicts) == len(PROGRAMS[program])
    assert True not in verdicts.values()


@pytest.mark.parametrize("program", ["freecad", "gmsh"])
def test_a_step_that_is_open_or_in_another_unit_or_without_spheres(
    sample: Path, program: str
) -> None:
    """The sample's mirrors are planar."""
    verdicts = asked(sample, "step", program, spheres=1)
    assert verdicts.pop("spheres") is False
    assert {*verdicts.values()} == {True}
    shutil.copytree(SAMPLE, sample, dirs_exist_ok=True)
    verdicts = asked(sample, "step", program, an_inch)
    assert (verdicts["volume"], verdicts["solids"]) == (False, True)
    shutil.copytree(SAMPLE, sample, dirs_exist_ok=True)
    verdicts = asked(sample, "step", program, without_a_face)
    assert (verdicts["solids"], verdicts.get("valid", False)) == (False, False)


@pytest.mark.parametrize("damage", [without_a_facet, turned_facet])
def test_a_holed_or_turned_mesh_fails(sample: Path, damage: Damage) -> None:
    assert asked(sample, "stl", "prusa", damage, volume=math.nan)["manifold"] is False

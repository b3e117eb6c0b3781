"""Programs that users open our files with. Each is skipped when it is not installed."""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tbcad.cli import run

pytestmark = pytest.mark.clients

INSPECT = """
import json, os, sys
from collections import Counter
try:
    import Part
    found = {}
    for path in os.environ["STEP_FILES"].split(os.pathsep):
        shape = Part.Shape()
        shape.read(path)
        kinds = Counter(type(face.Surface).__name__ for face in shape.Faces)
        found[os.path.basename(path)] = {
            "solids": len(shape.Solids),
            "valid": all(solid.isValid() and solid.isClosed() for solid in shape.Solids),
            "volume": shape.Volume,
            "kinds": dict(kinds),
        }
    open(os.environ["FOUND"], "w").write(json.dumps(found))
except Exception as error:
    print(error)
    sys.exit(3)
"""


def program(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not installed")
    return path


def told(*command: str, **environment: str) -> str:
    done = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONPATH": "", **environment},
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's design, both halves."""
    out = tmp_path_factory.mktemp("clients") / "exports"
    assert run(["build", "--out", str(out), "--no-verify"]) == 0
    return out


@pytest.fixture(scope="module")
def volumes(export: Path) -> dict[str, float]:
    import trimesh

    return {c: float(trimesh.load_mesh(export / f"shell_{c}.stl").volume) for c in "ab"}


def test_freecad_opens_both_shells(export: Path, volumes: dict[str, float], tmp_path: Path) -> None:
    command = program("freecadcmd")
    script, found = tmp_path / "look_into.py", tmp_path / "found.json"
    script.write_text(INSPECT)
    files = os.pathsep.join(str(export / f"shell_{c}.step") for c in "ab")
    told(command, str(script), STEP_FILES=files, FOUND=str(found))
    for camera, volume in volumes.items():
        shell = json.loads(found.read_text())[f"shell_{camera}.step"]
        assert shell["solids"] == 1
        assert shell["valid"]
        assert shell["kinds"]["Sphere"] == 847
        assert shell["kinds"]["Cylinder"] == 15
        assert shell["volume"] == pytest.approx(volume, rel=5e-3)


@pytest.mark.parametrize("camera", ["a", "b"])
def test_gmsh_reads_the_step(export: Path, volumes: dict[str, float], camera: str) -> None:
    gmsh = pytest.importorskip("gmsh", exc_type=OSError)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        shapes = gmsh.model.occ.importShapes(str(export / f"shell_{camera}.step"))
        gmsh.model.occ.synchronize()
        assert [dimension for dimension, _ in shapes] == [3]
        assert gmsh.model.occ.getMass(*shapes[0]) == pytest.approx(volumes[camera], rel=5e-3)
        kinds = [gmsh.model.getType(2, tag) for _, tag in gmsh.model.getEntities(2)]
        assert kinds.count("Sphere") == 847
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("file", ["shell_a.stl", "shell_b.stl", "shell_a.3mf"])
def test_prusa_slicer_finds_the_mesh_manifold(export: Path, file: str) -> None:
    info = told(program("prusa-slicer"), "--info", str(export / file))
    assert "manifold = yes" in info
    assert re.search(r"number_of_parts = +1\n", info)
    assert "open_edges" not in info
    assert "repaired" not in info


def test_prusa_slicer_slices_a_shell(export: Path, tmp_path: Path) -> None:
    code = tmp_path / "shell.gcode"
    bed = "0x0,400x0,400x400,0x400"
    slicer = program("prusa-slicer")
    file = str(export / "shell_a.stl")
    told(slicer, "-g", "--bed-shape", bed, "--layer-height", "0.3", "-o", str(code), file)
    assert "; filament used [mm]" in code.read_text()


@pytest.mark.parametrize("camera", ["a", "b"])
def test_admesh_has_nothing_to_repair(export: Path, camera: str) -> None:
    """It repairs before it reports: the "Original" column must already be right."""
    report = told(program("admesh"), str(export / f"shell_{camera}.stl"))
    figures = dict(re.findall(r"^(\w[\w ]*?) +: +(\d+)", report, flags=re.MULTILINE))
    assert int(figures["Number of facets"]) > 100_000
    for name, figure in figures.items():
        if "disconnected" in name:
            assert int(figure) == 0, name
    assert figures["Number of parts"] == "1"
    for name in ("Degenerate facets", "Edges fixed", "Facets removed", "Facets reversed"):
        assert figures[name] == "0", name

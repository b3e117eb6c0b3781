"""tbcad drawings: what it refuses, in one line, and writes nothing then."""

import json
import math
import shutil
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import trimesh

from tbcad.app.cli import run

SAMPLE = Path(__file__).parents[3] / "docs" / "sample"


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert run(["drawings", *arguments]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    return shown.err


def test_a_changed_file_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    export = shutil.copytree(SAMPLE, tmp_path / "exports")
    design = json.loads((export / "design.json").read_text())
    (export / "design.json").write_text(json.dumps(design))
    words = refused([str(export), "--out", str(tmp_path / "out")], capsys)
    assert "design.json is not as tbcad wrote it" in words


def test_the_section_of_the_samples_shell(tmp_path: Path) -> None:
    """Its outline is as wide and high as that of the shell's mesh, cut in the same plane."""
    assert run(["drawings", str(SAMPLE), "--only", "shell_a", "--out", str(tmp_path)]) == 0
    space = ezdxf.readfile(tmp_path / "shell_a.dxf").modelspace()
    cut = trimesh.load_mesh(SAMPLE / "shell_a.stl").section([0, 1, 0], [0, 0, 0])
    low, high = cut.bounds[:, [0, 2]]
    design = json.loads((SAMPLE / "design.json").read_text())
    chord = design["spec"]["mesh"]["structure_error_mm"]  # the mesh is inside by that at most
    lines = [one for one in space.query("LINE") if one.dxf.layer == "cut"]
    ends = np.array([(*one.dxf.start.vec2, *one.dxf.end.vec2) for one in lines]).reshape(-1, 2)
    assert ends.max(axis=0) == pytest.approx(high, abs=chord)
    assert ends[:, 0].min() == pytest.approx(low[0], abs=chord)
    width, height, top = (one.dxf.actual_measurement for one in space.query("DIMENSION"))
    assert (width, height) == pytest.approx((high - low).tolist(), abs=chord)
    assert top == pytest.approx(high[1], abs=chord)
    assert len(space.query('LINE[layer=="hatch"]')) > 20


def test_the_optical_layout_of_the_sample(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its foci, capture sphere and virtual cameras are the design's; never written twice."""
    words = ["drawings", str(SAMPLE), "--only", "optical_layout", "--out", str(tmp_path), "--json"]
    assert run(words) == 0
    shown = json.loads(capsys.readouterr().out)
    (sheet,) = shown["sheets"]
    assert sheet["files"] == ["optical_layout.pdf", "optical_layout.dxf"]
    space = ezdxf.readfile(tmp_path / "optical_layout.dxf").modelspace()
    design = json.loads((SAMPLE / "design.json").read_text())["spec"]["optics"]
    x, _, z = design["camera_mm"]
    (sphere,) = [
        one
        for one in space.query('CIRCLE[layer=="cut"]')
        if one.dxf.center.magnitude < 1e-9 and one.dxf.radius > 5
    ]
    assert sphere.dxf.radius == pytest.approx(design["capture_diameter_mm"] / 2)
    (orbit,) = [one for one in space.query("ARC") if one.dxf.layer == "centre"]
    major = math.hypot(design["semi_minor_mm"], math.hypot(x, z) / 2)
    assert orbit.dxf.radius == pytest.approx(2 * major)
    ellipses = [one for one in space.query("LWPOLYLINE") if len(one) > 300]
    assert len(ellipses) == 2
    for sign, ellipse in zip((1, -1), ellipses, strict=True):
        for px, pz, *_ in ellipse:
            total = math.hypot(px, pz) + math.hypot(px - sign * x, pz - z)
            assert total == pytest.approx(2 * major, abs=1e-3)
    rays = space.query('LWPOLYLINE[layer=="rays"]')
    assert rays
    for ray in rays:
        assert ray[0][:2] == pytest.approx((x, z))
    sizes = {one.dxf.text: one.dxf.actual_measurement for one in space.query("DIMENSION")}
    assert sizes == {
        "capture sphere <>": pytest.approx(design["capture_diameter_mm"]),
        "<>": pytest.approx(2 * x),
    }
    assert refused([*words[1:-1]], capsys).endswith("replace it with --force\n")

"""tbcad capture, view and refocus from the command line."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.app.cli import run
from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.options.shared import numbers
from tbcad.rig.runs import read_run
from tests.exported_files import contents


def test_capture_writes_pictures_and_light_field(captured: Path) -> None:
    names = ["camera_a.png", "camera_b.png", "capture.json", "lightfield.h5", "manifest.json",
             "object.npz"]  # fmt: skip
    assert sorted(path.name for path in captured.iterdir()) == names
    record = json.loads((captured / "capture.json").read_text())
    assert record["object"] == "trefoil knot"
    assert record["geometry"] == "spheres"
    with LightField.open(captured) as source:
        for camera, frame in source.frames.items():
            picture = np.asarray(Image.open(captured / f"camera_{camera}.png"))
            assert np.array_equal(picture, frame.image())
            on = int((frame.planes["mirror"][:] > 0).sum())
            assert record["cameras"][camera]["pixels_on_mirrors"] == on


@pytest.fixture
def copied(captured: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(captured, tmp_path / "copy"))


def test_capture_repeats_and_replaces_with_force_only(
    copied: Path, record: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(copied)
    assert run(["capture", str(record), "--out", str(copied)]) == 2
    assert "is a capture already: name another folder" in capsys.readouterr().err
    assert run(["capture", str(record), "--out", str(copied), "--force"]) == 0
    assert contents(copied) == before


def test_capture_is_named_after_its_object(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box((10, 10, 10)).export("my box.stl")
    for words in ([], ["--object", "my box.stl"]):
        assert run(["capture", str(record), *words]) == 0
    assert sorted(path.name for path in Path("captures").iterdir()) == ["knot", "my box"]


def test_capture_says_how_a_file_was_taken(
    record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file of millimetres, y up, whose texture is lost."""
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 0.5 0\nmap_Kd C:\\lost.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 9 0 0\nv 0 9 0\nvt 0 0\nf 1/1 2/1 3/1\n"
    )
    arguments = ["capture", str(record), "--object", str(tmp_path / "a.obj"), "--up", "y"]
    assert run([*arguments, "--out", str(tmp_path / "out"), "--json"]) == 0
    printed = capsys.readouterr()
    lost = "its texture C:\\lost.png is not in the folder of the mesh"
    assert f"tbcad: warning: a.obj: {lost}" in printed.err
    assert "a.obj: unit mm, y up, colours: colours of materials (Kd)" in printed.err
    wanted = {"unit": "mm", "up": "y", "colours": "colours of materials (Kd)", "left_out": [lost]}
    assert json.loads(printed.out)["object_file"] == wanted
    assert json.loads((tmp_path / "out/capture.json").read_text())["object_file"] == wanted


def test_depth_of_a_view(captured: Path, tmp_path: Path) -> None:
    words = ["view", str(captured), "--method", "depth", "--out", str(tmp_path / "view.png")]
    words += ["--width", "160", "--height", "120"]
    png, ply = tmp_path / "depth.png", tmp_path / "points.ply"
    assert run([*words, "--depth", str(png), "--depth", str(ply)]) == 0
    assert Image.open(png).size == (40, 30)
    assert ply.read_bytes().startswith(b"ply\n")
    first = png.read_bytes(), ply.read_bytes()
    assert run([*words, "--depth", str(png), "--depth", str(ply), "--force"]) == 0
    assert (png.read_bytes(), ply.read_bytes()) == first


def test_pictures_that_exist_are_replaced_on_force_only(
    captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The comparison and the animation too, which are written beside the picture."""
    out, small = tmp_path / "view.png", ["--width", "64", "--height", "48"]
    view = ["view", str(captured), "-o", str(out), *small]
    sweep = ["--sweep", str(tmp_path / "f.gif"), "--frames", "2", "--truth-samples", "1"]
    refocus = ["refocus", str(captured), "-o", str(tmp_path / "f.png"), *small, *sweep]
    for command, names in (
        (view, ("view.png", "view-truth.png", "view-and-truth.png")),
        (refocus, ("f.png", "f-truth.png", "f-and-truth.png", "f.gif")),
    ):
        for name in names:
            (tmp_path / name).write_text("mine")
            assert run(command) == 2
            assert f"{tmp_path / name} exists: " in (line := capsys.readouterr().err)
            assert "--force" in line
            assert contents(tmp_path) == {name: b"mine"}
            (tmp_path / name).unlink()
    for command in (view, refocus):
        assert run(command) == 0
        assert run(command) == 2
        before = contents(tmp_path)
        (tmp_path / command[3]).write_text("older")
        assert run([*command, "--force"]) == 0
        assert contents(tmp_path) == before


def test_the_method_and_why(
    captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without a mesh a view is blended at the depth that is found, if nothing else is said."""
    view = ["view", str(captured), "--width", "64", "--height", "48", "--force"]
    view += ["--out", str(tmp_path / "v.png")]
    for more, expected in (
        ([], "method depth: a blend at the depth that is found"),
        (["--method", "depth"], "method depth: as --method says"),
        (["--method", "nearest"], "method nearest: as --method says"),
    ):
        assert run([*view, *more]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert sum(line.startswith("method ") for line in lines) == 1
        assert any(line.startswith(expected) for line in lines)


def test_a_lens_wider_than_its_distance_is_warned_of(
    captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["refocus", str(captured), "--width", "32", "--height", "24", "--force"]
    arguments += ["--truth-samples", "1", "--out", str(tmp_path / "f.png"), "--elevation", "60"]
    for aperture, warnings in (("3000", 1), ("300", 0)):
        assert run([*arguments, "--aperture", aperture]) == 0
        said = capsys.readouterr().err
        assert said.count("tbcad: warning: --aperture 3000 is more than --distance 640") == warnings
        assert said.count("warning") == warnings


def test_view_without_an_object_has_no_truth(captured: Path, tmp_path: Path) -> None:
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "lightfield.h5").write_bytes((captured / "lightfield.h5").read_bytes())
    out = tmp_path / "view.png"
    small = ["--width", "64", "--height", "48", "--out", str(out)]
    assert run(["view", str(alone), *small]) == 0
    assert not (tmp_path / "view-truth.png").exists()


def test_refocus_and_sweep(
    captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["refocus", str(captured), "--elevation", "45", "--width", "96", "--height", "72"]
    arguments += ["--out", str(tmp_path / "f.png"), "--sweep", str(tmp_path / "f.gif")]
    assert run([*arguments, "--frames", "3", "--truth-samples", "16"]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {
        "f.png", "f-truth.png", "f-and-truth.png", "f.gif"
    }  # fmt: skip
    assert "PSNR" in capsys.readouterr().out


def test_all_in_focus(captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["refocus", str(captured), "--all-in-focus", "--aperture", "80", "--width", "96"]
    words += ["--height", "72", "--out", str(tmp_path / "f.png")]
    assert run(words) == 0
    assert "against the pinhole picture" in capsys.readouterr().out
    assert run([*words, "--sweep", str(tmp_path / "f.gif")]) == 2
    assert "leave out --sweep" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "a", "1,,2", "1-b", "5-2", "7,5-2", "1-99999999999", "1.5"])
def test_no_numbers(text: str) -> None:
    assert numbers("1,5,20-22, 3") == (1, 3, 5, 20, 21, 22)
    with pytest.raises(InputError, match=r"write for instance 1,5,20-30"):
        numbers(text)


def test_a_run_by_the_command(
    export_with_wind_up: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    words = ["simulate-run", str(export_with_wind_up), "--seed", "3", "-o", str(out)]
    assert run([*words, "--stops", "20", "--phases", "dark,led_1,lit"]) == 0
    assert "6 photographs of 2 frames" in capsys.readouterr().out
    found = read_run(out)
    assert not found.faults
    assert found.record.phases == ("dark", "led_1", "lit")
    assert run([*words, "--stops", "20"]) == 2
    assert "photographs are not replaced" in capsys.readouterr().err

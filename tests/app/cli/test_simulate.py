"""tbcad capture, view and refocus from the command line."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.app.cli import run
from tbcad.core.camera.sheet import write_camera_sheet
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.options.shared import numbers
from tbcad.records.camera_sheet import CameraSheet, RealOpticsRecord
from tbcad.rig.runs import read_run
from tests.app.cli.commands import Command
from tests.exported_files import contents

SMALL = ["--width", "64", "--height", "48"]


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


def test_capture_repeats_and_replaces_with_force_only(
    captured: Path, tmp_path: Path, record: Path, cli: Command
) -> None:
    copied = Path(shutil.copytree(captured, tmp_path / "copy"))
    capture = ["capture", record, "--out", copied]
    assert "is a capture already: name another folder" in cli(*capture, code=2).err
    cli(*capture, "--force")
    assert contents(copied) == contents(captured)


def test_capture_with_real_optics(
    record: Path, low_resolution_design: MirrorDesign, tmp_path: Path, cli: Command
) -> None:
    """By the lens of camera.json; the record says what is in it."""
    export, out = tmp_path / "export", tmp_path / "out"
    shutil.copytree(record, export)
    real = ["capture", export, "--optics", "real", "--out", out]
    line = cli(*real, code=2).err
    assert "camera.json is not there: build it again with tbcad build, or leave out" in line
    assert not out.exists()
    write_camera_sheet(export, low_resolution_design.arrays[0], 30.0)
    cli(*real, "--gloss", "0.3")
    written = json.loads((out / "capture.json").read_text())
    assert written["optics"] == "real"
    lens = RealOpticsRecord.model_validate(written["real"])
    needed = json.loads((export / "camera.json").read_text())["requirements"]
    assert (lens.pupil_mm, lens.focus_mm) == (needed["pupil_mm"], needed["focus_mm"])
    assert (lens.lens, lens.gloss, lens.rays_a_pixel) == (None, 0.3, 4)
    with LightField.open(out) as source:
        assert source.facts["real"] == written["real"]
    assert "PSNR" in cli("view", out, "--out", tmp_path / "view.png", *SMALL).out


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("pupil_mm", 1e-9, "pupil_mm: input should be greater"),
        ("pupil_mm", "0.9", "pupil_mm: input should be a valid number"),
        ("focus_mm", True, "focus_mm: input should be a valid number"),
        ("mounted", "x", "mounted: x is none of the candidates"),
    ],
)
def test_an_edited_camera_sheet_is_refused(
    tmp_path: Path, low_resolution_design: MirrorDesign, key: str, value: object, reason: str
) -> None:
    write_camera_sheet(tmp_path, low_resolution_design.arrays[0], 30.0)
    sheet = json.loads((tmp_path / "camera.json").read_text())
    (sheet if key in sheet else sheet["requirements"])[key] = value
    (tmp_path / "camera.json").write_text(json.dumps(sheet))
    with pytest.raises(InputError, match=reason):
        CameraSheet.read(tmp_path / "camera.json")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--gloss", "0.3"], "--gloss is of --optics real"),
        (["--optics", "real", "--mesh"], "--optics real is not for --mesh"),
        (["--optics", "real", "--samples", "2"], "--optics real is not for --samples"),
        (["--optics", "real", "--frames", "2"], "--optics real is not for --frames"),
        (["--optics", "real", "--lights", "mirrors"], "--optics real is not for --lights"),
        (["--optics", "real", "--gloss", "0.01"], "--gloss"),
        (["--optics", "real", "--gloss", "nan"], "--gloss"),
        (["--optics", "good"], "--optics"),
    ],
)
def test_optics_that_do_not_go_together(
    record: Path, tmp_path: Path, cli: Command, words: list[str], reason: str
) -> None:
    line = cli("capture", record, "--out", tmp_path / "out", *words, code=2).err
    assert reason in line
    assert line.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_capture_is_named_after_its_object(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box((10, 10, 10)).export("my box.stl")
    for words in ([], ["--object", "my box.stl"]):
        assert run(["capture", str(record), *words]) == 0
    assert sorted(path.name for path in Path("captures").iterdir()) == ["knot", "my box"]


def test_capture_says_how_a_file_was_taken(record: Path, tmp_path: Path, cli: Command) -> None:
    """A file of millimetres, y up, with a map that is not converted."""
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 0.5 0\nmap_Bump C:\\lost.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 9 0 0\nv 0 9 0\nvt 0 0\nf 1/1 2/1 3/1\n"
    )
    out, mesh = tmp_path / "out", tmp_path / "a.obj"
    printed = cli("capture", record, "--object", mesh, "--up", "y", "--out", out, "--json")
    lost = "its map_Bump is left out"
    assert f"tbcad: warning: a.obj: {lost}" in printed.err
    assert "a.obj: unit mm, y up, colours: colours of materials (Kd)" in printed.err
    colours = "colours of materials (Kd)"
    wanted = {"unit": "mm", "up": "y", "colours": colours, "gloss": "", "left_out": [lost]}
    assert json.loads(printed.out)["object_file"] == wanted
    assert json.loads((out / "capture.json").read_text())["object_file"] == wanted


def test_depth_of_a_view(captured: Path, tmp_path: Path, cli: Command) -> None:
    png, ply = tmp_path / "depth.png", tmp_path / "points.ply"
    size = ["--width", "160", "--height", "120", "--out", tmp_path / "view.png", "--force"]
    words = ["view", captured, "--method", "depth", *size, "--depth", png, "--depth", ply]
    cli(*words)
    assert Image.open(png).size == (40, 30)
    assert ply.read_bytes().startswith(b"ply\n")
    first = png.read_bytes(), ply.read_bytes()
    cli(*words)
    assert (png.read_bytes(), ply.read_bytes()) == first


def test_pictures_that_exist_are_replaced_on_force_only(
    captured: Path, tmp_path: Path, cli: Command
) -> None:
    """The comparison and the animation too, which are written beside the picture."""
    view: list[Any] = ["view", captured, "-o", tmp_path / "view.png", *SMALL]
    sweep = ["--sweep", tmp_path / "f.gif", "--frames", "2", "--truth-samples", "1"]
    refocus: list[Any] = ["refocus", captured, "-o", tmp_path / "f.png", *SMALL, *sweep]
    for command, names in (
        (view, ("view.png", "view-truth.png", "view-and-truth.png")),
        (refocus, ("f.png", "f-truth.png", "f-and-truth.png", "f.gif")),
    ):
        for name in names:
            (tmp_path / name).write_text("mine")
            line = cli(*command, code=2).err
            assert f"{tmp_path / name} exists: " in line
            assert "--force" in line
            assert contents(tmp_path) == {name: b"mine"}
            (tmp_path / name).unlink()
    for command in (view, refocus):
        assert "PSNR" in cli(*command).out
        cli(*command, code=2)
        before = contents(tmp_path)
        command[3].write_text("older")
        cli(*command, "--force")
        assert contents(tmp_path) == before


def test_a_lens_wider_than_its_distance_is_warned_of(
    captured: Path, tmp_path: Path, cli: Command
) -> None:
    words = ["--width", "32", "--height", "24", "--force", "--truth-samples", "1"]
    words += ["--out", tmp_path / "f.png", "--elevation", "60"]
    for aperture, warnings in (("3000", 1), ("300", 0)):
        said = cli("refocus", captured, *words, "--aperture", aperture).err
        assert said.count("tbcad: warning: --aperture 3000 is more than --distance 640") == warnings
        assert said.count("warning") == warnings


def test_view_without_an_object_has_no_truth(captured: Path, tmp_path: Path, cli: Command) -> None:
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(captured / "lightfield.h5", alone)
    cli("view", alone, *SMALL, "--out", tmp_path / "view.png")
    assert not (tmp_path / "view-truth.png").exists()


def test_all_in_focus(captured: Path, tmp_path: Path, cli: Command) -> None:
    words = ["refocus", captured, "--all-in-focus", "--aperture", "80", *SMALL]
    assert "against the pinhole picture" in cli(*words, "--out", tmp_path / "f.png").out


def test_numbers_of_a_list() -> None:
    assert numbers("1,5,20-22, 3") == (1, 3, 5, 20, 21, 22)


def test_a_run_by_the_command(export_with_wind_up: Path, tmp_path: Path, cli: Command) -> None:
    out = tmp_path / "run"
    words = ["simulate-run", export_with_wind_up, "--seed", "3", "-o", out, "--stops", "20"]
    said = cli(*words, "--phases", "dark,led_1,lit").out
    assert "6 photographs of 2 frames" in said
    found = read_run(out)
    assert not found.faults
    assert found.record.phases == ("dark", "led_1", "lit")
    assert "photographs are not replaced" in cli(*words, code=2).err

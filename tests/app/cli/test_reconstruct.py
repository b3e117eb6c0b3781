"""tbcad reconstruct: its files, its refusals, and that Python gives the same."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.app.api import reconstruct
from tbcad.app.cli import run
from tbcad.light.reconstruction import fitted
from tests.ball_captures import ball, four, quick_choice  # noqa: F401 - fixtures

SMALL = ("--nodes", "24", "--epochs", "3", "--order", "0")


@pytest.fixture
def capture(ball: Path, tmp_path: Path) -> Path:  # noqa: F811
    """A copy, to write into."""
    return Path(shutil.copytree(ball, tmp_path / "it"))


def test_field_picture_and_verdict(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    preview = tmp_path / "p.png"
    assert run(["reconstruct", str(capture), *SMALL, "--preview", str(preview), "--json"]) == 0
    (record,) = json.loads(capsys.readouterr().out)["fields"]
    assert Path(record["file"]) == capture / "field.npz"
    assert record["psnr_left_out_db"] > 20
    assert np.asarray(Image.open(preview)).max() > 60
    assert {file.name for file in tmp_path.iterdir()} == {"it", "p.png"}
    reconstruct(capture, out=tmp_path / "f.npz", nodes=24, epochs=3, order="0")
    assert (tmp_path / "f.npz").read_bytes() == (capture / "field.npz").read_bytes()
    mesh, volume = tmp_path / "ball.ply", tmp_path / "ball.vti"
    files = ("--mesh", str(mesh), "--volume", str(volume))
    assert run(["reconstruct", str(capture), *SMALL, *files, "--resume"]) == 0
    assert volume.read_bytes().startswith(b"<?xml")
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].startswith("PSNR ")
    assert f"{capture / 'field.npz'}: was there already" in shown[3]
    triangles = len(trimesh.load_mesh(mesh).faces)
    assert shown[4] == f"{mesh}: {triangles} triangles"
    assert 0 < float(shown[5].removeprefix("  from the true object: mean ").split()[0]) < 2


def test_a_light_field_alone(ball: Path, tmp_path: Path) -> None:  # noqa: F811
    shutil.copy(ball / "lightfield.h5", tmp_path / "mine.h5")
    assert run(["reconstruct", str(tmp_path / "mine.h5"), *SMALL]) == 0
    assert (tmp_path / "field.npz").is_file()


def test_one_frame(capture: Path) -> None:
    assert run(["reconstruct", str(capture), *SMALL, "--frame", "1"]) == 0
    assert (capture / "field-1.npz").is_file()


def test_a_field_goes_with_its_capture(capture: Path, four: Path) -> None:  # noqa: F811
    assert run(["reconstruct", str(capture), *SMALL]) == 0
    shutil.copy(capture / "field.npz", capture / "mine.npz")
    (capture / "field-1.npz").write_text("no field", encoding="utf-8")
    assert run(["capture", str(four), "--out", str(capture), "--force"]) == 0
    assert {file.name for file in capture.glob("*.npz")} == {
        "object.npz", "mine.npz", "field-1.npz",
    }  # fmt: skip


def test_a_stop_says_how_to_go_on(
    capture: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(fitted, "_tell", stopped)
    assert run(["reconstruct", str(capture), *SMALL]) == 130
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("tbcad: stopped; ")
    assert line.endswith("go on with the same options and --resume")
    assert (capture / ".field.npz.part").is_file()


def test_what_exists_is_kept(capture: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (capture / "field.npz").write_text("mine", encoding="utf-8")
    assert run(["reconstruct", str(capture)]) == 2
    assert "field.npz exists: choose another name, or replace it with --force" in (
        capsys.readouterr().err
    )
    assert run(["reconstruct", str(capture), *SMALL, "--resume"]) == 2
    assert "field.npz is no field that tbcad wrote" in capsys.readouterr().err
    assert (capture / "field.npz").read_text(encoding="utf-8") == "mine"


def test_memory_that_is_not_there(
    ball: Path,  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("tbcad.app.api.reconstructions.available_memory_gb", lambda: 1.0)
    words = ["reconstruct", str(ball), "--nodes", "500", "--out", str(tmp_path / "f.npz")]
    assert run(words) == 2
    assert "memory is short: " in capsys.readouterr().err
    assert not list(tmp_path.iterdir())

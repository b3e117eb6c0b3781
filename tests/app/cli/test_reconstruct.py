"""tbcad reconstruct: its files, its refusals, and that Python gives the same."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.app.api import reconstruct
from tbcad.light.reconstruction import fitted
from tests.app.cli.commands import Command
from tests.ball_captures import ball, four, quick_choice  # noqa: F401 - fixtures

SMALL = ("--nodes", "24", "--epochs", "3", "--order", "0")


@pytest.fixture
def capture(ball: Path, tmp_path: Path) -> Path:  # noqa: F811
    """A copy, to write into."""
    return Path(shutil.copytree(ball, tmp_path / "it"))


def test_field_picture_and_verdict(capture: Path, tmp_path: Path, cli: Command) -> None:
    preview = tmp_path / "p.png"
    told = cli("reconstruct", capture, *SMALL, "--preview", preview, "--json").out
    (record,) = json.loads(told)["fields"]
    assert Path(record["file"]) == capture / "field.npz"
    assert record["psnr_left_out_db"] > 20
    assert np.asarray(Image.open(preview)).max() > 60
    assert {file.name for file in tmp_path.iterdir()} == {"it", "p.png"}
    reconstruct(capture, out=tmp_path / "f.npz", nodes=24, epochs=3, order="0")
    assert (tmp_path / "f.npz").read_bytes() == (capture / "field.npz").read_bytes()
    mesh, volume = tmp_path / "ball.ply", tmp_path / "ball.vti"
    files = ("--mesh", mesh, "--volume", volume)
    shown = cli("reconstruct", capture, *SMALL, *files, "--resume").out.splitlines()
    assert volume.read_bytes().startswith(b"<?xml")
    assert shown[0].startswith("PSNR ")
    assert f"{capture / 'field.npz'}: was there already" in shown[3]
    triangles = len(trimesh.load_mesh(mesh).faces)
    assert shown[4] == f"{mesh}: {triangles} triangles"
    assert 0 < float(shown[5].removeprefix("  from the true object: mean ").split()[0]) < 2


def test_a_light_field_alone_and_one_frame(capture: Path, tmp_path: Path, cli: Command) -> None:
    shutil.copy(capture / "lightfield.h5", tmp_path / "mine.h5")
    cli("reconstruct", tmp_path / "mine.h5", *SMALL)
    assert (tmp_path / "field.npz").is_file()
    cli("reconstruct", capture, *SMALL, "--frame", "1")
    assert (capture / "field-1.npz").is_file()


def test_a_field_goes_with_its_capture(capture: Path, four: Path, cli: Command) -> None:  # noqa: F811
    cli("reconstruct", capture, *SMALL)
    shutil.copy(capture / "field.npz", capture / "mine.npz")
    (capture / "field-1.npz").write_text("no field", encoding="utf-8")
    cli("capture", four, "--out", capture, "--force")
    assert {file.name for file in capture.glob("*.npz")} == {
        "object.npz", "mine.npz", "field-1.npz",
    }  # fmt: skip


def test_a_stop_says_how_to_go_on(
    capture: Path, monkeypatch: pytest.MonkeyPatch, cli: Command
) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(fitted, "_tell", stopped)
    line = cli("reconstruct", capture, *SMALL, code=130).err.splitlines()[-1]
    assert line.startswith("tbcad: stopped; ")
    assert line.endswith("go on with the same options and --resume")
    assert (capture / ".field.npz.part").is_file()


def test_memory_that_is_not_there(
    ball: Path,  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    cli: Command,
) -> None:
    monkeypatch.setattr("tbcad.app.api.reconstructions.available_memory_gb", lambda: 1.0)
    words = ["reconstruct", ball, "--nodes", "500", "--out", tmp_path / "f.npz"]
    assert "memory is short: " in cli(*words, code=2).err
    assert not list(tmp_path.iterdir())

"""What a run refuses before anything moves: one line, exit code 2, nothing written."""

import errno
import shutil
import sys
from pathlib import Path

import pytest

from tbcad.cli import run as tbcad
from tbcad.control.port import opening_reason
from tests.control.rig import Rig
from tests.exported_files import edit_json


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert tbcad(words) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("tbcad: ")
    return line


@pytest.fixture
def words(control_export: Path, tmp_path: Path) -> list[str]:
    return ["run", str(control_export), "--yes", "--out", str(tmp_path / "run")]


def test_no_port(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert "--port is missing" in refused(words, capsys)


def test_port_that_is_not_there(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert "there is no such port" in refused([*words, "--port", "/dev/ttyNONE"], capsys)


def test_port_without_controller(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    rig.controller.unplug()
    assert "the controller does not answer" in refused(rig.words(), capsys)
    assert not rig.out.exists()


@pytest.mark.parametrize(
    ("number", "says"),
    [(errno.EACCES, "usermod -aG dialout"), (errno.EBUSY, "another program uses it")],
)
def test_reason_of_a_port_that_cannot_be_opened(number: int, says: str) -> None:
    assert says in opening_reason(OSError(number, "no"))


def test_library_that_is_not_installed(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    line = refused([*words, "--port", "/dev/ttyNONE"], capsys)
    assert "pip install 'tbcad[machine]'" in line


def test_gphoto_that_is_not_installed(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "gphoto2", None)
    assert "pip install 'tbcad[machine]'" in refused(rig.words(camera="gphoto2"), capsys)


def test_no_camera(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("gphoto2", reason="the extra `machine` is not installed")
    assert "no camera answers" in refused(rig.words(camera="gphoto2"), capsys)
    assert not rig.out.exists()


@pytest.mark.parametrize(
    ("camera", "says"),
    [
        ("nikon", "allowed is gphoto2, command:PROGRAM"),
        ("command:", "allowed is gphoto2, command:PROGRAM"),
        ("command:cp a b", "{output} is missing"),
        ("command:cp 'a {output}", "No closing quotation"),
        ("command:no-such-program {output}", "there is no program no-such-program"),
        ("command:false {output}", "the camera's command ended with 1"),
        ("command:true {output}", "wrote no file at {output}"),
        (
            "command:cp /etc/hostname {output}.heic",
            "set its image format to JPEG, TIFF, PNG or raw",
        ),
        ("command:cp /etc/hostname {output}.jpg", "photograph.jpg is no TIFF, PNG, JPEG"),
        ("folder:/no/such/folder", "there is no such folder"),
    ],
)
def test_camera_that_will_not_do(
    rig: Rig, camera: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert says in refused(rig.words(camera=camera), capsys)
    assert not rig.out.exists()
    assert not any(line.startswith("G1") for line in rig.controller.lines)


def test_photograph_of_another_size(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(rig.words("--size", "640x480"), capsys)
    assert "gives 416 x 310 pixels, 640 x 480 are wanted" in line
    assert not rig.out.exists()
    assert "WIDTHxHEIGHT" in refused(rig.words("--size", "big"), capsys)


def test_settings_that_differ(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    rig.controller.settings[1] = 25.0
    del rig.controller.settings[27]
    line = refused(rig.words(), capsys)
    assert "$1 is 25, not 255, $27 is missing, not 2: send them with --send-settings" in line
    assert tbcad(rig.words("--send-settings", "--phases", "dark", stops="1")) == 0
    assert rig.controller.settings[1] == 255
    assert [line for line in rig.controller.lines if "=" in line] == ["$1=255", "$27=2"]


def test_full_disk_is_foreseen(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tbcad.control.estimate.free_bytes", lambda folder: 300_000)
    line = refused(rig.words(), capsys)
    assert "need about 1.2 MB, 0.3 MB are free" in line
    assert not rig.out.exists()


def test_folder_that_is_taken(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    rig.out.mkdir()
    (rig.out / "notes.txt").touch()
    assert "is not empty: name a new folder" in refused(rig.words(), capsys)
    assert "run.json is not there" in refused(rig.resume(), capsys)


def test_run_that_exists(rig: Rig, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    few = rig.words("--phases", "dark", "--runs", "a", stops="1")
    assert tbcad(few) == 0
    before = {path: path.read_bytes() for path in rig.out.rglob("*") if path.is_file()}
    assert "go on with it by --resume" in refused(few, capsys)
    for more in (("--phases", "lit"), ("--stops", "2"), ("--runs", "b"), ("--size", "640x480")):
        assert "was begun with another" in refused([*rig.resume(), *more], capsys)
    rig.export = Path(shutil.copytree(rig.export, tmp_path / "other"))
    edit_json(rig.export / "prototype.json", lambda value: value.update(note="another"))
    line = refused(rig.resume(), capsys)
    assert "is a run of another export: prototype.json" in line
    assert before == {path: path.read_bytes() for path in rig.out.rglob("*") if path.is_file()}

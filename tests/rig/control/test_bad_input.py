"""What a run refuses before anything moves: one line, exit code 2, nothing written."""

import errno
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tbcad.app.cli import run as tbcad
from tbcad.rig.control.messages import opening_reason
from tests.exported_files import edit_json
from tests.rig.control.conftest import Told
from tests.rig.control.grbl_double import BANNERS
from tests.rig.control.rig import Rig


@pytest.fixture
def words(control_export: Path, tmp_path: Path) -> list[str]:
    return ["run", str(control_export), "--yes", "--out", str(tmp_path / "run")]


def test_ports_and_libraries(
    words: list[str],
    rig: Rig,
    monkeypatch: pytest.MonkeyPatch,
    refused: Told,
) -> None:
    assert "--port is missing" in refused(words)
    assert "there is no such port" in refused([*words, "--port", "/dev/ttyNONE"])
    assert "usermod -aG dialout" in opening_reason(OSError(errno.EACCES, "no"))
    if find_spec("gphoto2"):
        assert "no camera answers" in refused(rig.words(camera="gphoto2"))
    for library, asked in (("gphoto2", rig.words(camera="gphoto2")), ("serial", rig.words())):
        monkeypatch.setitem(sys.modules, library, None)
        assert "pip install 'tbcad[machine]'" in refused(asked)
    assert not rig.out.exists()


def test_port_without_controller(rig: Rig, refused: Told) -> None:
    rig.controller.unplug()
    assert "the controller does not answer" in refused(rig.words())
    assert not rig.out.exists()


CAMERAS = """
nikon | allowed is gphoto2, command:PROGRAM
command: | allowed is gphoto2, command:PROGRAM
command:cp a b | {output} is missing
command:cp 'a {output} | No closing quotation
command:no-such-program {output} | there is no program no-such-program
command:false {output} | the camera's command ended with 1
command:true {output} | wrote no file at {output}
command:cp /etc/hostname {output}.heic | set its image format to JPEG, TIFF, PNG or raw
command:cp /etc/hostname {output}.jpg | photograph.jpg is no TIFF, PNG, JPEG
folder:/no/such/folder | there is no such folder
"""


@pytest.mark.parametrize("case", CAMERAS.strip().splitlines())
def test_camera_that_will_not_do(rig: Rig, case: str, refused: Told) -> None:
    camera, says = case.split(" | ")
    assert says in refused(rig.words(camera=camera))
    assert not rig.out.exists()
    assert not any(line.startswith("G1") for line in rig.controller.lines)


def test_photograph_of_another_size(rig: Rig, refused: Told) -> None:
    line = refused(rig.words("--size", "640x480"))
    assert "gives 416 x 310 pixels, 640 x 480 are wanted" in line
    assert not rig.out.exists()
    assert "$H" not in rig.controller.lines
    assert "WIDTHxHEIGHT" in refused(rig.words("--size", "big"))


def test_settings_that_differ(rig: Rig, refused: Told, capsys: pytest.CaptureFixture[str]) -> None:
    rig.controller.settings[1] = 25.0
    del rig.controller.settings[27]
    line = refused(rig.words())
    assert "$1 is 25, not 255, $27 is missing, not 2: send them with --send-settings" in line
    assert tbcad(rig.words("--send-settings", "--phases", "dark", stops="1")) == 0
    assert "$1 was 25, is 255\n$27 was missing, is 2\n" in capsys.readouterr().err
    assert rig.controller.settings[1] == 255
    assert [line for line in rig.controller.lines if "=" in line] == ["$1=255", "$27=2"]


def test_what_boards_may_lack(rig: Rig) -> None:
    """Settings that are off; grblHAL that greets as GRBL is known by its build info."""
    for number in (49, 62):
        del rig.controller.settings[number]
    rig.controller.greeting = "Grbl 1.1f ['$' for help]"
    assert tbcad(rig.words("--phases", "dark", stops="1")) == 0


@pytest.mark.parametrize(
    ("greeting", "says"),
    [
        ("Grbl 1.1h ['$' for help]", "is GRBL 1.1 (\"Grbl 1.1h ['$' for help]\")"),
        ("Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]", "is neither grblHAL nor GRBL 1.1"),
        ("Grbl 0.9j ['$' for help]", "is neither grblHAL nor GRBL 1.1"),
    ],
)
def test_controller_of_another_kind_is_sent_no_setting(
    rig: Rig, greeting: str, says: str, refused: Told
) -> None:
    rig.controller.firmware, rig.controller.greeting = "grbl", greeting
    rig.controller.boots = "3.7" in greeting
    line = refused(rig.words("--send-settings"))
    assert says in line
    assert "put grblHAL on the board" in line
    assert ("--set prototype.motion.controller=grbl" in line) == ("1.1h" in greeting)
    assert not any("=" in sent for sent in rig.controller.lines)


def test_build_for_another_controller_is_refused(plain_rig: Rig, refused: Told) -> None:
    plain_rig.controller.firmware = "grblhal"
    plain_rig.controller.greeting = BANNERS["grblhal"]
    line = refused(plain_rig.words("--send-settings"))
    assert "is grblHAL" in line
    assert "--set prototype.motion.controller=grblhal" in line
    assert not any("=" in sent for sent in plain_rig.controller.lines)


def test_full_disk_is_foreseen(rig: Rig, monkeypatch: pytest.MonkeyPatch, refused: Told) -> None:
    monkeypatch.setattr("tbcad.rig.control.selection.free_bytes", lambda folder: 300_000)
    line = refused(rig.words())
    assert "need about 1.2 MB, 0.3 MB are free" in line
    assert not rig.out.exists()


def test_run_that_exists(rig: Rig, tmp_path: Path, refused: Told) -> None:
    rig.out.mkdir()
    (rig.out / "notes.txt").touch()
    assert "is not empty: name a new folder" in refused(rig.words())
    assert "run.json is not there" in refused(rig.resume())
    (rig.out / "notes.txt").unlink()
    few = rig.words("--phases", "dark", "--runs", "a", stops="1")
    assert tbcad(few) == 0
    before = {path: path.read_bytes() for path in rig.out.rglob("*") if path.is_file()}
    assert "go on with it by --resume" in refused(few)
    for more in (("--phases", "lit"), ("--stops", "2"), ("--runs", "b"), ("--size", "640x480")):
        assert "was begun with another" in refused([*rig.resume(), *more])
    rig.export = Path(shutil.copytree(rig.export, tmp_path / "other"))
    edit_json(rig.export / "prototype.json", lambda value: value.update(target_pad_um=11.0))
    line = refused(rig.resume())
    assert "prototype.json is not the file that" in line
    assert before == {path: path.read_bytes() for path in rig.out.rglob("*") if path.is_file()}

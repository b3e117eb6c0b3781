"""The chain with libgphoto2 itself: the virtual camera of its wheel, on a run's real path."""

import pytest

from tbcad.app.cli import run as tbcad
from tbcad.rig.runs import read_run
from tests.exported_files import edit_json
from tests.rig.control.rig import Rig
from tests.rig.control.run_checks import check_every_photograph

pytest.importorskip("gphoto2", reason="the extra `machine` is not installed")
SETTINGS = {"shutterspeed": "0.0100s", "f-number": "f/2.8", "imagesize": "640x480"}


@pytest.mark.slow
def test_camera_on_usb(rig: Rig) -> None:
    """More photographs than its store has room for: a session that fails is opened again."""
    process = rig.start(rig.words(camera="gphoto2", stops="1-3"), module="tbcad")
    out, err = process.communicate(timeout=600)
    assert process.returncode == 0, err
    assert out.startswith("COMPLETE: 36 of 36 photographs")
    check_every_photograph(rig.out, 36)
    run = read_run(rig.out)
    assert run.record.camera == "Nikon DSC D750"
    assert SETTINGS.items() <= run.record.locked.items()
    assert {one.exposure_s for one in run.exposures.values()} == {0.01}


def test_another_camera_is_refused_when_a_run_goes_on(rig: Rig) -> None:
    """The run was begun with a command, whose photographs name no camera."""
    assert tbcad(rig.words(stops="1")) == 0
    (rig.out / "photographs" / "a_0001_dark.json").unlink()
    process = rig.start(rig.words("--resume", camera="gphoto2", stops=None))
    _, err = process.communicate(timeout=600)
    assert process.returncode == 2
    assert "the camera is Nikon DSC D750, and the run's is unnamed camera" in err


def test_exposure_of_each_phase(rig: Rig) -> None:
    """Set on the camera before each photograph, to the nearest that it has."""
    phases = ("--phases", "dark,led_1,lit", "--runs", "a")
    exposures = ("--exposure-leds", "0.0012", "--exposure-lit", "0.11")
    process = rig.start(rig.words(*phases, *exposures, camera="gphoto2", stops="1"), module="tbcad")
    _, err = process.communicate(timeout=600)
    assert process.returncode == 0, err
    run = read_run(rig.out)
    assert not run.faults
    told = {phase: one.settings["shutterspeed"] for phase, one in run.record.exposures.items()}
    short, long = "0.0012s", "0.1000s"
    assert told == {"dark": short, "led_1": short, "dark_lit": long, "lit": long}
    assert {one.phase: one.settings["shutterspeed"] for one in run.exposures.values()} == told
    assert run.exposures["a_0001_lit"].exposure_s == 0.1
    assert "shutterspeed" not in run.record.locked
    assert run.record.locked["imagesize"] == SETTINGS["imagesize"]
    sidecar = rig.out / "photographs" / "a_0001_lit.json"
    edit_json(sidecar, lambda value: value["settings"].update(shutterspeed=short))
    assert "shutterspeed is not what the run is locked to" in read_run(rig.out).faults["a_0001_lit"]


def test_exposure_that_the_camera_does_not_have(rig: Rig) -> None:
    process = rig.start(rig.words("--exposure-lit", "30", camera="gphoto2"))
    _, err = process.communicate(timeout=600)
    assert process.returncode == 2
    assert "no exposure near 30 s: the nearest is 1.0000s, all are from" in err.splitlines()[-1]
    assert not rig.out.exists()

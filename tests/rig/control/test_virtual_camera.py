"""The chain with libgphoto2 itself: the virtual camera of its wheel, on a run's real path."""

import io
from fractions import Fraction

import pytest
from PIL import Image
from PIL.TiffImagePlugin import IFDRational, ImageFileDirectory_v2

from tbcad.app.cli import run as tbcad
from tbcad.rig.control.photographs import EXIF, EXPOSURE, MAKE, MODEL, image_facts
from tbcad.rig.control.plan import CameraFault
from tbcad.rig.runs import read_run
from tests.exported_files import edit_json
from tests.rig.control.conftest import Told
from tests.rig.control.rig import SIZE, Rig, put

pytest.importorskip("gphoto2", reason="the extra `machine` is not installed")
SETTINGS = {"f-number": "f/2.8", "imagesize": "640x480"}
ISO, WHITE_BALANCE = 0x8827, 0xA403


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
    assert SETTINGS.items() <= run.record.locked.items()
    assert run.record.camera == "Nikon DSC D750"
    sidecar = rig.out / "photographs" / "a_0001_lit.json"
    edit_json(sidecar, lambda value: value["settings"].update(shutterspeed=short))
    assert "shutterspeed is not what the run is locked to" in read_run(rig.out).faults["a_0001_lit"]


def test_exposure_that_the_camera_does_not_have(rig: Rig) -> None:
    process = rig.start(rig.words("--exposure-lit", "30", camera="gphoto2"))
    _, err = process.communicate(timeout=600)
    assert process.returncode == 2
    assert "no exposure near 30 s: the nearest is 1.0000s, all are from" in err.splitlines()[-1]
    assert not rig.out.exists()


def photograph(exposure: Fraction, kind: str = "JPEG", white_balance: int = 1) -> bytes:
    time = IFDRational(exposure.numerator, exposure.denominator)
    inner = {EXPOSURE: time, ISO: 200, WHITE_BALANCE: white_balance}
    names = {MAKE: "Maker", MODEL: "One\0"}
    file, image = io.BytesIO(), Image.new("L", SIZE, 50)
    if kind == "TIFF":
        directory = ImageFileDirectory_v2()
        for tag, value in (names | {EXIF: inner}).items():
            directory[tag] = value
        image.save(file, kind, tiffinfo=directory)
    else:
        tags = Image.Exif()
        tags.update(names)
        tags.get_ifd(EXIF).update(inner)
        image.save(file, kind, exif=tags)
    return file.getvalue()


@pytest.mark.parametrize(("kind", "suffix"), [("JPEG", ".jpg"), ("TIFF", ".tif"), ("PNG", ".png")])
def test_facts(kind: str, suffix: str) -> None:
    found = image_facts(photograph(Fraction(1, 125), kind, 0), suffix)
    assert found.size_px == SIZE
    assert found.model == "Maker One"
    assert found.exposure_s == 0.008
    assert found.settings == {"exposure_s": 0.008, "iso": 200, "white_balance": 0}


def test_files_that_tell_little() -> None:
    """A bare one, and one whose exposure is zero over zero, as some cameras write it."""
    tags = Image.Exif()
    tags.get_ifd(EXIF)[EXPOSURE] = IFDRational(0, 0)
    for kind, exif in (("PNG", None), ("JPEG", tags)):
        file = io.BytesIO()
        Image.new("L", SIZE).save(file, kind, exif=exif or b"")
        found = image_facts(file.getvalue(), f".{kind.lower()}")
        assert (found.model, found.exposure_s, found.settings) == ("", None, {})


@pytest.mark.parametrize(
    ("suffix", "cut", "says"),
    [
        (".heic", None, "set its image format to JPEG, TIFF, PNG or raw"),
        (".cr2", None, "of a camera that LibRaw does not know"),
        (".png", None, "is a JPEG file and is called .png"),
        (".jpg", -200, "damaged or cut short"),
        (".jpg", 0, "is no TIFF, PNG, JPEG"),
    ],
)
def test_files_that_will_not_do(suffix: str, cut: int | None, says: str) -> None:
    with pytest.raises(CameraFault, match=says):
        image_facts(photograph(Fraction(1, 8))[:cut], suffix)


def test_another_exposure_is_named_and_the_rest_goes_on(rig: Rig, stopped: Told) -> None:
    (rig.folder / "other.jpg").write_bytes(photograph(Fraction(1, 20)))
    rig.controller.see = lambda _: put(rig.picture, photograph(Fraction(1, 10)))
    rig.controller.see(rig.controller.machine)
    camera = rig.counting('3|4) cp other.jpg "$1.jpg"')
    words = ("--phases", "dark,led_1,lit", "--runs", "a")
    out = stopped(rig.words(*words, camera=camera, stops="1"))
    assert out.startswith("NOT COMPLETE: 2 of 3 photographs")
    assert "missing: a_0001_led_1: exposure_s is 0.05, and the run is locked to 0.1" in out

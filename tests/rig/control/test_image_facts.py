"""What files of cameras say of themselves."""

import io
from fractions import Fraction

import pytest
from PIL import Image
from PIL.TiffImagePlugin import IFDRational, ImageFileDirectory_v2

from tbcad.rig.control.camera import EXIF, EXPOSURE, MAKE, MODEL, image_facts
from tbcad.rig.control.plan import CameraFault
from tests.rig.control.conftest import Told
from tests.rig.control.rig import SIZE, Rig, put

ISO, WHITE_BALANCE = 0x8827, 0xA403


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
    assert (found.width_px, found.height_px) == SIZE
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

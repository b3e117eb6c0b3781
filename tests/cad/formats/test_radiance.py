"""Pictures of light, written by OpenCV and by hand."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tbcad.cad.formats.light_pictures import hdr_picture
from tbcad.errors import InputError

HEADER = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n%b\n%b\n"
ONE, RED, DARK = bytes([128, 128, 128, 129]), bytes([128, 0, 0, 129]), bytes(4)


def file(pixels: bytes, resolution: bytes, lines: bytes = b"") -> bytes:
    return HEADER % (lines, resolution) + pixels


def read(pixels: bytes, resolution: bytes, lines: bytes = b"") -> np.ndarray:
    return hdr_picture(file(pixels, resolution, lines), "light.hdr")


def test_a_file_by_opencv_is_read_alike_and_refused_wherever_it_is_cut(tmp_path: Path) -> None:
    picture = np.random.default_rng(2).uniform(0.01, 30, (9, 48, 3)).astype(np.float32)
    picture[:, 20:40] = 7  # of which it makes runs
    path = tmp_path / "light.hdr"
    assert cv2.imwrite(str(path), picture[..., ::-1])
    data = path.read_bytes()
    other = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert other is not None
    assert (hdr_picture(data, "light.hdr") == other[..., ::-1]).all()
    for end in range(0, len(data) - 1, 7):
        with pytest.raises(InputError, match=r"light\.hdr is damaged or cut short"):
            hdr_picture(data[:end], "light.hdr")


def test_pixels_without_runs_lie_as_they_are_stored() -> None:
    found = read(ONE + RED + RED + DARK + DARK + RED, b"-Y 2 +X 3")
    assert found.tolist() == [[[1, 1, 1], [1, 0, 0], [1, 0, 0]], [[0] * 3, [0] * 3, [1, 0, 0]]]


def test_exposures_and_colour_corrections_are_undone() -> None:
    lines = b"EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 2 4\n\tEXPOSURE=9\n"
    assert read(ONE, b"-Y 1 +X 1", lines)[0, 0] == pytest.approx(np.array([1, 1 / 2, 1 / 4]) / 8)


def test_primaries_of_rec_709_pass() -> None:
    lines = b"PRIMARIES=0.640 0.330 0.300 0.600 0.150 0.060 0.3127 0.3290\n"
    assert read(ONE, b"-Y 1 +X 1", lines)[0, 0] == pytest.approx([1, 1, 1])


@pytest.mark.parametrize(
    ("data", "wrong"),
    [
        (b"#?RADIANCE\n", "no header"),
        (file(b"", b"-Y 99999 +X 99999"), "allowed are"),
        (file(ONE, b"-Y 1 +Y 1"), r"another order than -Y \+X"),
        (file(ONE + RED, b"+Y 1 +X 2"), r"another order than -Y \+X"),
        (file(ONE, b"-Y 1 +X 1", b"EXPOSURE=0\n"), "EXPOSURE=0"),
        (file(ONE, b"-Y 1 +X 1", b"COLORCORR=1 x 1\n"), "COLORCORR=1 x 1"),
        (file(ONE, b"-Y 1 +X 1", b"PRIMARIES=.7347 .2653 0 1 0 -.077 .32 .34\n"), "Rec. 709"),
        (file(ONE, b"-Y 1 +X 1").replace(b"rgbe", b"xyze"), "format 32-bit_rle_xyze, allowed is"),
        (file(RED + bytes([1, 1, 1, 4]), b"-Y 1 +X 5"), "runs of before 1991"),
        (file(bytes([2, 2, 0, 9]), b"-Y 1 +X 8"), "another width"),
        (file(bytes([2, 2, 0, 8, 200, 0]), b"-Y 1 +X 8"), "a run does not fit"),
    ],
)
def test_what_is_damaged_or_means_something_else(data: bytes, wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        hdr_picture(data, "light.hdr")

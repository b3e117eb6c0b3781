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


def test_older_runs_are_read() -> None:
    """(1, 1, 1, n) repeats the pixel before n times; one after it counts in 256s."""
    found = read(RED + bytes([1, 1, 1, 2, 1, 1, 1, 1]) + ONE, b"-Y 1 +X 260")
    assert found[0, :259] == pytest.approx(np.tile([1, 0, 0], (259, 1)))
    assert found[0, 259] == pytest.approx([1, 1, 1])


@pytest.mark.parametrize(
    ("resolution", "turned"),
    [
        (b"-Y 2 +X 3", lambda p: p),
        (b"-Y 2 -X 3", lambda p: p[:, ::-1]),
        (b"+Y 2 +X 3", lambda p: p[::-1]),
        (b"+Y 2 -X 3", lambda p: p[::-1, ::-1]),
        (b"+X 2 -Y 3", lambda p: p.swapaxes(0, 1)),
        (b"-X 2 -Y 3", lambda p: p.swapaxes(0, 1)[:, ::-1]),
        (b"+X 2 +Y 3", lambda p: p.swapaxes(0, 1)[::-1]),
        (b"-X 2 +Y 3", lambda p: p.swapaxes(0, 1)[::-1, ::-1]),
    ],
)
def test_scanlines_in_all_eight_orders(resolution: bytes, turned: object) -> None:
    assert callable(turned)
    pixels = ONE + RED + RED + DARK + DARK + RED
    as_stored = np.array([[[1, 1, 1], [1, 0, 0], [1, 0, 0]], [[0] * 3, [0] * 3, [1, 0, 0]]])
    assert (read(pixels, resolution) == turned(as_stored)).all()


def test_exposures_and_colour_corrections_are_undone() -> None:
    lines = b"EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 2 4\n\tEXPOSURE=9\n"
    assert read(ONE, b"-Y 1 +X 1", lines)[0, 0] == pytest.approx(np.array([1, 1 / 2, 1 / 4]) / 8)


def test_xyz_becomes_red_green_and_blue_and_primaries_of_rec_709_pass() -> None:
    """Y of Radiance's green is 0.670 (its color.h: CIE_gf); equal X, Y, Z are white."""
    data = file(ONE + bytes([0, 128, 0, 129]), b"-Y 1 +X 2").replace(b"rgbe", b"xyze")
    white, only_y = hdr_picture(data, "light.hdr")[0]
    assert white == pytest.approx([1, 1, 1])
    assert only_y[1] > 1
    assert only_y[[0, 2]] == pytest.approx([0, 0])  # negative, which no light is
    lines = b"PRIMARIES=0.640 0.330 0.300 0.600 0.150 0.060 0.3127 0.3290\n"
    assert read(ONE, b"-Y 1 +X 1", lines)[0, 0] == pytest.approx([1, 1, 1])


@pytest.mark.parametrize(
    ("data", "wrong"),
    [
        (b"#?RADIANCE\n", "no header"),
        (file(b"", b"-Y 99999 +X 99999"), "allowed are"),
        (file(ONE, b"-Y 1 +Y 1"), "no header"),
        (file(ONE, b"-Y 1 +X 1", b"EXPOSURE=0\n"), "EXPOSURE=0"),
        (file(ONE, b"-Y 1 +X 1", b"COLORCORR=1 x 1\n"), "COLORCORR=1 x 1"),
        (file(ONE, b"-Y 1 +X 1", b"PRIMARIES=.7347 .2653 0 1 0 -.077 .32 .34\n"), "Rec. 709"),
        (file(ONE, b"-Y 1 +X 1").replace(b"32-bit", b"99-bit"), "format 99-bit_rle_rgbe"),
        (file(bytes([1, 1, 1, 4]), b"-Y 1 +X 4"), "a run does not fit"),
        (file(bytes([2, 2, 0, 9]), b"-Y 1 +X 8"), "another width"),
        (file(bytes([2, 2, 0, 8, 200, 0]), b"-Y 1 +X 8"), "a run does not fit"),
    ],
)
def test_what_is_damaged_or_means_something_else(data: bytes, wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        hdr_picture(data, "light.hdr")

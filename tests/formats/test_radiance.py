"""Pictures of light, written by OpenCV and by hand."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.formats.radiance import read_hdr

HEADER = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n"


def test_a_file_by_opencv(tmp_path: Path) -> None:
    picture = np.random.default_rng(2).uniform(0.01, 30, (20, 48, 3)).astype(np.float32)
    path = tmp_path / "light.hdr"
    assert cv2.imwrite(str(path), picture[..., ::-1])
    found = read_hdr(path)
    assert found.shape == picture.shape
    # Eight bits of the brightest of three colours.
    assert np.abs(found - picture).max(axis=2) / picture.max(axis=2) == pytest.approx(
        0, abs=1 / 128
    )


def test_the_first_row_is_the_top(tmp_path: Path) -> None:
    """Shared exponent: (128, 64, 0, 129) is (1, 0.5, 0) after G. Ward, half a step apart."""
    path = tmp_path / "light.hdr"
    path.write_bytes(HEADER % (2, 3) + bytes([128, 64, 0, 129] * 3 + [0, 0, 0, 0] * 3))
    found = read_hdr(path)
    assert found.shape == (2, 3, 3)
    assert found[0] == pytest.approx(np.broadcast_to([1, 0.5, 0], (3, 3)), abs=1 / 128)
    assert (found[1] == 0).all()


@pytest.mark.parametrize(
    ("content", "wrong"),
    [
        (None, "no such file"),
        (b"\x89PNG nothing", "does not begin"),
        (HEADER % (0, 0), "damaged"),
    ],
)
def test_what_is_no_such_file(tmp_path: Path, content: bytes | None, wrong: str) -> None:
    path = tmp_path / "light.hdr"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=wrong):
        read_hdr(path)

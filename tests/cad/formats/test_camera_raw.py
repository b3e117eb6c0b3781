"""Raw files: light in the sensor's own colours, black level 0, white level full."""

import sys
from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.formats.images.pictures import picture_of, read_picture
from tbcad.errors import InputError
from tbcad.rig.control.camera import image_facts
from tests.raw_photographs import dng

BLACK, WHITE = 512, 16_383
RED, GREEN, BLUE = 1_000, 3_000, 14_000  # beyond the share of white from which LibRaw moves it


def mosaic(red: int = RED, green: int = GREEN, blue: int = BLUE) -> np.ndarray:
    return np.tile(np.array([[red, green], [green, blue]], dtype=np.uint16), (32, 48))


def share(value: float) -> float:
    return float(np.clip((value - BLACK) / (WHITE - BLACK), 0, 1) * 65_535)


@pytest.mark.parametrize("orientation", [1, 3, 6])
def test_levels_without_white_balance_or_turn(orientation: int) -> None:
    data = dng(mosaic(), BLACK, WHITE, orientation, as_shot=(0.5, 1, 0.7))
    found = picture_of(data, "IMG_1.DNG")
    assert (found.shape, found.dtype) == ((64, 96, 3), np.uint16)
    expected = [share(value) for value in (RED, GREEN, BLUE)]
    assert np.abs(found - np.array(expected)).max() <= 1


def test_no_brightness_follows_what_is_photographed() -> None:
    dark = mosaic(600, 600, 600)
    dark[20, 30] = 2_000
    found = picture_of(dng(dark, BLACK, WHITE), "dark.dng")
    assert found[20, 30, 0] == pytest.approx(share(2_000), abs=1)
    assert found[40, 60] == pytest.approx([share(600)] * 3, abs=1)


def test_below_black_and_above_white_are_clipped() -> None:
    found = picture_of(dng(mosaic(100, 20_000, 600), BLACK, WHITE), "clip.dng")
    assert found[10, 10, 0] == 0
    assert found[10, 11, 1] == 65_535


def test_a_ramp_stays_in_its_place() -> None:
    """Linear interpolation of the mosaic is exact on it, within the rounding of neighbours."""
    x, y = np.meshgrid(np.arange(96), np.arange(64))
    ramp = BLACK + 10 * x + 20 * y
    found = picture_of(dng(ramp.astype(np.uint16), BLACK, WHITE), "ramp.dng")
    expected = (ramp - BLACK) * 65_535 / (WHITE - BLACK)
    assert np.abs(found - expected[..., None])[2:-2, 2:-2].max() < 2


def test_a_run_takes_raw_files() -> None:
    facts = image_facts(dng(mosaic(), BLACK, WHITE), ".dng")
    assert (facts.width_px, facts.height_px, facts.model) == (96, 64, "Maker Model")


@pytest.mark.parametrize("end", [0, 500, 2_000, -100])
def test_cut_files_are_refused(end: int) -> None:
    with pytest.raises(InputError, match=r"cut\.nef is damaged, or of a camera"):
        picture_of(dng(mosaic(), BLACK, WHITE)[:end], "cut.nef")


def test_without_the_library_the_way_to_it_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.nef").write_bytes(dng(mosaic()))
    monkeypatch.setitem(sys.modules, "rawpy", None)
    with pytest.raises(InputError, match=r"read by rawpy.*pip install 'tbcad\[machine\]'"):
        read_picture(tmp_path / "a.nef")

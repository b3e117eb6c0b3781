"""Pictures of light in OpenEXR and in other formats, and what is none."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

from tbcad.errors import InputError
from tbcad.light.reflectance.environment import read_light

LIGHT = np.random.default_rng(3).uniform(0, 50, (8, 16, 3)).astype(np.float32)
GREY = np.ascontiguousarray(LIGHT[..., 0])
ACES = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)


def window(x0: int, y0: int, x1: int, y1: int) -> tuple[Any, Any]:
    return np.array([x0, y0], np.int32), np.array([x1, y1], np.int32)


def exr(path: Path, channels: dict[str, Any], **header: Any) -> Path:
    kind = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(kind | header, channels).write(str(path))
    return path


@pytest.mark.parametrize(
    ("channels", "expected"),
    [
        ({"RGB": LIGHT}, LIGHT),
        ({"RGB": LIGHT.astype(np.float16)}, LIGHT.astype(np.float16)),
        ({"RGBA": np.dstack([LIGHT, 0.5 * np.ones((8, 16), np.float32)])}, LIGHT),
        ({"Y": GREY}, GREY[..., None].repeat(3, axis=2)),
        ({"Y": GREY.astype(np.uint32)}, GREY.astype(np.uint32)[..., None].repeat(3, axis=2)),
    ],
)
def test_channels_by_name(tmp_path: Path, channels: dict[str, Any], expected: Any) -> None:
    assert (read_light(exr(tmp_path / "light.exr", channels)) == expected).all()


def test_the_display_window_is_what_is_shown(tmp_path: Path) -> None:
    """Data from column 4, row -2 on: two rows are cut off, and the left is black."""
    windows = {"dataWindow": window(4, -2, 19, 5), "displayWindow": window(0, 0, 31, 15)}
    found = read_light(exr(tmp_path / "light.exr", {"RGB": LIGHT}, **windows))
    assert found.shape == (16, 32, 3)
    assert (found[:6, 4:20] == LIGHT[2:]).all()
    assert found.sum() == pytest.approx(float(LIGHT[2:].sum(dtype=np.float64)))


def with_value(value: float) -> np.ndarray:
    light = LIGHT.copy()
    light[3, 5, 1] = value
    return light


@pytest.mark.parametrize(
    ("channels", "header", "wrong"),
    [
        ({"Y": GREY, "RY": GREY, "BY": GREY}, {}, "luminance and chroma"),
        ({"Z": GREY}, {}, "has channels Z"),
        ({"left.R": GREY, "left.G": GREY, "left.B": GREY}, {}, "has channels left.B"),
        ({"RGB": LIGHT}, {"chromaticities": ACES}, "Rec. 709"),
        ({"RGB": LIGHT}, {"envmap": OpenEXR.ENVMAP_CUBE}, "cube map"),
        ({"RGB": with_value(-1)}, {}, "no light"),
        ({"RGB": with_value(np.nan)}, {}, "no light"),
        ({"RGB": with_value(np.inf)}, {}, "no light"),
    ],
)
def test_what_is_refused(
    tmp_path: Path, channels: dict[str, Any], header: dict[str, Any], wrong: str
) -> None:
    with pytest.raises(InputError, match=wrong):
        read_light(exr(tmp_path / "light.exr", channels, **header))


def test_several_parts_are_refused(tmp_path: Path) -> None:
    kind = {"type": OpenEXR.scanlineimage}
    parts = [OpenEXR.Part(dict(kind), {"RGB": LIGHT}, name=name) for name in ("left", "right")]
    OpenEXR.File(parts).write(str(tmp_path / "two.exr"))
    with pytest.raises(InputError, match="has 2 parts"):
        read_light(tmp_path / "two.exr")


def test_a_cut_file_is_refused_without_words_of_the_library(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = exr(tmp_path / "light.exr", {"RGB": LIGHT})
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(InputError, match="damaged or cut short"):
        read_light(path)
    assert capfd.readouterr() == ("", "")


def test_tiff_in_floating_point_is_light_and_whole_numbers_are_not(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "light.tif", LIGHT, photometric="rgb")
    assert (read_light(tmp_path / "light.tif") == LIGHT).all()
    file = BytesIO()
    Image.new("RGB", (16, 8)).save(file, "PNG")
    (tmp_path / "light.hdr").write_bytes(file.getvalue())
    with pytest.raises(InputError, match="whole numbers, which clip"):
        read_light(tmp_path / "light.hdr")
    with pytest.raises(InputError, match="no such file; give a picture of light"):
        read_light(tmp_path / "none.hdr")

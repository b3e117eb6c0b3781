"""Light from all around in each format of a picture, and the lamps that stand for it."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

from tbcad.core.geometry.vectors import unit
from tbcad.errors import InputError
from tbcad.light.reflectance.environment import (
    LightFormat,
    LightPixels,
    environment,
    even_directions,
    light_pixels,
    read_light,
)
from tests.light.reflectance.conftest import sky

SHAPES: tuple[tuple[LightFormat, int, int], ...] = (
    ("latlong", 60, 120),
    ("angular", 120, 120),
    ("mirror-ball", 120, 120),
    ("cross", 160, 120),
    ("cross", 120, 160),
)
EVERY = pytest.mark.parametrize(("kind", "height", "width"), SHAPES)
LIGHT = np.random.default_rng(3).uniform(0, 50, (8, 16, 3)).astype(np.float32)
GREY = np.ascontiguousarray(LIGHT[..., 0])
ACES = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)


def test_an_even_sky_gives_the_irradiance_of_a_hemisphere() -> None:
    """Light 1 from everywhere above: pi on a surface that faces up, 2 pi over all directions."""
    found = environment(np.ones((64, 128, 3)))
    assert found.light.sum(axis=0) == pytest.approx([2 * np.pi] * 3)
    up = (found.light * found.direction[:, 2:]).sum(axis=0)
    assert up == pytest.approx([np.pi] * 3, rel=1e-3)


def test_lamps_share_all_of_the_light_and_one_bright_pixel_gives_one_each() -> None:
    found = environment(sky())
    for lights in (found.on_lamps(245 * even_directions(40)), found.far_lights(100)):
        assert lights.colour.sum(axis=0) == pytest.approx(found.light.sum(axis=0))
    picture = np.zeros((64, 128, 3))
    picture[20, 50] = (3, 2, 1)
    found = environment(picture)
    lamps = found.on_lamps(245 * even_directions(30))
    assert np.count_nonzero(lamps.colour[:, 0]) == 1
    (lamp,) = np.flatnonzero(lamps.colour[:, 0])
    bright = found.direction[found.light[:, 0] > 0][0]
    assert even_directions(30)[lamp] @ bright == pytest.approx((even_directions(30) @ bright).max())
    far = found.far_lights(30)
    (sun,) = np.flatnonzero(far.colour[:, 0])
    assert unit(far.place[sun]) == pytest.approx(bright)


def test_even_directions_are_spread() -> None:
    direction = even_directions(200)
    assert np.linalg.norm(direction, axis=1) == pytest.approx(np.ones(200))
    assert direction[:, 2].min() > 0
    apart = direction @ direction.T - 2 * np.eye(200)
    nearest = np.arccos(apart.max(axis=1))
    assert nearest.min() > 0.6 * np.sqrt(2 * np.pi / 200)


def pixels(kind: LightFormat, height: int, width: int) -> LightPixels:
    return light_pixels(np.zeros((height, width, 3)), kind, "sky.hdr")


def shown_at(kind: LightFormat, shape: tuple[int, int], u: float, v: float) -> np.ndarray:
    """What the pixel at shares of width and height shows."""
    found = pixels(kind, *shape)
    off = (found.column + 0.5 - u * shape[1]) ** 2 + (found.row + 0.5 - v * shape[0]) ** 2
    return found.direction[off.argmin()]


@EVERY
def test_every_direction_once(kind: LightFormat, height: int, width: int) -> None:
    """All of the sphere; the mean of z squared over it is 1/3; no direction weighs more."""
    found = pixels(kind, height, width)
    assert np.linalg.norm(found.direction, axis=1) == pytest.approx(1)
    assert found.solid_angle.sum() == pytest.approx(4 * np.pi)
    moments = (found.direction * found.solid_angle[:, None]).T @ found.direction / (4 * np.pi)
    assert moments == pytest.approx(np.eye(3) / 3, abs=5e-3)
    assert found.solid_angle @ found.direction == pytest.approx(np.zeros(3), abs=0.02)
    assert len(np.unique(found.row * width + found.column)) == len(found.row)


HALF, BALL = 0.25, np.sqrt(0.5) / 2  # radii, as shares of the side, of 90 degrees from the middle


@pytest.mark.parametrize(
    ("kind", "shape", "places"),
    [
        ("latlong", (200, 400), [(0.5, 0.5), (0.5, 0), (0.75, 0.5), (0, 0.5)]),
        ("angular", (401, 401), [(0.5, 0.5), (0.5, 0.5 - HALF), (0.5 + HALF, 0.5), (0.5, 1)]),
        ("mirror-ball", (401, 401), [(0.5, 0.5), (0.5, 0.5 - BALL), (0.5 + BALL, 0.5), (0.5, 1)]),
        ("cross", (400, 300), [(0.5, 0.375), (0.5, 0.125), (5 / 6, 0.375), (0.5, 0.875)]),
        ("cross", (300, 400), [(0.375, 0.5), (0.375, 1 / 6), (0.625, 0.5), (0.875, 0.5)]),
    ],
)
def test_middle_top_right_and_back(
    kind: LightFormat, shape: tuple[int, int], places: list[tuple[float, float]]
) -> None:
    expected = [[1, 0, 0], [0, 0, 1], [0, -1, 0], [-1, 0, 0]]
    found = [shown_at(kind, shape, *place) for place in places]
    atol = 0.15 if kind == "mirror-ball" else 0.03  # whose rim shows 8 degrees in a pixel
    assert np.array(found) == pytest.approx(np.array(expected), abs=atol)


@EVERY
def test_the_same_surroundings_give_the_same_light(
    kind: LightFormat, height: int, width: int
) -> None:
    """Light of (1 + a.d)^2, of which the upper half is known, whatever the format and the turn."""
    found = pixels(kind, height, width)
    picture = np.full((height, width, 3), np.nan)  # what is outside is not read
    toward, turn = np.array([0.6, -0.5, 0.3]), 0.7
    picture[found.row, found.column] = ((1 + found.direction @ toward) ** 2)[:, None]
    light = environment(picture, turn, kind)
    assert (light.direction[:, 2] > 0).all()
    level_axis = (toward[0] + 1j * toward[1]) * np.exp(1j * turn)
    axis = np.array([level_axis.real, level_axis.imag])
    level, moment = 2 * np.pi * (1 + 0.3 + toward @ toward / 3), light.light[:, 0].sum()
    assert moment == pytest.approx(level, rel=0.02)
    about = light.light[:, 0] @ light.direction[:, :2]
    # Of 2 a.d and of 2 a_z z (a.d), over the hemisphere.
    assert about == pytest.approx(axis * (4 * np.pi / 3 + 0.15 * np.pi), rel=0.02)


@pytest.mark.parametrize(
    ("kind", "height", "width"),
    [(None, 64, 64), (None, 60, 121), ("angular", 64, 128), ("cross", 100, 100), ("cross", 3, 5)],
)
def test_other_shapes_are_refused(kind: LightFormat | None, height: int, width: int) -> None:
    with pytest.raises(InputError, match=r"--light-format latlong \| angular \| mirror-ball"):
        light_pixels(np.zeros((height, width, 3)), kind, "sky.hdr")


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


@pytest.mark.parametrize(
    ("channels", "header", "wrong"),
    [
        ({"Y": GREY, "RY": GREY, "BY": GREY}, {}, "luminance and chroma"),
        ({"Z": GREY}, {}, "has channels Z"),
        ({"left.R": GREY, "left.G": GREY, "left.B": GREY}, {}, "has channels left.B"),
        ({"RGB": LIGHT}, {"chromaticities": ACES}, "Rec. 709"),
        ({"RGB": LIGHT}, {"envmap": OpenEXR.ENVMAP_CUBE}, "cube map"),
        ({"RGB": -LIGHT}, {}, "no light"),
        ({"RGB": np.full_like(LIGHT, np.inf)}, {}, "no light"),
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

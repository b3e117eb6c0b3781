"""Pixels and their balance, against closed forms."""

from itertools import pairwise

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.errors import InputError
from tbcad.light.simulate.capture.photograph import (
    Sensor,
    count_pixels,
    parse_sensor,
    traced_pixels,
)
from tbcad.light.simulate.scene.reflector import Reflector, reflectors
from tbcad.studies.resolution import Ratio, balance, parse_ratio
from tests.mirror_arrays import mirror_design

# The paper's lens does not hold the few large mirrors of a small n.
WIDE = ("n=8", "hfov_deg=95", "width_px=832", "height_px=620")


@pytest.fixture(scope="module")
def wide() -> MirrorDesign:
    return mirror_design(*WIDE)


def window(at: Reflector, mirror: int) -> float:
    """Area of a mirror's cell in the picture, in pixels, from its arcs alone."""
    offsets, sides = at.cells.rings
    steps, total = np.linspace(0, 1, 200), 0.0
    for side in sides[offsets[mirror] : offsets[mirror + 1]]:
        t = steps if side % 2 == 0 else steps[::-1]
        point = at.camera.project(at.cells.arcs.at(np.full(len(t), side // 2), t))
        for (x0, y0), (x1, y1) in pairwise(point):
            total += (x0 * y1 - x1 * y0) / 2
    return abs(total)


def test_pixels_on_mirrors_are_the_areas_of_their_cells(wide: MirrorDesign) -> None:
    """Pixels counted one by one against the area within the cell's arcs."""
    at = reflectors(wide)[0]
    on = count_pixels(wide.arrays[0], (Sensor(832, 620),), 30.0)[0].on
    area = np.array([window(at, i) for i in range(len(at))])
    assert np.abs(on - area).max() < 3 * np.sqrt(area.max())  # pixels along its edge
    assert on.sum() == pytest.approx(area.sum(), rel=5e-4)


def test_both_cameras_have_the_same_pixels(wide: MirrorDesign) -> None:
    theta0 = wide.arrays[0].theta0
    a, b = (traced_pixels(at, theta0, 30.0) for at in reflectors(wide))
    assert np.array_equal(a, b)


def test_no_ray_meets_nothing_and_all_meet_everything(wide: MirrorDesign) -> None:
    array = wide.arrays[0]
    sensor = (Sensor(416, 310),)
    assert count_pixels(array, sensor, 0.0)[0].seen.sum() == 0
    most = count_pixels(array, sensor, 300.0)[0]  # all mirrors are inside
    some = count_pixels(array, sensor, 30.0)[0]
    assert (some.seen <= some.on).all()
    assert 0.3 < some.seen.sum() / some.on.sum() < 0.9
    assert np.array_equal(some.on, most.on)
    assert np.array_equal(most.seen, most.on)


def test_share_that_sees_the_sphere_follows_its_size(wide: MirrorDesign) -> None:
    """A mirror shows a small sphere in an area that grows with the square of its radius."""
    seen = [
        count_pixels(wide.arrays[0], (Sensor(1664, 1240),), r)[0].seen.sum()
        for r in (5.0, 10.0, 20.0)
    ]
    assert seen[1] / seen[0] == pytest.approx(4, rel=0.02)
    assert seen[2] / seen[1] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("size", [(1664, 1240), (1663, 1239)])
def test_rays_for_blocks_of_pixels_give_the_same_count(
    wide: MirrorDesign, size: tuple[int, int]
) -> None:
    """Also where sides do not divide."""
    array, sensor = wide.arrays[0], Sensor(*size)
    every = count_pixels(array, (sensor,), 30.0)[0]
    some = count_pixels(array, (sensor,), 30.0, most_rays=600_000)[0]
    assert (every.rays, some.rays) == (size[0] * size[1], 832 * 620)
    assert some.on.sum() == pytest.approx(every.on.sum(), rel=5e-4)
    assert some.seen.sum() == pytest.approx(every.seen.sum(), rel=5e-4)


def test_balance_of_power_laws_is_exact() -> None:
    """5 n^2 cameras with 500,000 / n^2 pixels balance where n^4 = 100,000 ratio.

    Designs that were refused are passed over; outside the sweep there is none.
    """
    n = np.arange(5.0, 40.0)
    cameras, pixels = 5 * n**2, 5e5 / n**2
    cameras[12], pixels[12] = np.nan, np.nan
    for ratio in (Ratio(1, 1), Ratio(1, 4), Ratio(4, 1)):
        balanced, nearest = balance(n, cameras, pixels, ratio)
        assert balanced == pytest.approx((1e5 * ratio.cameras / ratio.pixels) ** 0.25, rel=1e-12)
        assert abs(n[nearest] - balanced) < 1
    assert np.isnan(balance(n[15:], cameras[15:], pixels[15:], Ratio(1, 1))[0])
    assert np.isnan(balance(n, n * np.nan, n * np.nan, Ratio(1, 1))[0])


@pytest.mark.parametrize("text", ["", "15x1552", "2080x99999", "-1x20", "nan:1", "1:inf", "a:b"])
def test_texts_refused(text: str) -> None:
    assert parse_sensor("8320x6208") == Sensor(8320, 6208)
    assert parse_ratio("1:4") == Ratio(1, 4)
    with pytest.raises(InputError, match="2080x1552"):
        parse_sensor(text)
    with pytest.raises(InputError, match="1:4"):
        parse_ratio(text)

"""Figures of a candidate against counts and closed forms."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.capture.photograph import Sensor, count_pixels, virtual_cameras
from tbcad.optimizing.candidate import (
    STEP_MM,
    bounds,
    evaluate,
    figures_of,
    place_of,
    placed,
    rounded,
    size_of,
    virtual_camera_pixels,
)

FEW_PIXELS = ("n=4", "width_px=416", "height_px=310")


@pytest.fixture(scope="module")
def few() -> MirrorDesign:
    return design(load_spec(None, FEW_PIXELS))


def test_every_pixel_belongs_to_one_virtual_camera(few: MirrorDesign) -> None:
    array = few.arrays[0]
    pixels, number = virtual_camera_pixels(array, few.spec)
    assert number.sum() == virtual_cameras(array)
    seen = count_pixels(array, (Sensor(416, 310),), 30.0)[0].seen
    assert (pixels * number).sum() == 2 * seen.sum()


def test_figures_are_those_of_all_virtual_cameras(few: MirrorDesign) -> None:
    pixels, number = virtual_camera_pixels(few.arrays[0], few.spec)
    each = np.concatenate([np.full(k, p) for p, k in zip(pixels, number, strict=True)])
    figures = figures_of(few)
    assert figures.minimum_px == each.min()
    assert figures.median_px == np.median(each)
    assert figures.mean_log_px == pytest.approx(np.log(each).mean(), rel=1e-12)
    assert figures.variation == pytest.approx(each.std() / each.mean(), rel=1e-12)
    assert figures.view_angle_deg == few.spec.camera.hfov_deg


@pytest.mark.parametrize(
    ("pinhole", "size"), [((9.0, 0.0, -2.0), 18), ((5.0, 0.0, -2.0), 14), ((5.0, 0.0, -30.0), 33)]
)
def test_size_is_the_longest_side_of_a_box(pinhole: tuple[float, ...], size: float) -> None:
    """Apices up to 7 mm across, 3 mm up."""
    u = np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    camera = SimpleNamespace(pinhole=np.array(pinhole))
    array = SimpleNamespace(u=u, apex_distance=np.array([7.0, 3, 5]), camera=camera)
    assert size_of(cast(MirrorArray, array)) == size


def test_a_candidate_is_the_design_of_its_place() -> None:
    spec = load_spec(None, FEW_PIXELS)
    one = evaluate(spec, None, (110.0, -120.0, 105.0, 1.2, 1.1))
    moved = ["camera_mm=[110, 0, -120]", "semi_minor_mm=105", "stretch=[1.2, 1.1]"]
    options = [*moved, *FEW_PIXELS]
    assert one.figures == figures_of(design(load_spec(None, options)))
    assert one.reason == ""


def test_what_cannot_be_made_says_why() -> None:
    one = evaluate(load_spec(None, FEW_PIXELS), None, (10.0, -10.0, 1.0, 1.0, 1.0))
    assert one.figures is None
    assert one.reason
    assert "\n" not in one.reason


def test_the_first_place_is_within_the_bounds() -> None:
    spec = load_spec(None)
    for size in (10.0, 276.0, 900.0):
        limits = np.array(bounds(spec, size))
        assert (limits[:, 0] <= place_of(spec)).all()
        assert (place_of(spec) <= limits[:, 1]).all()


def test_places_are_on_a_grid() -> None:
    place = rounded(np.array([100.26, -99.8, 87.1, 1.1678, 0.93]))
    assert place == (100.5, -100.0, 87.0, 1.15, 0.95)
    assert (np.array(place[:3]) % STEP_MM == 0).all()


def test_other_keys_stay() -> None:
    spec = load_spec(None, ["n=4", "shell.wall_mm=4", "camera_mm=[100, 7, -100]"])
    moved = placed(spec, (120.0, -90.0, 101.0, 1.0, 1.0))
    assert moved.optics.camera_mm == (120.0, 7.0, -90.0)
    assert moved.shell.wall_mm == 4
    assert moved.optics.n == 4

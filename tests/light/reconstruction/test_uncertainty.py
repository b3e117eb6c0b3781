"""Places of the rays in a pixel, and weights of rays by what calibrations know of mirrors."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.optics.camera import Camera
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.reconstruction.rays import captured_rays, pixel_areas, pixel_places, with_weights
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS, CameraFrame, LightField

PIXEL_MM = 0.5


@pytest.mark.parametrize("area", [False, True])
@pytest.mark.parametrize("blur_px", [0.45, 2.0])
@pytest.mark.parametrize("count", [3, 12, 40])
def test_mean_and_variance(count: int, blur_px: float, area: bool) -> None:
    places = pixel_places(count, blur_px, area=area).astype(np.float64)
    assert np.mean(pixel_places(count).astype(np.float64) ** 2) == pytest.approx(1 / 12)
    assert places.shape[1:] == (count, 2)
    assert np.abs(places.mean(axis=1)).max() < 1e-6
    both = (places**2).sum(axis=2).mean(axis=1)
    assert both == pytest.approx(np.full(len(both), 2 * (area / 12 + blur_px**2)), rel=1e-5)
    of_both_ways = (places**2).mean(axis=(0, 1))
    assert of_both_ways[0] == pytest.approx(of_both_ways[1], rel=1e-5)


@pytest.fixture
def parallel() -> LightField:
    """Rays down, 0.5 mm apart, by three mirrors side by side, each of 4 x 8 pixels."""
    column, row = np.meshgrid(np.arange(12), np.arange(8))
    x, y = PIXEL_MM * (column - 5.5), PIXEL_MM * (row - 3.5)
    planes = {
        "colour": np.full((8, 12, 3), 100, dtype=np.uint8),
        "mirror": (column // 4 + 1).astype(np.uint16),
        "origin": np.stack([x, y, 0 * x + 50], axis=2).astype(np.float32),
        "direction": np.broadcast_to(np.float32([0, 0, -1]), (8, 12, 3)),
    }
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    camera = Camera(np.array([0.0, 0, 90]), np.array([0.0, 0, -1]), np.array([1.0, 0, 0]), 12, 8, 1)
    boxes = np.array([[4 * k, 4 * k + 4, 0, 8] for k in range(3)])
    frame = CameraFrame(camera, up, Surfaces(50 * up, up, np.zeros(3)), boxes, planes)
    return LightField({"a": frame}, 60.0, {})


def weights(source: LightField, *sigmas: float | None) -> list[float]:
    """Of one ray of each mirror."""
    told = replace(source, facts={RAY_SIGMAS: {"a": list(sigmas)}})
    rays = with_weights(captured_rays(told, footprint=True), told)
    return [float(rays.weight[rays.mirror == k].mean()) for k in range(3)]


def test_the_formula(parallel: LightField) -> None:
    rays = captured_rays(parallel, footprint=True)
    assert pixel_areas(rays) == pytest.approx(np.full(len(rays), PIXEL_MM**2), rel=1e-3)
    found = weights(parallel, 0.0, PIXEL_MM / 12, PIXEL_MM / 2)
    assert found == pytest.approx([1, 1 / (1 + 6 / 144), 0.4], rel=1e-3)
    found = weights(parallel, 0.1, None, 0.3)  # what is unknown counts as the worst
    assert found[1] == pytest.approx(found[2], rel=1e-4)


def test_a_pixel_without_neighbours_counts_as_the_others(parallel: LightField) -> None:
    parallel.frames["a"].planes["mirror"][1:, 4:8] = 0  # leaves a row of the second mirror
    parallel.frames["a"].planes["mirror"][0, 5:8] = 0
    found = weights(parallel, PIXEL_MM / 2, PIXEL_MM / 2, PIXEL_MM / 2)
    assert found == pytest.approx([0.4, 0.4, 0.4], rel=1e-3)


def test_nothing_known_changes_nothing(parallel: LightField) -> None:
    assert weights(parallel, None, None, None) == [1, 1, 1]
    rays = captured_rays(parallel, footprint=True)
    assert with_weights(rays, parallel) is rays


@pytest.mark.parametrize("sigmas", [[0.1, 0.2], [0.1, 0.2, -1], [0.1, "x", 0.2], 3])
def test_what_does_not_fit_is_refused(parallel: LightField, sigmas: object) -> None:
    told = replace(parallel, facts={RAY_SIGMAS: {"a": sigmas}})
    with pytest.raises(InputError, match="does not fit its mirrors"):
        with_weights(captured_rays(told, footprint=True), told)

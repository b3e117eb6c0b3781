"""Blocks leave out no pixel that shows something, and what is blurred in boxes is as in one."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import LensCamera
from tbcad.light.simulate.capture.sensor import pixel_directions
from tbcad.rig.simulated_run import photographs
from tbcad.rig.simulated_run.photographs import (
    SIDE,
    PointSpread,
    blurred,
    boxes_about,
    pixel_blocks,
)

SIZE = (250, 330)  # rows and columns: no multiples of a block
LENS = LensCamera(
    pinhole=np.zeros(3),
    axes=np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0],
    focal=np.array([210.0, 220.0]),
    principal=np.array([160.0, 120.0]),
    distortion=np.array([-0.1, 0.02, 1e-3, -1e-3, 0.0]),
    width_px=SIZE[1],
    height_px=SIZE[0],
)


@pytest.mark.parametrize("seed", range(4))
def test_every_ray_that_meets_a_sphere_is_in_its_blocks(seed: int) -> None:
    random = np.random.default_rng(seed)
    directions = pixel_directions(LENS)
    place = LENS.directions(random.uniform(0, SIZE, (3, 2))[:, ::-1]) * random.uniform(
        50, 500, (3, 1)
    )
    radius = random.uniform(0.01, 0.2, 3) * norm(place)
    along = np.einsum("hwx,kx->hwk", directions, place)
    miss = np.sqrt(np.maximum((place**2).sum(axis=1) - along**2, 0))
    met = np.flatnonzero(((miss < radius) & (along > 0)).any(axis=2))
    blocks = pixel_blocks(directions)
    pixels = blocks.pixels(blocks.about(place, radius))
    assert len(met) > 10
    assert np.isin(met, pixels).all()
    assert (np.diff(pixels) > 0).all()
    wider = (miss < radius + 2 * SIDE / 150 * norm(place)).any(axis=2)
    assert wider.ravel()[pixels].all()  # and few others


def test_a_sphere_about_the_pinhole_is_everywhere_and_one_behind_nowhere() -> None:
    blocks = pixel_blocks(pixel_directions(LENS))
    every = blocks.pixels(blocks.about(np.array([[1.0, 2.0, 2.0]]), np.array([3.1])))
    assert len(every) == SIZE[0] * SIZE[1]
    behind = -100 * LENS.axes[2:]
    assert not blocks.about(behind, np.array([20.0])).any()


def light(seed: int) -> np.ndarray:
    """Few points, so that boxes of groups overlap in all ways, and steps of blocks."""
    random = np.random.default_rng(seed)
    picture = np.zeros((*SIZE, 3), dtype=np.float32)
    row, column = (random.integers(0, size, 60) for size in SIZE)
    picture[row, column] = random.uniform(0, 1, (60, 3))
    for k in range(8):
        picture[SIDE * k + 15, SIDE * k : SIDE * k + 17] = 0.5
    return picture


@pytest.mark.parametrize("seed", range(6))
def test_blurred_by_boxes_is_blurred_whole(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    picture, psf = light(seed), PointSpread()
    boxes = boxes_about(picture, psf.half_px)
    assert len(boxes) > 1
    by_boxes = blurred(picture, psf)
    monkeypatch.setattr(photographs, "boxes_about", lambda *_: [np.s_[:, :]])
    assert (by_boxes == blurred(picture, psf)).all()


def test_no_light_has_no_box() -> None:
    assert boxes_about(np.zeros((*SIZE, 3), dtype=np.float32), 3) == []

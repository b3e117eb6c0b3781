"""What LEDs above the object hide: rays before the object, and none beyond it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.light.simulate.scene.lamps import read_lamps
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import cast_rays, object_in_front, prepared_scene
from tbcad.light.simulate.scene.upper_lamps import hidden_rays, upper_facets, upper_screen
from tests.prototype_records import LAMP_SECTION, UPPER_LAMPS, write_prototype


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export whose prototype has them."""
    return write_prototype(
        tmp_path_factory.mktemp("upper"), lamps={**LAMP_SECTION, "upper": UPPER_LAMPS}
    )


def test_rays_are_hidden_before_the_object_and_not_beyond_it(folder: Path) -> None:
    screen, pinhole = upper_screen(folder), np.array([100.0, 0.0, -100.0])
    outward = np.array([0.0, 0.8, 0.6])
    points = np.array([80 * outward, -80 * outward, [0.0, 80.0, 0.0], [60.0, 60.0, 0.0]])
    direction = -points / np.linalg.norm(points, axis=1)[:, None]
    # By the first LED; past the middle to it; beside all; by a rod that is as high as the middle.
    assert hidden_rays(screen, pinhole, points, direction).tolist() == [True, False, True, False]
    assert not hidden_rays(None, pinhole, points, direction).any()


def test_the_tolerance_hides_more(folder: Path) -> None:
    narrow, wide = upper_screen(folder), upper_screen(folder, wider=True)
    beside = np.array([[4.5, 80 * 0.8, 80 * 0.6]])
    way = np.array([[0.0, -0.8, -0.6]])
    far = np.array([500.0, 0.0, -500.0])
    assert hidden_rays(narrow, far, beside, way).tolist() == [False]
    assert hidden_rays(wide, far, beside, way).tolist() == [True]


def test_photographs_show_them_black_before_the_object(folder: Path) -> None:
    subject = built_in_object(40.0)
    scene = replace(prepared_scene(subject), screen=upper_screen(folder))
    origin, way = np.array([[0.0, 80.0, 60.0]]), np.array([[0.0, -0.8, -0.6]])
    seen = cast_rays(scene, origin, way)
    assert seen.colour.tolist() == [[0.0, 0.0, 0.0]]
    assert seen.depth[0] == pytest.approx(50.0 - 3.0 - 1.0, abs=0.05)
    front, colour = object_in_front(scene, origin[0], way, np.array([90.0]))
    assert front.all()
    assert not colour.any()
    assert cast_rays(prepared_scene(subject), origin, way).colour.any()


def test_lamps_are_read_with_them(folder: Path, tmp_path: Path) -> None:
    lamps = read_lamps(folder)
    assert lamps is not None
    assert lamps.leds.tolist() == [[0.0, 40.0, 30.0], [0.0, -40.0, 30.0]]
    assert lamps.candela == 2.0
    assert len(upper_facets(write_prototype(tmp_path, lamps=LAMP_SECTION))) == 0
    assert len(upper_facets(tmp_path / "none")) == 0

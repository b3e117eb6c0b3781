"""Views one after the other, from what is made once."""

from typing import Literal

import numpy as np
import pytest

import tbcad
from tbcad.errors import InputError
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.depth.plane_sweep import QUICK
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import ThinLens, pinhole_picture, refocus
from tbcad.light.simulate.views.viewpoints import image_quality
from tests.light.depth.test_depth_map import CAPTURE_MM, tiles  # noqa: F401
from tests.light.simulate.conftest import knot  # noqa: F401


def test_a_quick_sweep_gives_as_good_views(tiles: MirrorTiles, knot: Scene) -> None:  # noqa: F811
    fine = depth_views(tiles)
    quick = depth_views(tiles, QUICK)
    rows = []
    for azimuth, elevation in np.radians([(20, 20), (140, 40), (260, 65)]):
        view = camera_around_object(azimuth, elevation, 640.0, CAPTURE_MM, (320, 240))
        truth = to_bytes(pinhole_picture(knot, view))
        rows.append([image_quality(truth, one.of(view)[0].image).ssim for one in (fine, quick)])
    better, worse = np.mean(rows, axis=0)
    assert worse > better - 0.002


@pytest.mark.parametrize("method", ["nearest", "depth"])
def test_views_from_python_are_those_of_one_at_a_time(
    tiles: MirrorTiles,  # noqa: F811
    method: Literal["nearest", "depth"],
) -> None:
    views = tbcad.Views(tiles.source)
    for azimuth in (0.0, 120.0):
        once = tbcad.view(tiles.source, azimuth, 25.0, size=(96, 72), method=method)
        again = views.view(azimuth, 25.0, size=(96, 72), method=method)
        assert np.array_equal(again.colour, once.colour)


def test_refocused_from_python(tiles: MirrorTiles) -> None:  # noqa: F811
    view = camera_around_object(np.radians(20), np.radians(25), 640.0, CAPTURE_MM, (96, 72))
    expected = refocus(tiles, view, ThinLens(200, 10)).colour
    asked = {"aperture_mm": 200, "size": (96, 72)}
    found = tbcad.refocus(tiles.source, 20, 25, focus_mm=10, **asked)  # type: ignore[arg-type]
    assert np.array_equal(found.colour, expected)
    sharp = tbcad.refocus(tiles.source, 20, 25, all_in_focus=True, **asked)  # type: ignore[arg-type]
    assert not np.array_equal(sharp.colour, expected)
    with pytest.raises(InputError, match="--focus 200 is far from the object"):
        tbcad.refocus(tiles.source, focus_mm=200)


def test_a_quick_view_has_fewer_points_of_depth(tiles: MirrorTiles) -> None:  # noqa: F811
    view = camera_around_object(0.2, 0.6, 640.0, CAPTURE_MM, (160, 120))
    sizes = [depth_views(tiles, *sweep).of(view)[1].depth.shape for sweep in ((), (QUICK,))]
    assert sizes == [(30, 40), (15, 20)]

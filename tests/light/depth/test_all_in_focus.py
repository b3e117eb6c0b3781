"""A lens that is sharp everywhere, against one that is sharp on a plane."""

import numpy as np
import pytest

from tbcad.light.datasets.pictures import pinhole_pictures
from tbcad.light.depth.depth_map import depth_map
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import (
    ThinLens,
    pinhole_picture,
    refocus,
    refocus_everywhere,
)
from tbcad.light.simulate.views.viewpoints import image_quality
from tbcad.types import Floats
from tests.light.depth.test_depth_map import CAPTURE_MM, tiles  # noqa: F401
from tests.light.simulate.conftest import knot  # noqa: F401

APERTURE_MM = 100.0
VIEW = camera_around_object(0.4, 0.5, 640.0, CAPTURE_MM, (160, 120))


@pytest.mark.parametrize("plane", [-20.0, 0.0, 12.0])
def test_a_surface_across_the_view_is_the_lens_of_that_focus(
    tiles: MirrorTiles,  # noqa: F811
    plane: float,
) -> None:
    def depth(origin: Floats, direction: Floats) -> Floats:
        away = -float(VIEW.pinhole @ VIEW.forward) - plane
        return np.asarray(away / (direction @ VIEW.forward))

    lens = refocus(tiles, VIEW, ThinLens(APERTURE_MM, plane))
    everywhere = refocus_everywhere(tiles, VIEW, APERTURE_MM, depth)
    differ = np.abs(lens.colour - everywhere.colour).max(axis=2) > 1e-3
    assert differ.mean() < 1e-3  # rays in the middle of two, by rounding


def test_rays_beside_the_surface_are_sharp_on_the_plane_through_the_origin(
    tiles: MirrorTiles,  # noqa: F811
) -> None:
    nothing = refocus_everywhere(
        tiles, VIEW, APERTURE_MM, lambda _, direction: np.full(len(direction), np.inf)
    )
    lens = refocus(tiles, VIEW, ThinLens(APERTURE_MM, 0.0))
    assert (np.abs(lens.colour - nothing.colour).max(axis=2) > 1e-3).mean() < 1e-3


def test_it_is_sharper_than_any_lens(tiles: MirrorTiles, knot: Scene) -> None:  # noqa: F811
    truth = to_bytes(pinhole_picture(knot, VIEW))
    depth = depth_map(pinhole_pictures(tiles.source), VIEW)
    found = refocus_everywhere(tiles, VIEW, APERTURE_MM, depth.along_rays).image
    lenses = [refocus(tiles, VIEW, ThinLens(APERTURE_MM, plane)).image for plane in (-10, 0, 10)]
    best = max(image_quality(truth, image).ssim for image in lenses)
    assert image_quality(truth, found).ssim > best + 0.01

"""The method that is chosen for a light field makes the better views of it."""

import numpy as np
import pytest

from tbcad.mirrors.array import design
from tbcad.simulate.capture.light_field import light_field_in_memory
from tbcad.simulate.capture.photograph import photograph, to_bytes
from tbcad.simulate.image_quality import image_quality
from tbcad.simulate.scene.ground_truth import pinhole_picture
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.simulate.scene.rays import exact_tracer
from tbcad.simulate.scene.reflector import reflectors
from tbcad.simulate.scene.viewpoint import camera_around_object
from tbcad.simulate.views.method import suitable_method
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import Method, synthesise
from tbcad.spec.load import load_spec

VIEWPOINTS_DEG = ((30, 20), (120, 45), (250, 70))


def tiles_of(n: int, width_px: int, height_px: int, scene: Scene) -> MirrorTiles:
    options = [f"n={n}", f"camera.width_px={width_px}", f"camera.height_px={height_px}"]
    cameras = reflectors(design(load_spec(None, options)))
    photographs = [(at, photograph(at.camera, exact_tracer(at), scene)) for at in cameras]
    return MirrorTiles(light_field_in_memory(photographs, 60.0))


def mean_ssim(tiles: MirrorTiles, scene: Scene, method: Method) -> float:
    found = []
    for azimuth, elevation in np.radians(VIEWPOINTS_DEG):
        view = camera_around_object(azimuth, elevation, 640.0, 60.0, (320, 240))
        truth = to_bytes(pinhole_picture(scene, view))
        found.append(image_quality(truth, synthesise(tiles, view, method).image).ssim)
    return float(np.mean(found))


@pytest.mark.parametrize(
    ("n", "size", "better"), [(4, (1040, 776), "nearest"), (10, (520, 388), "blend")]
)
def test_the_better_method_is_chosen(
    n: int, size: tuple[int, int], better: Method, knot: Scene
) -> None:
    """Few virtual cameras with many pixels each make ghosts in a blend, many with few do not."""
    tiles = tiles_of(n, *size, knot)
    chosen = suitable_method(tiles)
    other: Method = "blend" if better == "nearest" else "nearest"
    assert chosen.method == better
    assert mean_ssim(tiles, knot, better) > mean_ssim(tiles, knot, other)
    assert "pixels apart" in chosen.reason

"""The method that is chosen for a light field makes the better views of it."""

import pytest

from tbcad.mirrors.array import design
from tbcad.simulate.capture.light_field import light_field_in_memory
from tbcad.simulate.capture.photograph import photograph
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.simulate.scene.rays import exact_tracer
from tbcad.simulate.scene.reflector import reflectors
from tbcad.simulate.views.method import suitable_method
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import Method
from tbcad.spec.load import load_spec
from tests.view_quality import mean_ssim

VIEWPOINTS_DEG = ((30, 20), (120, 45), (250, 70))


def tiles_of(n: int, width_px: int, height_px: int, scene: Scene) -> MirrorTiles:
    options = [f"n={n}", f"camera.width_px={width_px}", f"camera.height_px={height_px}"]
    cameras = reflectors(design(load_spec(None, options)))
    photographs = [(at, photograph(at.camera, exact_tracer(at), scene)) for at in cameras]
    return MirrorTiles(light_field_in_memory(photographs, 60.0))


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
    quality = {
        one: mean_ssim(tiles, knot, one, VIEWPOINTS_DEG, (320, 240)) for one in (better, other)
    }
    assert chosen.method == better
    assert quality[better] > quality[other]
    assert "pixels apart" in chosen.reason

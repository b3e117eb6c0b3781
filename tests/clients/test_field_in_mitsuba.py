"""The opacity of a field, rendered by Mitsuba as an absorbing medium before white light.

Its media do not emit, so it says nothing about colours: those are compared with sums in double
precision (tests/light/reconstruction/test_marching.py).
"""

import numpy as np
import pytest
from scipy import ndimage

from tbcad.light.reconstruction.field import Field, Grid, density_of
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.simulate.scene.rays import camera_around_object
from tests.ray_fields import RADIUS

pytestmark = pytest.mark.clients

SIZE, SAMPLES, FINER = (36, 28), 256, 90


def made() -> Field:
    """Two soft balls and a block of fog, with nothing stored between them."""
    n = 31
    axis = np.linspace(-RADIUS, RADIUS, n)
    places = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    number = np.full((n, n, n), -3.0)
    for centre, radius, steep in (((3, 2, 0), 3.5, 0.5), ((-4, 1, -2), 2.5, 2.0)):
        number = np.maximum(number, steep * (radius - np.linalg.norm(places - centre, axis=-1)))
    fog = (np.abs(places - [0, -4, 3]) < [4, 2, 1.5]).all(axis=-1)
    number = np.clip(np.where(fog, 0.15, number), -3, 3)
    grid = Grid.about(number > -1, 2 * RADIUS)
    values = np.zeros((len(grid), 4), np.float32)
    values[:, 0] = number[tuple(grid.place.T)]
    return Field(grid, values)


def densities(field: Field) -> np.ndarray:
    """Density at the middles of the cells of a finer lattice, as Mitsuba's grids have it."""
    at = np.stack(
        np.meshgrid(*[(np.arange(FINER) + 0.5) / FINER * (field.grid.n - 1)] * 3, indexing="ij")
    )
    whole = (field.grid.leap == 0)[tuple(at.astype(int))]
    number = ndimage.map_coordinates(field.grid.dense(field.values[:, 0]), at, order=1)
    return np.where(whole, density_of(number), 0).astype(np.float32)


def test_opacity_is_what_mitsuba_absorbs() -> None:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    field, view = made(), camera_around_object(0.6, 0.5, 60.0, 2 * RADIUS, SIZE)
    across = mi.ScalarTransform4f
    cube = across().scale(2 * RADIUS).translate([-0.5] * 3)
    grid = np.ascontiguousarray(densities(field).transpose(2, 1, 0)[..., None])
    medium = {
        "type": "heterogeneous",
        "albedo": 0.0,
        "sigma_t": {
            "type": "gridvolume",
            "grid": mi.VolumeGrid(grid),
            "to_world": cube,
            "raw": True,
        },
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 10_000},
            "light": {"type": "constant", "radiance": 1.0},
            "cube": {
                "type": "cube",
                "to_world": across().scale(RADIUS),
                "bsdf": {"type": "null"},
                "interior": medium,
            },
            "sensor": {
                "type": "perspective",
                "fov": float(np.degrees(view.hfov)),
                "to_world": across().look_at(
                    view.pinhole.tolist(), [0, 0, 0], (-view.axes[1]).tolist()
                ),
                "film": {
                    "type": "hdrfilm",
                    "width": SIZE[0],
                    "height": SIZE[1],
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": "independent", "sample_count": SAMPLES},
            },
        }
    )
    absorbed = 1 - np.array(mi.render(scene, seed=1))[..., 0]
    # Their rays are spread over the pixel, so ours are too: nine pictures of a finer camera.
    finer = camera_around_object(0.6, 0.5, 60.0, 2 * RADIUS, (3 * SIZE[0], 3 * SIZE[1]))
    opacity = field_picture(field, finer).opacity.reshape(SIZE[1], 3, SIZE[0], 3).mean((1, 3))
    assert opacity.max() > 0.95
    assert (opacity < 0.01).mean() > 0.3
    apart = absorbed - opacity
    noise = np.sqrt(np.maximum(opacity * (1 - opacity), 0.003) / SAMPLES)
    assert abs(apart.mean()) < 0.003
    assert np.sqrt(np.mean((apart / noise) ** 2)) < 1.3
    assert np.abs(apart / noise).max() < 6

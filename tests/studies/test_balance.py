"""The balance of virtual cameras and pixels by object."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.common.results import Study
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.ray_casting import LAMPS, cast_rays, prepared_scene
from tbcad.light.simulate.views.viewpoints import viewpoints_over_hemisphere
from tbcad.studies.balance import SUBDIVISIONS, balance, parse_subdivisions

SMALL = load_spec(None, ["camera.width_px=416", "camera.height_px=310"])


@pytest.fixture(scope="module")
def study() -> Study:
    return balance(SMALL, (4, 8), 3, 640.0, "nearest")


@pytest.mark.slow
def test_every_object_at_every_n(study: Study) -> None:
    table, best = study.tables
    assert len(table.rows) == 2 * 4
    assert table.column("virtual_cameras") == [89] * 4 + [337] * 4
    pixels = table.numbers("pixels")
    assert (pixels[:4] > 2 * pixels[4:]).all()
    assert ((table.numbers("ssim_on_object") > 0) & (table.numbers("ssim_on_object") < 1)).all()
    assert len(best.rows) == 4
    for row in best.records():
        own = table.where(surface=row["surface"], radius_mm=row["radius_mm"])
        assert row["ssim_on_object"] == own.numbers("ssim_on_object").max()


@pytest.mark.slow
def test_far_from_the_reference_plane_more_cameras_are_worth_more(study: Study) -> None:
    """A matt surface near it needs pixels, one far from it directions."""
    rows = [study.tables[0].where(surface="matt", n=n).numbers("ssim_on_object") for n in (4, 8)]
    gain = rows[1] - rows[0]
    assert gain[1] > gain[0]


def test_a_highlight_moves_with_the_viewpoint_and_is_where_light_is_mirrored() -> None:
    matt = prepared_scene(patterned_ball(20.0))
    glossy = replace(matt, gloss=1.0)
    rng = np.random.default_rng(1)
    toward = rng.normal(size=(4000, 3))
    toward[:, 2] = np.abs(toward[:, 2])
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    aim = rng.uniform(-10, 10, size=toward.shape)
    origin = aim + 200 * toward
    plain, glint = (cast_rays(scene, origin, -toward) for scene in (matt, glossy))
    assert np.array_equal(plain.depth, glint.depth)
    brighter = (glint.colour - plain.colour).max(axis=1) > 20
    normal = (origin - plain.depth[:, None] * toward) / 20
    half = [(toward + lamp) / np.linalg.norm(toward + lamp, axis=1)[:, None] for lamp in LAMPS]
    hit = np.isfinite(plain.depth)
    angle = np.min([np.arccos(np.clip((normal * h).sum(1), -1, 1)) for h in half], axis=0)
    assert 20 < brighter.sum() < hit.sum() / 2
    assert angle[hit & brighter].max() < np.radians(22)
    assert brighter[hit & (angle < np.radians(3)) & (plain.colour.min(axis=1) < 150)].all()


def test_subdivisions() -> None:
    assert parse_subdivisions(None) == SUBDIVISIONS
    assert parse_subdivisions([9, 4, 9]) == (4, 9)
    for wrong in (1, 61):
        with pytest.raises(InputError, match=f"--n is {wrong}, allowed is 2 to 60"):
            parse_subdivisions([4, wrong])


def test_viewpoints_are_even_over_the_hemisphere() -> None:
    """As many on each belt of equal area: of equal height (Archimedes)."""
    views = viewpoints_over_hemisphere(200, 640.0)
    height = np.sin(np.radians(views.elevation_deg))
    assert np.histogram(height, 10, (0, 1))[0].tolist() == [20] * 10
    quarter, _ = np.histogram(views.azimuth_deg, 4, (0, 360))
    assert np.ptp(quarter) <= 4
    assert np.abs(np.sin(2 * np.radians(views.azimuth_deg[:50]))).min() > 0.01
    with pytest.raises(InputError, match="--views 0: allowed is 1 to 1000"):
        viewpoints_over_hemisphere(0, 640.0)

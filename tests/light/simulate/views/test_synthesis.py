"""Pictures out of the light field against what a real camera sees."""

from dataclasses import replace
from io import BytesIO
from typing import Literal

import numpy as np
import pytest
from PIL import Image

import tbcad
from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import Camera
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene, depth_along_rays
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.ray_bundle import two_plane_along
from tbcad.light.simulate.views.refocus import (
    ThinLens,
    lens_picture,
    lens_pinholes,
    pinhole_picture,
    refocus,
)
from tbcad.light.simulate.views.synthesis import horizon_search_radius, synthesise
from tbcad.light.simulate.views.viewpoints import image_quality

SIZE = (160, 120)


def view_from(azimuth: float, elevation: float, distance: float = 640.0) -> Camera:
    return camera_around_object(np.radians(azimuth), np.radians(elevation), distance, 60.0, SIZE)


@pytest.mark.parametrize(("azimuth", "elevation"), [(20.0, 20.0), (90.0, 85.0)])
def test_views_resemble_the_truth_and_blends_more_so(
    tiles: MirrorTiles, knot: Scene, azimuth: float, elevation: float
) -> None:
    view = view_from(azimuth, elevation)
    truth = to_bytes(pinhole_picture(knot, view))
    plain = image_quality(truth, synthesise(tiles, view).image)
    blended = image_quality(truth, synthesise(tiles, view, depth_along_rays(knot)).image)
    turned = image_quality(
        truth, to_bytes(pinhole_picture(knot, view_from(azimuth + 20, elevation)))
    )
    assert plain.psnr_db > turned.psnr_db
    assert plain.ssim > turned.ssim
    assert blended.psnr_db > plain.psnr_db


@pytest.mark.parametrize("method", ["nearest", "depth"])
def test_from_python_it_is_the_view_of_the_command(
    tiles: MirrorTiles, light_field: LightField, method: Literal["nearest", "depth"]
) -> None:
    """`tbcad.view`, by default at the depth that is found, and what a notebook shows of it."""
    view = view_from(20, 60)
    if method == "depth":
        expected, found = depth_views(tiles).of(view)[0], tbcad.view(light_field, 20, 60, size=SIZE)
    else:
        expected = synthesise(tiles, view)
        found = tbcad.view(light_field, 20, 60, size=SIZE, method=method)
    assert np.array_equal(found.colour, expected.colour)
    views = tbcad.Views(light_field)
    for _ in range(2):
        again = views.view(20, 60, size=SIZE, method=method)
        assert np.array_equal(again.colour, expected.colour)
    assert repr(found).startswith("<SynthesisedView: 160 x 120, ")
    with Image.open(BytesIO(found._repr_png_())) as shown:
        assert np.array_equal(np.asarray(shown), expected.image)


def test_the_number_of_threads_does_not_matter(
    tiles: MirrorTiles, knot: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    view, depth = view_from(50, 30), depth_along_rays(knot)
    before = synthesise(tiles, view, depth).colour
    focus = ThinLens(200, 0)
    mean = refocus(tiles, view, focus).colour
    monkeypatch.setattr("tbcad.light.simulate.parallel.THREADS", 1)
    assert np.array_equal(synthesise(tiles, view, depth).colour, before)
    assert np.array_equal(refocus(tiles, view, focus).colour, mean)


def test_without_captured_rays_only_what_misses_the_capture_sphere_is_complete(
    light_field: LightField,
) -> None:
    """The boundary is the sphere's own radius, to a pixel."""
    frame = light_field.frames["b"]
    nothing = {**frame.planes, "mirror": np.zeros_like(frame.planes["mirror"])}
    empty = LightField({"b": replace(frame, planes=nothing)}, 60.0, {})
    view = view_from(70, 40)
    miss = np.linalg.norm(np.cross(view.pinhole, view_directions(view)), axis=2)
    for picture in (
        synthesise(MirrorTiles(empty), view),
        refocus(MirrorTiles(empty), view, ThinLens(1e-6, 0)),
    ):
        assert np.array_equal(picture.seen, miss > 30.0)
        assert not picture.colour.any()


def test_horizon_search_radius_is_the_distance_of_a_ray_below_the_nearest_mirror(
    tiles: MirrorTiles,
) -> None:
    """By search over the rays through the apex, at a capture radius from the target there."""
    depth = np.linalg.norm(tiles.apex, axis=1).min()
    two_plane = two_plane_along(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), 60.0)
    down = two_plane.axes[1]
    slopes = np.linspace(0, 0.5, 100_001)
    through_apex = unit(two_plane.axes[2] + slopes[:, None] * down)
    apex = -depth * two_plane.axes[2]
    captured = two_plane.coordinates(np.broadcast_to(apex, through_apex.shape), through_apex)
    target = two_plane.coordinates((apex + 30.0 * down)[None], two_plane.axes[2:])
    nearest = np.linalg.norm(captured - target, axis=1).min()
    assert horizon_search_radius(tiles) == pytest.approx(nearest, rel=1e-6)


@pytest.mark.parametrize("azimuth", [0.0, 90.0])
def test_views_from_the_horizon_have_no_holes(
    tiles: MirrorTiles, knot: Scene, azimuth: float
) -> None:
    """Half of their rays come from below all mirrors: the nearest captured ones stand in."""
    for depth in (None, depth_along_rays(knot)):
        assert synthesise(tiles, view_from(azimuth, 0), depth).seen.all()


def test_refocus_is_a_lens(tiles: MirrorTiles, knot: Scene) -> None:
    """Nearer to a real lens of that focus than to one of another, or to a pinhole."""
    view, focus = view_from(30, 45), ThinLens(250, 0)
    picture = refocus(tiles, view, focus).image
    alike = image_quality(to_bytes(lens_picture(knot, view, focus, 64)), picture)
    elsewhere = image_quality(to_bytes(lens_picture(knot, view, ThinLens(250, 25), 64)), picture)
    sharp = image_quality(to_bytes(pinhole_picture(knot, view)), picture)
    assert alike.psnr_db > max(elsewhere.psnr_db, sharp.psnr_db) + 3


def test_the_papers_69_pinholes() -> None:
    """Section 4.3: 69 cameras over the aperture; symmetric, on the disc, evenly apart."""
    places = lens_pinholes()
    assert len(places) == 69
    assert np.linalg.norm(places, axis=1).max() == pytest.approx(1)
    assert {tuple(place) for place in -places} == {tuple(place) for place in places}


def test_the_capture_sphere_fills_a_view() -> None:
    for elevation in (0, 45, 90):
        view = view_from(33, elevation, 500)
        assert view.forward @ view.right == pytest.approx(0)
        sphere = np.arcsin(30 / 500)
        assert np.tan(sphere) < view.half_sizes[1] < 1.1 * np.tan(sphere)

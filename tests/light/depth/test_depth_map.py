"""A view's depth: as a surface for blends and lenses, as points, as files; quick views."""

from io import BytesIO

import numpy as np
import pytest
import trimesh
from PIL import Image

import tbcad
from tbcad.core.mirrors.array import design
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.light.datasets.pictures import PinholePictures, pinhole_pictures
from tbcad.light.datasets.virtual_cameras import camera_at
from tbcad.light.depth.depth_map import DepthMap, depth_map, depth_points, depth_views
from tbcad.light.depth.plane_sweep import QUICK, swept_depth
from tbcad.light.simulate.capture.light_field import light_field_in_memory
from tbcad.light.simulate.capture.photograph import photograph, to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene, depth_along_rays
from tbcad.light.simulate.scene.rays import camera_around_object, exact_tracer, unit_directions
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import (
    ThinLens,
    pinhole_picture,
    refocus,
    refocus_everywhere,
)
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.simulate.views.viewpoints import image_quality
from tbcad.types import Floats

CAPTURE_MM = 60.0
VIEW = camera_around_object(0.4, 0.5, 640.0, CAPTURE_MM, (40, 30))
APERTURE_MM = 100.0
WIDE = camera_around_object(0.4, 0.5, 640.0, CAPTURE_MM, (160, 120))
SIZE_PX, REACH_MM = 60, 250.0
SWEPT_VIEW = camera_around_object(0.3, 0.6, 640.0, CAPTURE_MM, (80, 60))


@pytest.fixture(scope="module")
def tiles(knot: Scene) -> MirrorTiles:
    options = ["n=8", "camera.width_px=832", "camera.height_px=620"]
    cameras = reflectors(design(load_spec(None, options)))
    photographs = [(at, photograph(at.camera, exact_tracer(at), knot)) for at in cameras]
    return MirrorTiles(light_field_in_memory(photographs, CAPTURE_MM))


def flat(depth: float) -> DepthMap:
    confidence = np.full((30, 40), 9.0)
    confidence[0, 0] = 0
    return DepthMap(VIEW, np.full((30, 40), depth), confidence, CAPTURE_MM)


def test_rays_points_and_the_picture_meet_the_surface() -> None:
    found = flat(-7.0)
    points = depth_points(found.view, found.known())
    assert np.isnan(points[0, 0]).all()
    rest = points[1:].reshape(-1, 3)
    assert rest @ VIEW.forward == pytest.approx(np.full(len(rest), -7.0))
    direction = (rest - VIEW.pinhole) / np.linalg.norm(rest - VIEW.pinhole, axis=1)[:, None]
    origin = np.broadcast_to(VIEW.pinhole, direction.shape)
    distance = found.along_rays(origin, direction)
    assert origin + distance[:, None] * direction == pytest.approx(rest)
    image = np.asarray(Image.open(BytesIO(found.png())))
    assert image[0, 0] == 0  # nothing is known there; the nearest is white
    assert abs(image[5, 5] - 65534 * (30 + 7) / 60) < 2


def test_the_points_have_colours_but_for_the_background() -> None:
    image = np.zeros((120, 160, 3), dtype=np.uint8)
    image[:, 80:] = (200, 10, 30)
    cloud = trimesh.load(BytesIO(flat(4.0).ply(image)), file_type="ply")
    assert isinstance(cloud, trimesh.PointCloud)
    assert len(cloud.vertices) == 30 * 20
    assert (np.asarray(cloud.colors)[:, :3] == (200, 10, 30)).all()


def test_views_are_as_good_as_with_the_true_surface_also_quick_ones(
    tiles: MirrorTiles, knot: Scene
) -> None:
    """Within 0.005 of the blend on the true depth, and better than nearest rays."""
    rows, fine, quick = [], depth_views(tiles), depth_views(tiles, QUICK)
    for place in np.radians([(20, 20), (260, 65)]):
        view = camera_around_object(*place, 640.0, CAPTURE_MM, (160, 120))
        truth = to_bytes(pinhole_picture(knot, view))
        images = (
            synthesise(tiles, view).image,
            synthesise(tiles, view, depth_along_rays(knot)).image,
            fine.of(view)[0].image,
            quick.of(view)[0].image,
        )
        rows.append([image_quality(truth, image).ssim for image in images])
    nearest, true, found, worse = np.mean(rows, axis=0)
    assert found > true - 0.005
    assert found > nearest + 0.01
    assert worse > found - 0.004
    assert [one.of(WIDE)[1].depth.shape for one in (fine, quick)] == [(30, 40), (15, 20)]


@pytest.mark.parametrize("plane", [-20.0, 12.0, None])
def test_a_surface_across_the_view_is_the_lens_of_that_focus(
    tiles: MirrorTiles, plane: float | None
) -> None:
    def depth(origin: Floats, direction: Floats) -> Floats:
        if plane is None:  # beside the surface
            return np.full(len(direction), np.inf)
        away = -float(WIDE.pinhole @ WIDE.forward) - plane
        return np.asarray(away / (direction @ WIDE.forward))

    lens = refocus(tiles, WIDE, ThinLens(APERTURE_MM, plane or 0.0))
    everywhere = refocus_everywhere(tiles, WIDE, APERTURE_MM, depth)
    differ = np.abs(lens.colour - everywhere.colour).max(axis=2) > 1e-3
    assert differ.mean() < 1e-3  # rays in the middle of two, by rounding


def test_it_is_sharper_than_any_lens(tiles: MirrorTiles, knot: Scene) -> None:
    truth = to_bytes(pinhole_picture(knot, WIDE))
    depth = depth_map(pinhole_pictures(tiles.source), WIDE)
    found = refocus_everywhere(tiles, WIDE, APERTURE_MM, depth.along_rays).image
    lenses = [refocus(tiles, WIDE, ThinLens(APERTURE_MM, plane)).image for plane in (-10, 0, 10)]
    best = max(image_quality(truth, image).ssim for image in lenses)
    assert image_quality(truth, found).ssim > best + 0.01


def test_refocused_from_python(tiles: MirrorTiles) -> None:
    view = camera_around_object(np.radians(20), np.radians(25), 640.0, CAPTURE_MM, (96, 72))
    expected = refocus(tiles, view, ThinLens(200, 10)).colour
    asked = {"aperture_mm": 200, "size": (96, 72)}
    found = tbcad.refocus(tiles.source, 20, 25, focus_mm=10, **asked)  # type: ignore[arg-type]
    assert np.array_equal(found.colour, expected)
    sharp = tbcad.refocus(tiles.source, 20, 25, all_in_focus=True, **asked)  # type: ignore[arg-type]
    assert not np.array_equal(sharp.colour, expected)
    with pytest.raises(InputError, match="--focus 200 is far from the object"):
        tbcad.refocus(tiles.source, focus_mm=200)


def texture(points: Floats) -> Floats:
    """Colours (..., 3) that change within some mm in all directions."""
    waves = np.array([[0.9, 0.3, 0.2], [-0.2, 0.8, 0.5], [0.4, -0.5, 0.9]])
    return np.asarray(128 + 100 * np.sin(points @ waves.T))


def pictures_of(depth: float) -> PinholePictures:
    """Cameras around the view's direction that see a textured plane of some depth."""
    rng = np.random.default_rng(4)
    toward = -SWEPT_VIEW.forward + 0.3 * rng.uniform(-1, 1, (150, 3))
    centres = REACH_MM * toward / np.linalg.norm(toward, axis=1)[:, None]
    cameras = [camera_at(centre, CAPTURE_MM, SIZE_PX) for centre in centres]
    picture = np.stack([np.rint(texture(met(camera, depth))) for camera in cameras])
    return PinholePictures(
        centres,
        np.stack([camera.axes for camera in cameras]),
        np.array([1 / camera.pixel_pitch for camera in cameras]),
        picture.astype(np.uint8),
        np.ones(picture.shape[:3], dtype=bool),
        CAPTURE_MM,
    )


def met(camera: Camera, depth: float) -> Floats:
    """Where the rays of all pixels meet the plane, (h, w, 3)."""
    ray = unit_directions(camera, range(camera.height_px))
    start = camera.pinhole - depth * SWEPT_VIEW.forward
    distance = -(start @ SWEPT_VIEW.forward) / (ray @ SWEPT_VIEW.forward)
    return np.asarray(camera.pinhole + distance[..., None] * ray)


@pytest.mark.parametrize("depth", [-12.0, 0.0, 9.3])
def test_a_plane(depth: float) -> None:
    found, confidence = swept_depth(pictures_of(depth), SWEPT_VIEW)
    middle = np.s_[18:42, 24:56]
    assert np.abs(found[middle] - depth).max() < 1.0
    assert np.median(np.abs(found[middle] - depth)) < 0.3
    assert confidence[middle].min() > 3


def test_what_has_no_texture_is_not_known() -> None:
    pictures = pictures_of(0.0)
    pictures.picture[...] = 90
    _, confidence = swept_depth(pictures, SWEPT_VIEW)
    assert confidence.max() < 1e-3


def test_rays_that_pass_the_capture_sphere_have_no_depth() -> None:
    found, confidence = swept_depth(pictures_of(0.0), SWEPT_VIEW)
    ray = unit_directions(SWEPT_VIEW, range(60))
    passes = np.linalg.norm(np.cross(SWEPT_VIEW.pinhole, ray), axis=2) > CAPTURE_MM / 2 + 0.5
    assert passes.any()
    assert np.isnan(found[passes]).all()
    assert (confidence[passes] == 0).all()


def test_few_cameras_know_nothing() -> None:
    pictures = pictures_of(0.0)
    pictures.mask[2:] = False
    found, confidence = swept_depth(pictures, SWEPT_VIEW)
    assert np.isnan(found).all()
    assert confidence.max() == 0

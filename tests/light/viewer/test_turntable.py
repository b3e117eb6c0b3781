"""Turntables, and views of a field: moving, at rest, by a lens and in Python."""

import base64
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

import tbcad
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.datasets.pictures import PinholePictures, pinhole_pictures
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.depth.plane_sweep import QUICK
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.ray_bundle import TwoPlane, two_plane_along
from tbcad.light.simulate.views.refocus import ThinLens, refocus
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.viewer.page import Query
from tbcad.light.viewer.render import (
    BEGIN,
    KIND,
    WEBP_QUALITIES,
    Turntable,
    field_renderer,
    moving_view,
    smallest_loss,
    turntable_page,
    write_turntable,
)
from tbcad.light.viewer.server import ViewServer
from tbcad.types import Floats
from tests.light.viewer.fields import CAPTURE_MM, ball, data_of

TABLE = Turntable(4, (20.0, 60.0), 640.0, (160, 120), "nearest")
SMALL = Query(azimuth=40, elevation=20, width=160, height=120, still=1)


def error(file: Path, row: int, column: int, image: np.ndarray) -> float:
    """Mean difference of a turntable's view from an image."""
    frames = data_of(file.read_text(encoding="utf-8"))["frames"]
    assert isinstance(frames, list)
    assert {len(views) for views in frames} == {TABLE.columns}
    shown = Image.open(BytesIO(base64.b64decode(frames[row][column]))).convert("RGB")
    return float(np.abs(np.asarray(shown).astype(float) - image).mean())


@pytest.mark.parametrize("method", ["nearest", "depth"])
def test_views_are_those_of_the_library(tiles: MirrorTiles, tmp_path: Path, method: str) -> None:
    file, told = tmp_path / "knot.html", list[str]()
    table = replace(TABLE, method=method)
    size = write_turntable(file, tiles, table, "knot", told.append)
    page = file.read_text(encoding="utf-8")
    assert size == file.stat().st_size
    assert page.startswith(BEGIN)
    assert len(told) >= len(TABLE.elevations_deg)
    assert data_of(page)["kind"] == KIND
    view = Query(azimuth=180, elevation=60, width=160, height=120).camera(CAPTURE_MM)
    images = {
        "nearest": synthesise(tiles, view).image,
        "depth": depth_views(tiles, QUICK).of(view)[0].image,
    }
    errors = {name: error(file, 1, 2, image) for name, image in images.items()}
    assert errors[method] < 4
    assert min(errors, key=lambda name: errors[name]) == method


def test_pictures_lose_detail_until_they_fit() -> None:
    noise = np.random.default_rng(1).integers(0, 256, (1, 4, 120, 160, 3), dtype=np.uint8)
    pictures = [list(row) for row in noise]
    sizes = [len(turntable_page(pictures, TABLE, "knot", q).encode()) for q in WEBP_QUALITIES]
    assert sizes == sorted(sizes, reverse=True)
    for size in sizes:
        assert len(smallest_loss(pictures, TABLE, "knot", size)) == size
    with pytest.raises(InputError, match="4 x 1 views do not fit into"):
        smallest_loss(pictures, TABLE, "knot", sizes[-1] - 1)


def shown(picture: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return picture.max(axis=2) > 100


def test_a_view_that_moves_is_nearly_that_at_rest() -> None:
    renderer = field_renderer(ball())
    still, moving = (renderer.picture(Query(**{**vars(SMALL), "still": k})) for k in (1, 0))
    assert moving.shape == still.shape
    assert not np.array_equal(moving, still)
    assert (shown(moving) == shown(still)).mean() > 0.99


def test_a_lens_is_of_the_light_field(tiles: MirrorTiles) -> None:
    query = Query(aperture=200, focus=10, width=64, height=48, still=1)
    view = query.camera(CAPTURE_MM)
    with_lens = field_renderer(ball(), tiles)
    expected = refocus(tiles, view, ThinLens(200, 10)).image
    assert np.array_equal(with_lens.picture(query), expected)
    with pytest.raises(InputError, match="aperture 200: a field alone has none"):
        field_renderer(ball()).picture(query)


@pytest.mark.parametrize("lens", [True, False])
def test_a_page_has_sliders_of_a_lens_where_there_is_one(tiles: MirrorTiles, lens: bool) -> None:
    made = field_renderer(ball(), tiles if lens else None)
    with ViewServer(made, "ball", SMALL) as server:
        page = server.page.decode()
    assert (data_of(page)["method"], data_of(page)["lens"]) == ("field", lens)
    assert f"<title>ball: {'light field' if lens else 'field'}</title>" in page
    assert "{{" not in page


def test_views_in_python() -> None:
    view = tbcad.view(ball(), 40, 20, size=(160, 120))
    assert np.array_equal(view.image, field_picture(ball(), SMALL.camera(CAPTURE_MM)).image)
    assert np.array_equal(view.image, field_renderer(ball()).picture(SMALL))
    assert view.seen.all()
    assert tbcad.Views(ball()).view(40, 20, size=(160, 120))._repr_png_() == view._repr_png_()
    with pytest.raises(InputError, match="'depth' is for a light field"):
        tbcad.view(ball(), method="depth")


def seen_from(distance: float) -> Camera:
    return camera_around_object(*np.radians([70, 35]), distance, CAPTURE_MM, (150, 100))


def numbered(count: int, seed: int) -> PinholePictures:
    """Virtual cameras at random, each with a picture of one colour, its number."""
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    axes *= np.linalg.det(axes)[:, None, None]
    centre = -rng.uniform(90, 400, count)[:, None] * axes[:, 2]
    picture = np.zeros((count, 4, 4, 3), dtype=np.uint8)
    picture[...] = np.arange(count)[:, None, None, None] + 1
    # So wide that the whole capture sphere is in every picture.
    return PinholePictures(
        centre, axes, np.ones(count), picture, np.ones(picture.shape[:3], dtype=bool), CAPTURE_MM
    )


@pytest.fixture(scope="module")
def pictures(light_field: LightField) -> PinholePictures:
    return pinhole_pictures(light_field)


def distance(two_plane: TwoPlane, target: Floats, centre: Floats) -> float:
    """Of a target ray (4,) from the nearest of all rays through a point, by least squares.

    A ray through (x, y) at depth z, in units of s, with slope (a, b) is (x - z a, y - z b, a, b).
    """
    x, y, z = two_plane.place(centre[None])[0]
    matrix = np.array([[-z, 0.0], [0.0, -z], [1.0, 0.0], [0.0, 1.0]])
    wanted = target - [x, y, 0, 0]
    slopes = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    return float(np.linalg.norm(matrix @ slopes - wanted))


@pytest.mark.parametrize("reach", [150.0, 640.0])
def test_a_pixel_is_of_the_nearest_virtual_camera(reach: float) -> None:
    pictures, view = numbered(120, 5), seen_from(reach)
    image = moving_view(pictures, view)
    two_plane = two_plane_along(view.forward, view.right, CAPTURE_MM)
    direction = view_directions(view)
    front = np.flatnonzero((pictures.centre @ view.forward) < 0)
    for row, column in np.random.default_rng(1).integers(0, (100, 150), (60, 2)):
        ray = direction[row, column]
        passes = np.linalg.norm(np.cross(view.pinhole, ray)) > CAPTURE_MM / 2
        target = two_plane.coordinates(view.pinhole[None], ray[None])[0]
        distances = [distance(two_plane, target, pictures.centre[k]) for k in front]
        expected = 0 if passes else front[np.argmin(distances)] + 1
        assert image[row, column].tolist() == [expected] * 3


def test_masked_pictures_are_not_taken() -> None:
    pictures, view = numbered(40, 3), seen_from(640.0)
    used = np.unique(moving_view(pictures, view))
    pictures.mask[used[-1] - 1] = False
    assert used[-1] not in moving_view(pictures, view)


def test_places_in_pictures_are_the_cameras_own(pictures: PinholePictures) -> None:
    """Each picture seen from its own pinhole is that picture."""
    size, number = pictures.mask.shape[1], 17
    hfov = 2 * np.arctan(size / 2 / pictures.focal_px[number])
    right, _, forward = pictures.axes[number]
    view = Camera(pictures.centre[number], forward, right, size, size, float(hfov))
    known = ndimage.binary_erosion(pictures.mask[number], np.ones((3, 3)))
    assert known.sum() > 100
    difference = moving_view(pictures, view)[known].astype(int) - pictures.picture[number][known]
    assert np.abs(difference).max() <= 1

"""Views of a field: moving, at rest, by a lens, as a turntable and in Python."""

import base64
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import tbcad
from tbcad.errors import InputError
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.simulate.views.refocus import ThinLens, refocus
from tbcad.light.viewer.page import Query
from tbcad.light.viewer.render import FieldRenderer, Renderer, Turntable, write_turntable
from tbcad.light.viewer.server import ViewServer
from tests.light.viewer.fields import CAPTURE_MM, COLOUR, RADIUS_MM, ball, data_of

SMALL = Query(azimuth=40, elevation=20, width=160, height=120, still=1)
COLOUR_8 = np.rint(255 * np.array(COLOUR))


def shown(picture: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return picture.max(axis=2) > 100


def test_a_ball_is_seen_as_large_as_it_is() -> None:
    picture = FieldRenderer(ball()).picture(SMALL)
    assert np.array_equal(picture[60, 80], COLOUR_8)
    view = SMALL.camera(CAPTURE_MM)
    radius_px = RADIUS_MM / np.sqrt(640**2 - RADIUS_MM**2) / view.pixel_pitch
    assert np.sqrt(shown(picture).sum() / np.pi) == pytest.approx(radius_px, rel=0.03)
    assert picture[:5].max() == 0


def test_a_view_that_moves_is_nearly_that_at_rest() -> None:
    renderer = FieldRenderer(ball())
    still, moving = (renderer.picture(Query(**{**vars(SMALL), "still": k})) for k in (1, 0))
    assert moving.shape == still.shape
    assert not np.array_equal(moving, still)
    assert (shown(moving) == shown(still)).mean() > 0.99


def test_a_lens_is_of_the_light_field(renderer: Renderer) -> None:
    query = Query(aperture=200, focus=10, width=64, height=48, still=1)
    view = query.camera(CAPTURE_MM)
    with_lens = FieldRenderer(ball(), renderer.tiles)
    expected = refocus(renderer.tiles, view, ThinLens(200, 10)).image
    assert np.array_equal(with_lens.picture(query), expected)
    with pytest.raises(InputError, match="aperture 200: a field alone has none"):
        FieldRenderer(ball()).picture(query)


@pytest.mark.parametrize("lens", [True, False])
def test_a_page_has_sliders_of_a_lens_where_there_is_one(renderer: Renderer, lens: bool) -> None:
    made = FieldRenderer(ball(), renderer.tiles if lens else None)
    with ViewServer(made, "ball", SMALL) as server:
        page = server.page.decode()
    assert (data_of(page)["method"], data_of(page)["lens"]) == ("field", lens)
    assert f"<title>ball: {'light field' if lens else 'field'}</title>" in page
    assert "{{" not in page


def test_a_turntable(tmp_path: Path) -> None:
    file = tmp_path / "ball.html"
    table = Turntable(4, (20.0,), 640.0, (160, 120), "depth")
    write_turntable(file, ball(), table, "ball", lambda _: None)
    frames = data_of(file.read_text(encoding="utf-8"))["frames"]
    assert isinstance(frames, list)
    image = np.asarray(Image.open(BytesIO(base64.b64decode(frames[0][1]))).convert("RGB"))
    camera = Query(azimuth=90, elevation=20, width=160, height=120).camera(CAPTURE_MM)
    assert np.abs(image.astype(float) - field_picture(ball(), camera).image).mean() < 3


def test_views_in_python() -> None:
    view = tbcad.view(ball(), 40, 20, size=(160, 120))
    assert np.array_equal(view.image, FieldRenderer(ball()).picture(SMALL))
    assert view.seen.all()
    assert tbcad.Views(ball()).view(40, 20, size=(160, 120))._repr_png_() == view._repr_png_()
    with pytest.raises(InputError, match="'depth' is for a light field"):
        tbcad.view(ball(), method="depth")

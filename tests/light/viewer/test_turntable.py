"""Turntables: one file, bounded, with the views that it says it has."""

import base64
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tbcad.errors import InputError
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.depth.plane_sweep import QUICK
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.viewer.page import Query
from tbcad.light.viewer.render import (
    BEGIN,
    KIND,
    WEBP_QUALITIES,
    Renderer,
    Turntable,
    smallest_loss,
    turntable_page,
    write_turntable,
)
from tests.light.viewer.fields import data_of

TABLE = Turntable(4, (20.0, 60.0), 640.0, (160, 120), "nearest")


def test_views_are_those_of_the_library(renderer: Renderer, tmp_path: Path) -> None:
    file, told = tmp_path / "knot.html", list[str]()
    size = write_turntable(file, renderer.tiles, TABLE, "knot", told.append)
    page = file.read_text(encoding="utf-8")
    assert size == file.stat().st_size
    assert page.startswith(BEGIN)
    assert len(told) == 2
    record = data_of(page)
    assert record["kind"] == KIND
    frames = record["frames"]
    assert isinstance(frames, list)
    assert [len(row) for row in frames] == [4, 4]
    shown = np.asarray(Image.open(BytesIO(base64.b64decode(frames[1][2]))).convert("RGB"))
    view = Query(azimuth=180, elevation=60, width=160, height=120).camera(renderer.capture_mm)
    image = synthesise(renderer.tiles, view, "nearest").image
    assert np.abs(shown.astype(float) - image).mean() < 4


def test_views_at_the_depth_that_is_found(renderer: Renderer, tmp_path: Path) -> None:
    table = Turntable(1, (40.0,), 640.0, (160, 120), "depth")
    write_turntable(tmp_path / "knot.html", renderer.tiles, table, "knot", lambda _: None)
    frames = data_of((tmp_path / "knot.html").read_text(encoding="utf-8"))["frames"]
    assert isinstance(frames, list)
    shown = np.asarray(Image.open(BytesIO(base64.b64decode(frames[0][0]))).convert("RGB"))
    view = Query(elevation=40, width=160, height=120).camera(renderer.capture_mm)
    expected = depth_views(renderer.tiles, QUICK).of(view)[0].image
    other = synthesise(renderer.tiles, view, "nearest").image
    differ = [np.abs(shown.astype(float) - image).mean() for image in (expected, other)]
    assert differ[0] < 4
    assert differ[0] < differ[1] - 0.5


def test_the_same_views_give_the_same_file(renderer: Renderer, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.html", "b.html")]
    for file in files:
        write_turntable(file, renderer.tiles, TABLE, "knot", lambda _: None)
    assert files[0].read_bytes() == files[1].read_bytes()


def test_pictures_lose_detail_until_they_fit() -> None:
    noise = np.random.default_rng(1).integers(0, 256, (1, 4, 120, 160, 3), dtype=np.uint8)
    pictures = [list(row) for row in noise]
    sizes = [len(turntable_page(pictures, TABLE, "knot", q).encode()) for q in WEBP_QUALITIES]
    assert sizes == sorted(sizes, reverse=True)
    for size in sizes:
        assert len(smallest_loss(pictures, TABLE, "knot", size)) == size
    with pytest.raises(InputError, match="4 x 1 views do not fit into"):
        smallest_loss(pictures, TABLE, "knot", sizes[-1] - 1)

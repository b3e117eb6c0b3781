"""The viewer and a turntable in Chromium: they draw, drags turn them, nobody else is asked."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run
from tbcad.light.viewer.page import Query
from tbcad.light.viewer.server import ViewServer
from tests.clients.browser import Browser
from tests.clients.viewer_page import (
    PICTURE_APERTURE_MM,
    PICTURE_PX,
    PIXELS,
    SLIDE,
    at_rest,
    save_picture,
    served,
)

pytestmark = [pytest.mark.clients, pytest.mark.slow]

MIDDLE = """(() => {
  const box = document.getElementById("canvas").getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
})()"""


@pytest.fixture(scope="module")
def server(captured: Path) -> Iterator[ViewServer]:
    with served(captured, Query(width=320, height=240)) as running:
        yield running


@pytest.fixture
def page(browser: Browser, server: ViewServer) -> Iterator[Browser]:
    """The viewer; in the end nothing was wrong and only the server was asked."""
    browser.events.clear()
    browser.open(server.address, 1000, 800)
    yield browser
    assert browser.faults == []
    assert all(url.startswith(server.address) for url in browser.requests)


def test_a_drag_moves_the_viewpoint(page: Browser) -> None:
    before = at_rest(page)
    page.drag(*page.value(MIDDLE), right=100, down=25)
    after = at_rest(page)
    assert before != after
    assert page.value("viewer.state.azimuth") == pytest.approx(-40)
    assert page.value("viewer.state.elevation") == pytest.approx(40)


def test_the_wheel_and_keys(page: Browser) -> None:
    before = at_rest(page)
    x, y = page.value(MIDDLE)
    page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=300)
    assert page.value("viewer.state.distance") > 640
    assert at_rest(page) != before
    page.value("canvas.focus()")
    page.press("ArrowRight")
    assert page.value("viewer.state.azimuth") == 5
    page.press("Home")
    assert at_rest(page) == before


def test_sliders_make_a_lens(page: Browser) -> None:
    pinhole = at_rest(page)
    assert page.value("document.getElementById('focus').disabled")
    page.value(SLIDE.format("aperture", 200))
    lens = at_rest(page)
    page.value(SLIDE.format("focus", 25))
    assert len({pinhole, lens, at_rest(page)}) == 3


def test_it_stays_above_the_horizon(page: Browser) -> None:
    page.drag(*page.value(MIDDLE), right=0, down=-300)
    at_rest(page)
    assert page.value("viewer.state.elevation") == 0


def test_turning_goes_on_until_it_is_stopped(page: Browser) -> None:
    at_rest(page)
    page.value("document.getElementById('turn').click()")
    shown = page.value("viewer.shown")
    time.sleep(1)
    assert page.value("viewer.shown") > shown + 2
    assert "views/s" in page.value("document.getElementById('rate').textContent")
    page.value("document.getElementById('turn').click()")
    at_rest(page)


def test_a_server_that_has_ended_is_told(page: Browser) -> None:
    at_rest(page)
    page.value("window.fetch = () => Promise.reject(new TypeError('no connection'))")
    page.value("move(5, 0)")
    told = page.value(
        "new Promise((done) => setTimeout(done, 100))"
        ".then(() => document.getElementById('problem').textContent)"
    )
    assert told.startswith("tbcad show has ended")


def test_the_picture_of_the_documentation(browser: Browser, captured: Path, tmp_path: Path) -> None:
    """Made as `python docs/screenshots.py` makes it: a lens at rest, seen from azimuth 35."""
    browser.events.clear()
    save_picture(browser, captured, tmp_path / "show.png")
    with Image.open(tmp_path / "show.png") as picture:
        assert picture.size == PICTURE_PX
        assert len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 500
    state = browser.value("viewer.last")
    assert (state["azimuth"], state["elevation"]) == (35.0, 40.0)
    assert state["aperture"] == PICTURE_APERTURE_MM
    assert browser.faults == []


def test_a_turntable_opens_from_disk_and_turns(
    browser: Browser, captured: Path, tmp_path: Path
) -> None:
    file = tmp_path / "knot.html"
    words = ["show", str(captured), "--turntable", str(file), "--frames", "12", "--rows", "2"]
    assert run([*words, "--width", "160", "--height", "120"]) == 0
    browser.events.clear()
    browser.open(file, 800, 700)
    before, values = browser.value(PIXELS)
    assert values > 50
    x, y = browser.value(MIDDLE)
    browser.drag(x, y, right=-48, down=0)
    assert browser.value("Math.round(table.column)") == 6
    turned = browser.value(PIXELS)[0]
    browser.drag(x, y, right=0, down=-200)
    assert browser.value("table.row") == 0
    assert len({before, turned, browser.value(PIXELS)[0]}) == 3
    browser.screenshot(tmp_path / "turntable.png")
    shown = np.asarray(Image.open(tmp_path / "turntable.png").convert("RGB"))
    assert len(np.unique(shown.reshape(-1, 3), axis=0)) > 500
    assert browser.faults == []
    assert browser.requests == [file.as_uri()]

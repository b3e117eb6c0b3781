"""The viewer and a turntable in Chromium: they draw, drags turn them, nobody else is asked."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tbcad.cli import run
from tbcad.simulate.capture.light_field import LightField
from tbcad.viewer.query import Query
from tbcad.viewer.render import Renderer
from tbcad.viewer.server import ViewServer
from tests.clients.browser import Browser

pytestmark = [pytest.mark.clients, pytest.mark.slow]

MIDDLE = """(() => {
  const box = document.getElementById("canvas").getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
})()"""
PIXELS = """(() => {
  const canvas = document.getElementById("canvas");
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
  copy.drawImage(canvas, 0, 0);
  const data = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  let sum = 0;
  for (let i = 0; i < data.length; i++) sum = (sum * 31 + data[i]) % 4294967296;
  return [sum, new Set(data).size];
})()"""
SHOWN_AT_REST = """viewer.last?.still === 1 && viewer.inFlight === 0
  && Math.abs(((viewer.last.azimuth - viewer.state.azimuth) % 360 + 540) % 360 - 180) < 1e-6
  && ["elevation", "distance", "aperture", "focus"].every(
    (name) => viewer.last[name] === viewer.state[name])"""
SLIDE = """(() => {{
  const slide = document.getElementById("{}");
  slide.value = {};
  slide.dispatchEvent(new Event("input"));
}})()"""


@pytest.fixture(scope="module")
def captured(record: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("captures") / "knot"
    assert run(["capture", str(record), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def server(captured: Path) -> Iterator[ViewServer]:
    with (
        LightField.open(captured) as source,
        ViewServer(Renderer(source), "knot", Query(width=320, height=240)) as running,
    ):
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield running
        running.shutdown()
        thread.join()


@pytest.fixture
def page(browser: Browser, server: ViewServer) -> Iterator[Browser]:
    """The viewer; in the end nothing was wrong and only the server was asked."""
    browser.events.clear()
    browser.open(server.address, 1000, 800)
    yield browser
    assert browser.faults == []
    assert all(url.startswith(server.address) for url in browser.requests)


def at_rest(page: Browser) -> int:
    """Sum of the pixels when the view that is wanted is shown."""
    started = time.monotonic()
    while not page.value(SHOWN_AT_REST):
        assert time.monotonic() - started < 60, page.value("JSON.stringify(viewer)")
        time.sleep(0.05)
    total, values = page.value(PIXELS)
    assert values > 50
    assert page.value("document.getElementById('problem').textContent") == ""
    return int(total)


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

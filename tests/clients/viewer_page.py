"""The page of `tbcad show` in a browser: what it is asked, and its picture in the documentation."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.viewer.page import Query
from tbcad.light.viewer.render import light_field_renderer
from tbcad.light.viewer.server import ViewServer
from tests.clients.browser import Browser

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
REST_S = 60.0
PICTURE_PX = 900, 740
PICTURE_VIEW = Query(azimuth=35.0, elevation=40.0)
PICTURE_APERTURE_MM = 120.0


@contextmanager
def served(captured: Path, start: Query) -> Iterator[ViewServer]:
    """The viewer's server of a capture, in this process."""
    with (
        LightField.open(captured) as source,
        ViewServer(light_field_renderer(MirrorTiles(source)), "knot", start) as server,
    ):
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def at_rest(page: Browser) -> int:
    """Sum of the pixels when the view that is wanted is shown."""
    started = time.monotonic()
    while not page.value(SHOWN_AT_REST):
        assert time.monotonic() - started < REST_S, page.value("JSON.stringify(viewer)")
        time.sleep(0.05)
    total, values = page.value(PIXELS)
    assert values > 50
    assert page.value("document.getElementById('problem').textContent") == ""
    return int(total)


def save_picture(browser: Browser, captured: Path, file: Path) -> None:
    """The page with a lens that is focused on the middle of the object, as a PNG file."""
    with served(captured, PICTURE_VIEW) as server:
        browser.open(server.address, *PICTURE_PX)
        at_rest(browser)
        browser.value(SLIDE.format("aperture", PICTURE_APERTURE_MM))
        at_rest(browser)
        browser.screenshot(file)

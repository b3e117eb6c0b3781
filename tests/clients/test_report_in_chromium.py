"""The report in Chromium: it draws, asks for nothing, says no error, follows clicks and keys."""

from collections.abc import Iterator
from pathlib import Path

import axe_core_python
import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run
from tests.clients.browser import Browser

pytestmark = [pytest.mark.clients, pytest.mark.slow]

SMALL = ("--set", "camera.width_px=416", "--set", "camera.height_px=310")
BALLS = (
    "--set",
    "prototype.largest_ball_mm=60",
    "--set",
    "prototype.grade=G40",
)  # else all are caps
AXE = Path(axe_core_python.__file__).parent / "axe.min.js"
LOADED = "document.readyState === 'complete' && document.body?.children.length > 0"
# What reaches beyond the window's right edge, but for drawings.
CUT = """[...document.querySelectorAll("body *")].filter((one) => {
  const box = one.getBoundingClientRect();
  return box.width && box.right > innerWidth + 1 && !one.closest("svg, canvas");
}).map((one) => one.outerHTML.slice(0, 80))"""
TEXT = "document.getElementById('{}').textContent"
# Middle of an element in the window, which is moved so that it is in sight.
MIDDLE = """(() => {{
  const one = document.querySelector("{}");
  one.scrollIntoView({{ block: "center" }});
  const box = one.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
}})()"""
# Where the canvas shows the apex of the first mirror whose inside is in sight, in the window.
MIRROR = """(() => {
  const { viewer, mirrors } = report, canvas = viewer.canvas, m = viewer.project();
  canvas.scrollIntoView({ block: "center" });
  const box = canvas.getBoundingClientRect();
  for (const mirror of mirrors) {
    const p = [...mirror.apex, 1];
    const q = [0, 1, 2, 3].map((i) => p.reduce((s, x, k) => s + x * m[4 * k + i], 0));
    const x = (q[0] / q[3] + 1) / 2 * box.width, y = (1 - q[1] / q[3]) / 2 * box.height;
    const met = viewer.pick(x, y), owner = met?.body.owner?.[met.triangle];
    if (owner === mirror.number % report.perCamera + 1 && mirror.camera === met.body.name.at(-1))
      return [box.x + x, box.y + y, mirror.name];
  }
})()"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small design with both parts, a capture, and a report with it."""
    folder = tmp_path_factory.mktemp("report") / "exports"
    assert run(["build", "--n", "6", *SMALL, "--out", str(folder), "--quiet"]) == 0
    capture = folder.parent / "capture"
    assert run(["capture", str(folder), "--out", str(capture)]) == 0
    page = folder.parent / "with_capture.html"
    assert run(["report", str(folder), "--capture", str(capture), "--out", str(page)]) == 0
    return folder


@pytest.fixture
def page(folder: Path, browser: Browser) -> Iterator[Browser]:
    """The page of a build; in the end nothing was wrong and nothing else was asked for."""
    browser.events.clear()
    browser.open(folder / "report.html")
    yield browser
    assert browser.faults == []
    assert browser.requests == [(folder / "report.html").as_uri()]


def colours(file: Path) -> int:
    return len(np.unique(np.asarray(Image.open(file).convert("RGB")).reshape(-1, 3), axis=0))


def test_it_draws(page: Browser, tmp_path: Path) -> None:
    assert "PASS" in page.value(TEXT.format("verdict"))
    assert page.value("document.getElementById('no3d').hidden")
    page.value(MIDDLE.format("#canvas"))
    page.screenshot(tmp_path / "report.png")
    assert colours(tmp_path / "report.png") > 1000


def test_a_click_on_the_map_shows_a_virtual_camera_and_its_rays(page: Browser) -> None:
    lines = page.value("report.viewer.lines.count")
    assert "No virtual camera is chosen" in page.value(TEXT.format("details"))
    page.click(*page.value(MIDDLE.format("circle[data-view='40']")))
    name = page.value("report.views[40].mirrors[0].name")
    assert f"Virtual camera {name}" in page.value(TEXT.format("chosen"))
    assert page.value("report.viewer.lines.count") > lines


def test_keys_go_from_one_virtual_camera_to_the_next(page: Browser) -> None:
    page.value("report.choose(0); document.querySelector('#hemisphere svg').focus()")
    page.press("ArrowRight")
    assert page.value("report.views[report.view].u[0]") > 0.05
    page.press("ArrowLeft")
    assert page.value("report.view") == 0


def test_a_click_on_a_mirror_of_the_model_chooses_it(page: Browser) -> None:
    x, y, name = page.value(MIRROR)
    page.click(x, y)
    assert name in page.value(TEXT.format("chosen"))


def test_rays_pass_the_object_as_the_mirror_sees_it(page: Browser) -> None:
    """Rays of the outline pass the middle by half the coverage or, between its points, more."""
    wanted = page.value("report.quantities.find(one => one.key === 'designed').values")
    for k in (3, 50, 100):
        distance = page.value(f"""(() => {{
          const mirror = report.views[{k}].mirrors[0];
          const pinhole = report.data.cameras.find((one) => one.id === mirror.camera).pinhole;
          return Math.min(...report.outline(mirror).map((point) =>
            length(nearestToObject(point, reflectedRay(mirror, pinhole, point)))));
        }})()""")
        assert wanted[k] - 0.01 < 2 * distance < wanted[k] + 3


def test_the_prototypes_ball_looks_as_its_mirror_does(page: Browser) -> None:
    """The base is turned so that the ball sends the object's light where the mirror does."""
    for k in (3, 50, 100):
        miss, error = page.value(f"""(() => {{
          const mirror = report.views[{k}].mirrors[0], ball = report.ballFor(mirror);
          const way = reflectedRay(ball, report.data.cameras[0].pinhole, ball.apex);
          const error = report.quantities.find((one) => one.key === "pointing").values[{k}];
          const cosine = Math.min(1, dot(unit(scaled(way, -1)), mirror.u));
          return [Math.acos(cosine) * 180 / Math.PI, error];
        }})()""")
        assert miss == pytest.approx(error, abs=0.3)


def test_parts_are_switched_and_taken_apart(page: Browser) -> None:
    page.value("[...document.querySelectorAll('#presets button')].at(-2).click()")
    shown = "report.viewer.bodies.filter((one) => one.shown).map((one) => one.group)"
    assert {"base", "frame"} <= set(page.value(shown))
    page.value("document.getElementById('group_frame').click()")
    assert "frame" not in page.value(shown)
    page.value("report.fit()")
    distance = page.value("report.viewer.distance")
    page.value("""{
      const slide = document.getElementById("explode");
      slide.value = 1;
      slide.dispatchEvent(new Event("input"));
    }""")
    assert page.value("report.viewer.distance") > distance


def test_dark_and_narrow(page: Browser, folder: Path) -> None:
    page.value("document.getElementById('theme').click()")
    assert page.value("document.documentElement.dataset.theme") == "dark"
    size = {"width": 360, "height": 740, "deviceScaleFactor": 1, "mobile": True}
    page.call("Emulation.setDeviceMetricsOverride", **size)
    assert page.value("document.documentElement.scrollWidth") <= 360


@pytest.mark.parametrize("name", ["report.html", "assembly.html"])
@pytest.mark.parametrize("width", [1280, 375])
def test_pages_are_accessible(browser: Browser, folder: Path, name: str, width: int) -> None:
    """By the rules of axe-core (WCAG 2.1 and good practice); nothing is cut at the right."""
    if name == "assembly.html" and not (folder.parent / name).is_file():
        assert run(["assembly", str(folder), "--out", str(folder.parent), "--no-pictures"]) == 0
    page = folder / name if name == "report.html" else folder.parent / name
    browser.open(page, width, 900, ready=LOADED)
    browser.value(AXE.read_text(encoding="utf-8"))
    faults = "one => one.id + ': ' + one.nodes.map((node) => node.html.slice(0, 80)).join(' ')"
    assert browser.value(f"axe.run().then((found) => found.violations.map({faults}))") == []
    assert browser.value(CUT) == []


def test_print_has_the_view_as_a_picture(page: Browser) -> None:
    page.value("dispatchEvent(new Event('beforeprint'))")
    assert page.value("document.querySelector('.printed').src").startswith("data:image/png")
    page.value("dispatchEvent(new Event('afterprint'))")
    assert page.value("document.querySelector('.printed')") is None


def test_photograph_of_a_mirror(browser: Browser, folder: Path) -> None:
    browser.events.clear()
    browser.open(folder.parent / "with_capture.html")
    browser.value("report.choose(30)")
    shown = browser.value("""new Promise((done) => setTimeout(() => {
      const canvas = document.querySelector("#details canvas");
      const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
      done(new Set(data).size);
    }, 500))""")
    assert shown > 20
    assert browser.faults == []

"""Write docs/pictures/show.png or report.png: pages in Chromium without a screen.

    tbcad capture exports/ --out captures/knot
    python docs/screenshots.py captures/knot       # the page of `tbcad show`
    python docs/screenshots.py --report exports/   # the report of a build

tests/clients/test_show_in_chromium.py makes the same picture of a smaller capture.
"""

import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"
sys.path.insert(0, str(ROOT))  # for the tests' browser

from tests.clients.browser import Browser, chromium  # noqa: E402
from tests.clients.viewer_page import save_picture  # noqa: E402

REPORT_PX, CHOSEN = (1500, 1540), 300  # the window; the virtual camera whose rays are shown


def save_report(browser: Browser, build: Path, file: Path) -> None:
    """The report of a build with the rays of a virtual camera, as a PNG file."""
    browser.open(build / "report.html", *REPORT_PX)
    browser.value(f"report.choose({CHOSEN})")
    browser.value("window.scrollTo(0, 0)")
    browser.screenshot(file)


def main(save: Callable[[Browser, Path, Path], None], folder: Path, name: str) -> None:
    """Save a picture."""
    program = shutil.which("chromium")
    if program is None:
        sys.exit("chromium is not installed: apt-get install chromium")
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        chromium(program, Path(profile)) as browser,
    ):
        save(browser, folder, PICTURES / name)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--report", build]:
            main(save_report, Path(build), "report.png")
        case [captured]:
            main(save_picture, Path(captured), "show.png")
        case _:
            sys.exit("usage: python docs/screenshots.py CAPTURE | --report BUILD")

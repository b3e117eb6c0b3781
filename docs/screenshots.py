"""Write docs/pictures/show.png: the page of `tbcad show`, in Chromium without a screen.

    tbcad capture exports/ --out captures/knot
    python docs/screenshots.py captures/knot

tests/clients/test_show_in_chromium.py makes the same picture of a smaller capture.
"""

import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"
sys.path.insert(0, str(ROOT))  # for the tests' browser

from tests.clients.browser import chromium  # noqa: E402
from tests.clients.viewer_page import save_picture  # noqa: E402


def main(captured: Path) -> None:
    """Save the pictures."""
    program = shutil.which("chromium")
    if program is None:
        sys.exit("chromium is not installed: apt-get install chromium")
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        chromium(program, Path(profile)) as browser,
    ):
        save_picture(browser, captured, PICTURES / "show.png")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python docs/screenshots.py CAPTURE")
    main(Path(sys.argv[1]))

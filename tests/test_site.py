"""The documentation as a site: built strictly, nothing fetched from elsewhere."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tbcad.records.design import DesignRecord

pytest.importorskip("mkdocs")
pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("site")
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(out)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return out


def test_no_page_asks_another_host_for_anything(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 30
    for page in pages:
        text = page.read_text("utf-8")
        assert not re.findall(r'<(?:script|img|iframe)[^>]*src="(?:https?:)?//', text), page
        assert not re.findall(r'<link[^>]*rel="stylesheet"[^>]*href="(?:https?:)?//', text), page


@pytest.mark.parametrize(
    ("page", "words"),
    [
        ("reference/commands.html", ["tbcad build", "--radius-rule", "tbcad study ssim"]),
        ("reference/keys.html", ["capture_diameter_mm", "prototype.base"]),
        ("reference/files.html", ["radius_mm", "rotation_plan.csv", "design.json.schema.json"]),
        ("reference/python.html", ["tbcad.LightField", "tbcad.load_spec"]),
    ],
)
def test_generated_pages_have_what_they_are_for(site: Path, page: str, words: list[str]) -> None:
    text = re.sub(r"<[^>]*>", "", (site / page).read_text("utf-8"))
    for one in words:
        assert one in text


def test_schemas_are_those_of_the_models(site: Path) -> None:
    written = json.loads((site / "reference" / "design.json.schema.json").read_text("utf-8"))
    assert written == DesignRecord.model_json_schema()

"""What is installed: the wheel, its contents and its metadata."""

import subprocess
import sys
import zipfile
from email.parser import Parser
from importlib.util import find_spec
from pathlib import Path

import pytest

from tbcad.version import __version__

ROOT = Path(__file__).parents[1]
PACKAGES = (ROOT / "tbcad", ROOT / "verify" / "tbcad_verify")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("pip") is None, reason="pip, which builds the wheel, is absent"),
]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    out = tmp_path_factory.mktemp("wheel")
    words = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(out), str(ROOT)]
    subprocess.run([sys.executable, *words], check=True, timeout=300)
    (file,) = out.iterdir()
    return zipfile.ZipFile(file)


def test_has_every_file_of_both_packages_the_designs_and_no_others(wheel: zipfile.ZipFile) -> None:
    expected = {
        str(file.relative_to(package.parent))
        for package in PACKAGES
        for file in package.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    } | {f"tbcad/{file.relative_to(ROOT)}" for file in (ROOT / "designs").iterdir()}
    found = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert found == expected


def test_metadata_is_complete(wheel: zipfile.ZipFile) -> None:
    (name,) = (name for name in wheel.namelist() if name.endswith("/METADATA"))
    found = Parser().parsestr(wheel.read(name).decode())
    assert (found["Name"], found["Version"]) == ("tbcad", __version__)
    assert found["Summary"]
    assert found["License-Expression"] == "MIT"
    assert found["Requires-Python"] == "<3.14,>=3.11"
    assert found["Description-Content-Type"] == "text/markdown"
    assert found.get_payload().startswith("# tbcad")
    assert len(found.get_all("Classifier")) > 5
    assert {"cadquery", "cluster", "machine"} <= set(found.get_all("Provides-Extra"))
    (scripts,) = (name for name in wheel.namelist() if name.endswith("/entry_points.txt"))
    assert "tbcad = tbcad.app.cli:main" in wheel.read(scripts).decode()

"""What several test files start or build once."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tests.clients.browser import Browser, chromium


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("chromium is not installed")
    with chromium(program, tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="session")
def prototype_build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small prototype of solid parts."""
    folder = tmp_path_factory.mktemp("prototype") / "build"
    words = ["build", "--parts", "prototype", "--no-verify", "--out", str(folder)]
    for key in ("optics.n=4", "prototype.k=3", "mesh.structure_error_mm=0.1", "printer.infill=1"):
        words += ["--set", key]
    assert run(words) == 0
    return folder

"""One small real export."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.core.camera.lists import LENS_COLUMNS
from tests.verify.corpus.copies import digests
from tests.verify.corpus.readings import remembered

SETTINGS = (
    "optics.n=4",
    "camera.hfov_deg=110",
    "camera.width_px=416",
    "camera.height_px=310",
    "mirrors.margin_mm=2",
    "mesh.ray_error_mm=0.3",
    "mesh.structure_error_mm=0.2",
)

# With every kind of part, LEDs too; a ball, caps, magnets.
PROTOTYPE_SETTINGS = (
    "optics.n=6",
    "camera.width_px=416",
    "camera.height_px=310",
    "mesh.structure_error_mm=0.03",
    "prototype.largest_ball_mm=60",
    f'prototype.catalogues=["{Path(__file__).parent / "large_balls.csv"}"]',
)


@pytest.fixture(autouse=True)
def meshes_alone() -> None:
    """Every part of a build has all its files."""


@contextmanager
def built(folder: Path, settings: Sequence[str], *words: str) -> Iterator[Path]:
    """A build that no test may write to."""
    options = [word for setting in settings for word in ("--set", setting)]
    assert run(["build", *words, *options, "--out", str(folder)]) == 0
    before = digests(folder)
    with remembered():
        yield folder
    assert digests(folder) == before, "a mutation wrote through a link"


@pytest.fixture(scope="session")
def good_prototype(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A small prototype as `tbcad build` writes it; tests break copies of it only."""
    folder = tmp_path_factory.mktemp("corpus") / "prototype"
    lenses = folder.parent / "lenses.csv"  # a lens wide enough for a camera of the list
    lenses.write_text(f"{','.join(LENS_COLUMNS)}\nwide,C,6,6,1.8,16,0.174,20,54,57,215,test\n")
    settings = (*PROTOTYPE_SETTINGS, f"prototype.frame.lenses={lenses}")
    with built(folder, settings, "--parts", "prototype", "--no-verify"):
        yield folder


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A small export as `tbcad build` writes and verifies it; tests break copies of it only."""
    folder = tmp_path_factory.mktemp("corpus") / "good"
    with built(folder, SETTINGS, "--parts", "shell"):
        yield folder

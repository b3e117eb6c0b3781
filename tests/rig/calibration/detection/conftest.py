"""A small run on disk, photographed once."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tbcad.rig.simulated_run.simulate import write_run
from tests.simulated_runs import Small, small_run

STOPS = range(8, 48, 6)
PHASES = ("dark", "led_1", "led_2", "led_3", "led_4")


@pytest.fixture(scope="session")
def small(export_folder: Path) -> Small:
    return small_run(export_folder, STOPS)


@pytest.fixture(scope="session")
def photographed(
    small: Small, export_folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    folder = tmp_path_factory.mktemp("run") / "run"
    write_run((small.run,), PHASES, export_folder, folder, lambda _: None)
    return folder


@pytest.fixture
def copied(photographed: Path, tmp_path: Path) -> Path:
    """A run that a test may damage."""
    return Path(shutil.copytree(photographed, tmp_path / "run"))


@pytest.fixture
def write(export_folder: Path, tmp_path: Path) -> Callable[[Small], Path]:
    """Photographs another run."""

    def written(other: Small) -> Path:
        write_run((other.run,), PHASES, export_folder, tmp_path / "run", lambda _: None)
        return tmp_path / "run"

    return written

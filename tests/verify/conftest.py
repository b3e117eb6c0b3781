"""One good synthetic export, made once; every test takes a copy and breaks it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tbcad_verify.shell.optics import OpticalSetup

from tests.verify.benches import bench_of
from tests.verify.synthetic_export import Cells, Design, export


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Cells]:
    return export(tmp_path_factory.mktemp("good") / "export", Design())


@pytest.fixture
def good(made: tuple[Path, Cells], tmp_path: Path) -> Path:
    return Path(shutil.copytree(made[0], tmp_path / "export"))


@pytest.fixture(scope="session")
def bench(made: tuple[Path, Cells]) -> OpticalSetup:
    return bench_of(made[0])

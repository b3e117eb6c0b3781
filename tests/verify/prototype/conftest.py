"""One good synthetic prototype, made once; tests take copies and break them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.verify.prototype.synthetic_prototype import Machine, export


@pytest.fixture(scope="session")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export(tmp_path_factory.mktemp("machine") / "export", Machine())


@pytest.fixture
def made(machine: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(machine, tmp_path / "export"))

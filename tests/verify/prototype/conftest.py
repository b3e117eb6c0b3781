"""One good synthetic prototype, made once; tests take copies and break them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.verify.prototype.synthetic_prototype import SyntheticPrototype, export


@pytest.fixture(scope="session")
def synthetic_prototype(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export(tmp_path_factory.mktemp("prototype") / "export", SyntheticPrototype())


@pytest.fixture
def prototype_folder(synthetic_prototype: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(synthetic_prototype, tmp_path / "export"))

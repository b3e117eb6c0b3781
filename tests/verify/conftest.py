"""One good synthetic export, made once; every test that breaks it takes a copy."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tbcad_verify.record.export import Export, read_export
from tbcad_verify.shell import integrity
from tbcad_verify.shell.optics import OpticalSetup

from tests.verify.optical_setups import optical_setup_of
from tests.verify.synthetic_export import Cells, Design, export

SAMPLE = Path(__file__).parents[2] / "docs" / "sample"


@pytest.fixture(autouse=True)
def meshes_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of synthetic exports have neither STEP nor 3MF; the corpus asks for all three."""
    monkeypatch.setattr(integrity, "KINDS", {"stl": ".stl"})


@pytest.fixture(scope="session")
def sample() -> Export:
    """The committed one, as tbcad wrote it."""
    return read_export(SAMPLE)


@pytest.fixture
def sample_folder(tmp_path: Path) -> Path:
    """A copy of the sample, for verifications in processes of their own."""
    return Path(shutil.copytree(SAMPLE, tmp_path / "sample"))


@pytest.fixture(scope="session")
def synthetic_shells(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Cells]:
    return export(tmp_path_factory.mktemp("good") / "export", Design())


@pytest.fixture
def export_folder(synthetic_shells: tuple[Path, Cells], tmp_path: Path) -> Path:
    """A copy, to be broken."""
    return Path(shutil.copytree(synthetic_shells[0], tmp_path / "export"))


@pytest.fixture(scope="session")
def exact_cells(synthetic_shells: tuple[Path, Cells]) -> Cells:
    """The cells that the export's shells were made from."""
    return synthetic_shells[1]


@pytest.fixture(scope="session")
def optical_setup(synthetic_shells: tuple[Path, Cells]) -> OpticalSetup:
    return optical_setup_of(synthetic_shells[0])

"""One good synthetic export, made once; every test takes a copy and breaks it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from synthetic_export import Cells, Design, export
from tbcad_verify.bench import Bench, pinhole_of, set_up
from tbcad_verify.files import read
from tbcad_verify.mesh import merge
from tbcad_verify.record import read_export
from tbcad_verify.recover import recover
from tbcad_verify.stl import parse


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Cells]:
    return export(tmp_path_factory.mktemp("good") / "export", Design())


@pytest.fixture
def good(made: tuple[Path, Cells], tmp_path: Path) -> Path:
    return Path(shutil.copytree(made[0], tmp_path / "export"))


@pytest.fixture(scope="session")
def bench(made: tuple[Path, Cells]) -> Bench:
    return bench_of(made[0])


def bench_of(folder: Path) -> Bench:
    record = read_export(folder)
    meshes = [merge(parse(read(record.folder, part.stl))) for part in record.parts]
    found = [
        recover(mesh, pinhole_of(record, part), record.target_mm / 2)
        for mesh, part in zip(meshes, record.parts, strict=True)
    ]
    return set_up(record, meshes, found)

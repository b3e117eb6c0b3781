"""One small capture, exported for each program."""

import json
from pathlib import Path
from typing import Any

import pytest

from tbcad.app.cli import run

TARGETS = ("nerfstudio", "colmap", "ngp-rays", "rays")


@pytest.fixture(scope="session")
def exported(captured: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The folder of each target."""
    parent = tmp_path_factory.mktemp("data")
    for target in TARGETS:
        assert run(["dataset", str(captured), "--to", target, "--out", str(parent / target)]) == 0
    return {target: parent / target for target in TARGETS}


@pytest.fixture(scope="session")
def transforms(exported: dict[str, Path]) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((exported["nerfstudio"] / "transforms.json").read_text())
    return document

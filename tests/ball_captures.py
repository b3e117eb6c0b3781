"""A very small capture of a ball, and of two frames of it."""

from pathlib import Path

import pytest
import trimesh

from tbcad.cli import run
from tbcad.mirrors.record import write_record
from tests.mirror_arrays import mirror_design

RADIUS_MM = 15.0


@pytest.fixture(scope="session")
def four(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the record of 98 mirrors and two cameras of few pixels."""
    folder = tmp_path_factory.mktemp("four")
    options = ["n=4", "camera.width_px=208", "camera.height_px=155"]
    write_record(folder, mirror_design(*options), shells=False)
    return folder


@pytest.fixture(scope="session")
def ball(four: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a capture; tests leave it as it is."""
    folder = tmp_path_factory.mktemp("ball")
    trimesh.creation.icosphere(3, RADIUS_MM).export(folder / "ball.ply")
    words = ["capture", str(four), "--object", str(folder / "ball.ply"), "--paint", "pattern"]
    assert run([*words, "--frames", "2", "--turn", "10", "--out", str(folder / "it")]) == 0
    return folder / "it"

"""A very small capture of a ball, and of two frames of it."""

from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from tbcad.app.cli import run
from tbcad.core.mirrors.record import write_record
from tbcad.light.reconstruction import fitted
from tbcad.light.reconstruction.fit import Trial
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.reconstruction.start import Settings
from tbcad.types import Bools, Progress
from tests.mirror_arrays import mirror_design

RADIUS_MM = 15.0


def without_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    """No trials, which take long: one is told of, and the settings stay as they are."""

    def unchanged(
        _: CapturedRays,
        __: Bools,
        settings: Settings,
        orders: tuple[int, ...],
        told: Progress,
        scheduler: str | None,
    ) -> tuple[Settings, list[Trial]]:
        told("trial 1")
        kept = replace(settings, order=orders[-1])
        return kept, [Trial(kept, 0.5)]

    monkeypatch.setattr(fitted, "chosen", unchanged)


@pytest.fixture(autouse=True)
def quick_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    """For all tests of a module that imports this."""
    without_trials(monkeypatch)


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

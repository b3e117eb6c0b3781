"""tbcad tolerance from the command line, on a small export with its prototype."""

import json
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path

import numpy as np
import pytest

from tbcad.app.cli import run
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.prototype.balls.layout import prototype_layout
from tests.app.cli.commands import Command
from tests.exported_files import contents, read_csv
from tests.prototype_exports import write_export, write_wind_up

SMALL = ["camera.width_px=208", "camera.height_px=155"]
FILES = {
    "tolerance-cameras.csv", "tolerance-builds.csv", "tolerance-notes.txt",
    "tolerance-processes.csv", "tolerance-sensitivity.csv", "tolerance-summary.csv",
    "tolerance.json", "tolerance.svg",
}  # fmt: skip
# Of ten machines in each step of a search, nine are to be good.
LOSS = itemgetter("loss_mm")
FEW = ["--builds", "20", "--yield", "0.9"]


@pytest.fixture(autouse=True, scope="module")
def _quick() -> Iterator[None]:
    """Fewer machines, pictures, viewpoints and processes."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {
            "analysis.SEARCH_BUILDS": 10,
            "analysis.PHOTOGRAPHED_BUILDS": 1,
            "montecarlo.sharpness.VIEWPOINTS": ((60.0,), 1, 640.0),
            "analysis.BUILT_IN": ("sla", "diamond"),
        }.items():
            patch.setattr(f"tbcad.tolerancing.{name}", value)
        yield


def exported(folder: Path, *options: str) -> MirrorDesign:
    """Write a record, as `tbcad build --parts shell` does."""
    made = design(load_spec(None, [*SMALL, *options]))
    write_record(folder, made, shells=False)
    return made


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record with its prototype."""
    folder = tmp_path_factory.mktemp("export")
    little = exported(folder, "n=6", "prototype.k=5")
    made = prototype_layout(little.spec, little)
    write_wind_up(folder, len(made.stops.angle))
    return write_export(folder, little, made)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record without a prototype."""
    folder = tmp_path_factory.mktemp("bare")
    exported(folder, "n=4")
    return folder


@pytest.fixture(scope="module")
def written(export: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tolerance") / "new" / "folder"
    assert run(["tolerance", str(export), *FEW, "--margins", "--out", str(out)]) == 0
    return out


@pytest.mark.slow
class TestWritten:
    def test_json_agrees_with_tables(self, written: Path) -> None:
        assert {path.name for path in written.iterdir()} == FILES
        read = json.loads((written / "tolerance.json").read_text())
        worst = np.array(
            [float(row["worst_coverage_mm"]) for row in read_csv(written / "tolerance-builds.csv")]
        )
        assert len(worst) == read["builds"] == 20
        assert read["yield"]["share"] == (worst >= 60).mean()
        assert read["worst_camera_mm"]["0.5"] == np.median(worst)
        losses = [float(row["loss_mm"]) for row in read_csv(written / "tolerance-sensitivity.csv")]
        assert losses == [*map(LOSS, read["single_errors"])]
        assert losses == sorted(losses, reverse=True)

    def test_what_is_known_of_the_figures(self, written: Path) -> None:
        """Closed forms, and what must be in order."""
        read = json.loads((written / "tolerance.json").read_text())
        alone = {one["kind"]: one for one in read["single_errors"]}
        assert len(alone) == 14
        assert not {"seat_um", "ball_radius_um", "rotation_angle_deg"} & set(alone)
        assert alone["facets_mm"]["loss_mm"] == pytest.approx(0.36, abs=1e-9)
        assert alone["facets_mm"]["tolerable_factor"] == pytest.approx(0.6 / 0.36, rel=0.02)
        assert alone["camera_tilt_mrad"]["tolerable_factor"] is None
        # Together they cost more than the worst of them, less than all after one another.
        lost, losses = 60.6 - read["worst_camera_mm"]["0.5"], [*map(LOSS, read["single_errors"])]
        assert losses[0] < lost < sum(losses)
        sla, diamond = read["processes"]
        assert (sla["process"], diamond["process"]) == ("sla", "diamond")
        assert sla["margin_needed_mm"] > diamond["margin_needed_mm"] > 0.36
        assert read["margin_needed_mm"] == sla["margin_needed_mm"]
        assert read["ssim"]["uncalibrated"] < read["ssim"]["calibrated"]

    def test_prototype_gains_by_calibration(self, written: Path) -> None:
        read = json.loads((written / "tolerance.json").read_text())["prototype"]
        plain, known = read["uncalibrated"], read["calibrated"]
        assert plain["worst_camera_mm"]["0.5"] < known["worst_camera_mm"]["0.5"] - 1
        assert known["pointing_mm"]["rms"] < 1e-6 < plain["pointing_mm"]["rms"]

    def test_words_are_shown_and_written(self, bare: Path, tmp_path: Path, cli: Command) -> None:
        out = tmp_path / "out"
        shown = cli("tolerance", bare, *FEW, "--out", out).out
        read = json.loads((out / "tolerance.json").read_text())
        assert " ".join(shown.split()).startswith(" ".join(read["summary"].split()))
        assert all(name in shown for name in FILES)
        assert read["prototype"] is None
        assert "Prototype" not in shown

    def test_same_bytes_whoever_works_and_nothing_else_is_touched(
        self, written: Path, export: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Again, with one thread instead of two."""
        before, mine = contents(written), written / "notes-of-mine.txt"
        mine.write_text("mine")
        monkeypatch.setattr("tbcad.common.schedule.cores", lambda: 1)
        assert run(["tolerance", str(export), *FEW, "--margins", "--out", str(written)]) == 0
        assert mine.read_text() == "mine"
        mine.unlink()
        assert contents(written) == before


def test_planar_mirrors_are_refused(tmp_path: Path, cli: Command) -> None:
    """They have no centre that pictures of made machines could take."""
    (folder := tmp_path / "flat").mkdir()
    exported(folder, "n=4", "radius_rule=flat")
    said = cli("tolerance", folder, *FEW, "--out", tmp_path / "out", code=2).err
    assert "planar mirrors, whose tolerances cannot" in said.splitlines()[-1]
    assert not (tmp_path / "out").exists()

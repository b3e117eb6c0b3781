"""What a calibration leaves unknown: coverage as calibrated, and truths within its covariance."""

import csv
from pathlib import Path

import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.rig.calibrated_solids import (
    as_built_tolerance,
    summary,
    tolerance_record,
    tolerance_table,
)
from tbcad.rig.machine.machine import Machine, write_machine
from tests.machine_states import frames_of, machine_of, perturbed


def calibrated(
    folder: Path, machine: Machine, plan: Plan, export: ExportedDesign, sigma_mm: float
) -> Path:
    folder.mkdir()
    write_machine(folder / "machine.json", machine, frames_of(plan))
    with (folder / "rays.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["mirror", "sigma_mm", "sigma_mrad", "pixel_mm"])
        for reflector in export.reflectors:
            for number in range(1, len(reflector) + 1):
                table.writerow([f"{reflector.camera_id}{number:04d}", sigma_mm, 0.3, 0.1])
    return folder


def test_a_designed_machine_covers_what_its_layout_says(
    export: ExportedDesign, plan: Plan, layout: PrototypeLayout, tmp_path: Path
) -> None:
    machine = machine_of(export, plan)
    calibration = calibrated(tmp_path / "known", machine, plan, export, 0.0)
    found = as_built_tolerance(calibration, export.folder, builds=3, seed=1)
    both = np.concatenate([layout.fit.coverage, layout.fit.coverage[np.argsort(layout.twin)]])
    assert found.coverage == pytest.approx(both, abs=2e-3)
    assert found.worst == pytest.approx(found.coverage.min())
    assert not found.absent


def test_unknown_rays_cost_coverage(export: ExportedDesign, plan: Plan, tmp_path: Path) -> None:
    machine = perturbed(machine_of(export, plan), seed=2)
    worst = {}
    for sigma in (0.01, 0.1):
        folder = calibrated(tmp_path / f"{sigma}", machine, plan, export, sigma)
        found = as_built_tolerance(folder, export.folder, builds=200, seed=1)
        again = as_built_tolerance(folder, export.folder, builds=200, seed=1)
        assert (found.worst == again.worst).all()
        worst[sigma] = float(np.median(found.coverage.min() - found.worst))
    # Some mirror is always near the minimum, and errors are at most some four deviations.
    assert 0 < worst[0.01] < 8 * 0.01
    assert worst[0.01] < worst[0.1] < 8 * 0.1


def test_table_record_and_words(export: ExportedDesign, plan: Plan, tmp_path: Path) -> None:
    calibration = calibrated(tmp_path / "c", machine_of(export, plan), plan, export, 0.02)
    found = as_built_tolerance(calibration, export.folder, builds=50, seed=4)
    assert len(tolerance_table(found).rows) == len(found.ids)
    record = tolerance_record(found, 50, 4)
    assert record["share_good"] == found.share
    assert record["place_mm_median"] == pytest.approx(0.02)
    assert f"{found.coverage.min():.2f} mm" in summary(found)
    rays = calibration / "rays.csv"
    lines = rays.read_text(encoding="utf-8").splitlines()
    rays.write_text("\n".join([lines[0], *lines[2:]]) + "\n", encoding="utf-8")
    few = as_built_tolerance(calibration, export.folder, builds=5, seed=1)
    assert few.absent == ("a0001",)
    assert "1 mirrors are not calibrated" in summary(few)
    rays.unlink()
    with pytest.raises(InputError, match=r"rays\.csv is not there"):
        as_built_tolerance(calibration, export.folder, builds=5, seed=1)

"""A calibrated machine as solids: where they are, how large, and what their colours say."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.app.api import as_built
from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import norm, unit
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.rig.calibrated_solids import (
    as_built_tolerance,
    colours,
    deviations,
    round_up,
    summary,
    tolerance_record,
)
from tbcad.rig.machine.machine import Machine, write_machine
from tests.exported_files import read_csv
from tests.machine_states import frames_of, machine_of, perturbed

CENTRE = re.compile(r"CARTESIAN_POINT\('',\(([^)]*)\) *\)")
SPHERE = re.compile(r"SPHERICAL_SURFACE\('',#\d+,([0-9.E+-]+)\)")


@pytest.fixture(scope="module")
def built(export: ExportedDesign, plan: Plan) -> Machine:
    return perturbed(machine_of(export, plan), seed=11)


@pytest.fixture(scope="module")
def written(
    export: ExportedDesign, plan: Plan, built: Machine, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    calibration = known(tmp_path_factory.mktemp("calibration") / "known", built, plan)
    out = tmp_path_factory.mktemp("as-built") / "asbuilt"
    as_built(calibration, export.folder, out=out)
    return out


def known(folder: Path, machine: Machine, plan: Plan) -> Path:
    """The folder of a calibration that found a machine."""
    folder.mkdir()
    write_machine(folder / "machine.json", machine, frames_of(plan))
    return folder


class TestFiles:
    def test_every_measured_sphere_is_in_the_step_file(self, written: Path, built: Machine) -> None:
        text = (written / "as_built.step").read_text(encoding="ascii").replace("\n", "")
        radii = {float(value) for value in SPHERE.findall(text)}
        for radius in built.radius.tolist():
            assert min(abs(radius - found) for found in radii) < 1e-9
        points = np.array(
            [[float(x) for x in found.split(",")] for found in CENTRE.findall(text) if found]
        )
        for centre in built.centre:
            assert norm(points - centre).min() < 1e-9
        for number in range(1, len(built.radius) + 1):
            assert f"'ball_{number}'" in text
        assert text.count("COLOUR_RGB") == len(built.radius)

    def test_table_and_record(self, written: Path, built: Machine) -> None:
        table = read_csv(written / "deviations.csv")
        record = json.loads((written / "as_built.json").read_text(encoding="utf-8"))
        distance = [float(row["distance_um"]) for row in table]
        assert [float(row["radius_mm"]) for row in table] == built.radius.tolist()
        assert record["largest_um"] == max(distance) <= record["scale_um"][1]
        assert record["scale_um"][1] == round_up(max(distance))
        shown = [int(row["colour"][1:3], 16) / 255 for row in table]
        expected = colours(np.array(distance) / record["scale_um"][1])[:, 0]
        assert shown == pytest.approx(expected.tolist(), abs=0.5 / 255)

    def test_same_bytes_again(
        self, written: Path, export: ExportedDesign, plan: Plan, built: Machine, tmp_path: Path
    ) -> None:
        as_built(known(tmp_path / "known", built, plan), export.folder, out=tmp_path / "again")
        for name in ("as_built.step", "deviations.csv", "legend.png"):
            assert (tmp_path / "again" / name).read_bytes() == (written / name).read_bytes()


class TestDeviations:
    def test_what_moves_all_balls_alike_is_no_deviation(
        self, export: ExportedDesign, plan: Plan
    ) -> None:
        machine = machine_of(export, plan)
        axis, shift = unit(np.array([1.0, 2.0, -1.0])), np.array([0.3, -0.1, 0.2])
        moved = rotated(machine.centre, axis, np.full(len(plan), 0.01)) + shift
        found = deviations(replace(machine, centre=moved), plan)
        assert found.distance_um.max() < 1e-6
        assert found.turn == pytest.approx(0.01 * axis)
        assert found.shift == pytest.approx(shift)

    def test_one_ball_that_is_off(self, export: ExportedDesign, plan: Plan) -> None:
        machine = machine_of(export, plan)
        centre = machine.centre.copy()
        centre[2] += np.array([0.0, 0.0, 0.1])
        found = deviations(replace(machine, centre=centre), plan)
        assert found.distance_um.argmax() == 2
        # The others draw the base's fit toward it a little.
        assert 0 < found.distance_um[2] <= 100

    @pytest.mark.parametrize(
        ("value", "expected"), [(0.0, 1), (1.0, 1), (3.0, 5), (50.0, 50), (51.0, 100), (640, 1000)]
    )
    def test_ends_of_scales(self, value: float, expected: float) -> None:
        assert round_up(value) == expected


def test_another_number_of_balls_is_refused(
    export: ExportedDesign, plan: Plan, built: Machine, tmp_path: Path
) -> None:
    few = replace(built, centre=built.centre[1:], radius=built.radius[1:])
    few = replace(few, sag=None, seat_turn=None)
    with pytest.raises(InputError, match=r"has 4 balls, .* has 5"):
        as_built(known(tmp_path / "known", few, plan), export.folder, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


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
    coverage = found.mirrors.numbers("coverage_mm")
    assert coverage == pytest.approx(both, abs=2e-3)
    assert found.worst == pytest.approx(coverage.min())
    assert not found.absent


def test_unknown_rays_cost_coverage(export: ExportedDesign, plan: Plan, tmp_path: Path) -> None:
    """Twice the largest of m errors in a plane: its median in closed form (J. W. Rayleigh)."""
    sigma = 1e4  # mm: beside it all mirrors cover alike
    folder = calibrated(tmp_path / "c", machine_of(export, plan), plan, export, sigma)
    found, again = (as_built_tolerance(folder, export.folder, builds=200, seed=1) for _ in "ab")
    assert (found.worst == again.worst).all()
    largest = sigma * np.sqrt(-np.log(1 - 0.5 ** (1 / len(found.mirrors.rows))))
    assert np.median(-found.worst) == pytest.approx(2 * largest, rel=0.05)


def test_table_record_and_words(export: ExportedDesign, plan: Plan, tmp_path: Path) -> None:
    calibration = calibrated(tmp_path / "c", machine_of(export, plan), plan, export, 0.02)
    found = as_built_tolerance(calibration, export.folder, builds=50, seed=4)
    record = tolerance_record(found, 50, 4)
    assert record["share_good"] == found.share
    assert record["place_mm_median"] == pytest.approx(0.02)
    assert f"{found.mirrors.numbers('coverage_mm').min():.2f} mm" in summary(found)
    rays = calibration / "rays.csv"
    lines = rays.read_text(encoding="utf-8").splitlines()
    rays.write_text("\n".join([lines[0], *lines[2:]]) + "\n", encoding="utf-8")
    few = as_built_tolerance(calibration, export.folder, builds=5, seed=1)
    assert few.absent == ("a0001",)
    assert "1 mirrors are not calibrated" in summary(few)
    rays.unlink()
    with pytest.raises(InputError, match=r"rays\.csv is not there"):
        as_built_tolerance(calibration, export.folder, builds=5, seed=1)

"""A calibrated machine as solids: where they are, how large, and what their colours say."""

import json
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from shutil import which

import numpy as np
import pytest

from tbcad.app.api import as_built
from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import norm, unit
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.calibrated_solids import colours, deviations, round_up
from tbcad.rig.machine.machine import Machine, write_machine
from tests.exported_files import read_csv
from tests.machine_states import frames_of, machine_of, perturbed

CENTRE = re.compile(r"CARTESIAN_POINT\('',\(([^)]*)\)\)")
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

    @pytest.mark.clients
    def test_freecad_opens_it(self, written: Path, built: Machine) -> None:
        command = which("freecadcmd") or which("FreeCADCmd")
        if command is None:
            pytest.skip("freecadcmd is not installed")
        script = written.parent / "look.py"
        script.write_text(
            f"import Part\nshape = Part.read({str(written / 'as_built.step')!r})\n"
            "print('SOLIDS', len(shape.Solids), shape.isValid())\n",
            encoding="utf-8",
        )
        shown = subprocess.run(
            [command, str(script)], capture_output=True, encoding="utf-8", check=False, timeout=600
        ).stdout
        assert f"SOLIDS {len(built.radius)} True" in shown


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
    with pytest.raises(InputError, match=r"has 4 balls, .* has 5"):
        as_built(known(tmp_path / "known", few, plan), export.folder, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()

"""sag.csv says what was worked out, or is refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.formats.checked_files import write_table
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.prototype.gravity.sag import PARTS, Sag, read_sag
from tbcad.records.tables import BallRow, SagRow
from tests.prototype_exports import write_stops


@pytest.fixture
def folder(export_folder: Path, tmp_path: Path) -> Path:
    """An export of the prototype's tables, without sag.csv."""
    return Path(shutil.copytree(export_folder, tmp_path / "export"))


def written(folder: Path, plan: Plan) -> Sag:
    """The sag of a plan's balls in a folder of its prototype, by random displacements."""
    shape, random = (len(plan.angle), len(plan), 3), np.random.default_rng(1)
    of = {part: random.standard_normal(shape) for part in PARTS}
    made = Sag(
        plan.angle, plan.body_centre @ plan.frame.T, plan.frame, of, random.standard_normal(shape)
    )
    write_stops(folder, np.degrees(plan.angle).tolist(), [0.0] * len(plan.angle))
    write_table(folder / SagRow.FILE, SagRow.columns(), list(made.rows()))
    return made


def test_displacements_are_read_as_they_were_written(folder: Path, plan: Plan) -> None:
    made, found = written(folder, plan), read_sag(folder)
    assert found is not None
    for part in PARTS:
        assert found.of[part] == pytest.approx(made.of[part], abs=1e-12)
    assert found.seat_turn == pytest.approx(made.seat_turn, abs=1e-12)
    assert found.centre == pytest.approx(made.centre, abs=1e-9)


def test_a_build_without_the_file_has_no_sag(folder: Path) -> None:
    assert read_sag(folder) is None


def test_rows_of_another_prototype_are_refused(folder: Path, plan: Plan) -> None:
    written(folder, plan)
    path = folder / SagRow.FILE
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    balls = len(BallRow.read(folder))
    with pytest.raises(
        InputError, match=f"row for each of {len(plan.angle)} stops and {balls} balls"
    ):
        read_sag(folder)

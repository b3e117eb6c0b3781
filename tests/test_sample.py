"""The committed sample export: proved, and what the present code would write."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.proof import verify

from tbcad.design.mirrors import design
from tbcad.design.spec import load_spec
from tbcad.export.tables import COLUMNS, rows

ROOT = Path(__file__).parents[1]
SAMPLE = ROOT / "docs" / "sample"


def test_sample_is_proved(tmp_path: Path) -> None:
    copy = tmp_path / "sample"
    shutil.copytree(SAMPLE, copy)
    assert verify(copy).passed
    assert (copy / "verify.json").read_bytes() == (SAMPLE / "verify.json").read_bytes()


def test_sample_is_of_this_design_and_code() -> None:
    made = design(load_spec(ROOT / "designs" / "mukaigawa-flat.toml"))
    expected = [row for half in made.halves for row in rows(half)]
    with (SAMPLE / "mirrors.csv").open(newline="") as file:
        found = list(csv.DictReader(file))
    assert [row["id"] for row in found] == [row["id"] for row in expected]
    for name in COLUMNS[2:]:
        numbers = [np.nan if row[name] == "" else float(row[name]) for row in found]
        wanted = [np.nan if row[name] is None else row[name] for row in expected]
        assert numbers == pytest.approx(wanted, abs=1e-9, nan_ok=True), name

"""The committed sample export: proved, and what the present code would write."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.run.verify import verify

from tbcad.mirrors.array import design
from tbcad.mirrors.record import COLUMNS, rows
from tbcad.spec.load import load_spec

ROOT = Path(__file__).parents[1]
SAMPLE = ROOT / "docs" / "sample"


def test_sample_is_proved(tmp_path: Path) -> None:
    copy = tmp_path / "sample"
    shutil.copytree(SAMPLE, copy)
    assert verify(copy).passed
    found, kept = (json.loads((place / "verify.json").read_text()) for place in (copy, SAMPLE))
    assert kept["pass"] is True
    assert [row["id"] for row in found["mirrors"]] == [row["id"] for row in kept["mirrors"]]
    for name in ("coverage_facet_mm", "coverage_fitted_mm"):
        values = [row[name] for row in kept["mirrors"]]
        assert [row[name] for row in found["mirrors"]] == pytest.approx(values, abs=1e-3)


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

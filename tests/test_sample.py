"""The committed sample export is verified, and is what the present code writes."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.run.verify import verify

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.mirrors.record import COLUMNS, design_record, mirror_rows
from tbcad.core.spec.load import load_spec
from tests.exported_files import read_csv

pytestmark = pytest.mark.usefixtures("standing")

ROOT = Path(__file__).parents[1]
SAMPLE = ROOT / "docs" / "sample"


@pytest.fixture(scope="module")
def flat_design() -> MirrorDesign:
    """As docs/export.md says that the sample was built."""
    return design(load_spec(Path("mukaigawa-flat"), ["mesh.structure_error_mm=0.2"]))


def test_sample_is_verified(tmp_path: Path) -> None:
    copy = tmp_path / "sample"
    shutil.copytree(SAMPLE, copy)
    assert verify(copy).passed
    report, committed = (
        json.loads((folder / "verify.json").read_text()) for folder in (copy, SAMPLE)
    )
    assert committed["pass"] is True
    assert [row["id"] for row in report["mirrors"]] == [row["id"] for row in committed["mirrors"]]
    for name in ("coverage_facet_mm", "coverage_fitted_mm"):
        values = [row[name] for row in committed["mirrors"]]
        assert [row[name] for row in report["mirrors"]] == pytest.approx(values, abs=1e-3)


def test_sample_has_the_mirrors_of_this_design_and_code(flat_design: MirrorDesign) -> None:
    expected = [row for array in flat_design.arrays for row in mirror_rows(array)]
    recorded = read_csv(SAMPLE / "mirrors.csv")
    assert [row["id"] for row in recorded] == [row["id"] for row in expected]
    for name in COLUMNS[2:]:
        numbers = [float(row[name] or "nan") for row in recorded]
        values = [np.nan if row[name] is None else row[name] for row in expected]
        assert numbers == pytest.approx(values, abs=1e-9, nan_ok=True), name


def test_sample_has_the_record_of_this_design_and_code(flat_design: MirrorDesign) -> None:
    recorded = json.loads((SAMPLE / "design.json").read_text())
    expected = design_record(flat_design, shells=True).document()
    assert recorded.keys() == expected.keys()
    for key in ("schema", "spec", "parts", "mirrors"):
        assert recorded[key] == expected[key], key

"""Halves end in the planes of seam and foot: what sticks out, or stops short, is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.mesh.stl import read_facets
from tbcad_verify.record.export import Export, read_export
from tbcad_verify.report.checks import Check
from tbcad_verify.shell.integrity import mesh_ends_checks
from tbcad_verify.shell.measured_shell import measure_shells

from tests.verify.synthetic_export import FOOT, facets_of, mirrored, stl

X, Z = 0, 2
STEP_OF_FLOAT32 = 1.6e-5  # mm, of coordinates between 128 and 256


def tipped(facets: np.ndarray, axis: int, way: float) -> np.ndarray:
    """One corner of the plane x = 0 or z = foot moved along its axis, mm; the others stay."""
    plane = np.float32(FOOT if axis == Z else 0.0)
    corners = facets.reshape(-1, 3)
    tip = corners[np.flatnonzero(corners[:, axis] == plane)[0]].copy()
    facets = facets.copy()
    facets[(facets == tip).all(axis=2), axis] += np.float32(way)
    return facets


def ends(record: Export) -> dict[str, Check]:
    """The check of each half's mesh, by its file; the second may be known by the first."""
    stls = [read_facets(record.folder, part.stl)[0] for part in record.parts]
    shells = measure_shells(record, stls)
    every = [mesh_ends_checks(record, one.part, one.mass, one.reason) for one in shells]
    return {check.file: check for (check,) in every}


def test_halves_end_in_both_planes(export_folder: Path) -> None:
    checks = ends(read_export(export_folder))
    assert [check.passed for check in checks.values()] == [True, True]
    assert all((check.limit or 1) < STEP_OF_FLOAT32 for check in checks.values())


@pytest.mark.parametrize(
    ("axis", "way", "said"),
    [
        (Z, -0.16, "0.16 mm beyond the foot"),
        (Z, -2e-4, "0.0002 mm beyond the foot"),
        (X, -0.05, "0.05 mm beyond the seam"),
    ],
)
@pytest.mark.parametrize("image", [True, False], ids=["mirror image", "one half"])
def test_a_tip_is_told(export_folder: Path, axis: int, way: float, said: str, image: bool) -> None:
    broken = tipped(facets_of(export_folder / "shell_a.stl"), axis, way)
    (export_folder / "shell_a.stl").write_bytes(stl(broken))
    if image:
        (export_folder / "shell_b.stl").write_bytes(stl(mirrored(broken)))
    one, other = ends(read_export(export_folder)).values()
    assert one.passed is False
    assert one.measured == pytest.approx(abs(way), abs=STEP_OF_FLOAT32)
    assert said in one.detail
    assert other.passed is not image
    assert not image or ("shell_b" in other.detail and said in other.detail)


@pytest.mark.parametrize(("axis", "said"), [(Z, "short of the foot"), (X, "short of the seam")])
def test_a_half_that_stops_short_is_refused(export_folder: Path, axis: int, said: str) -> None:
    record = read_export(export_folder)
    facets = facets_of(export_folder / "shell_a.stl")
    facets[:, :, axis] += np.float32(0.02)
    (export_folder / "shell_a.stl").write_bytes(stl(facets))
    assert f"0.02 mm {said}" in ends(record)["shell_a.stl"].detail


def test_parts_that_are_no_halves_may_be_anywhere(export_folder: Path) -> None:
    record = read_export(export_folder)
    stand = record.parts[0].model_copy(update={"camera": ""})
    assert mesh_ends_checks(record, stand, None, "not measured") == []
    (check,) = mesh_ends_checks(record, record.parts[0], None, "not measured")
    assert (check.passed, check.detail) == (None, "not measured")

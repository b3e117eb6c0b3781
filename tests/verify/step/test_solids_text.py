"""Solids read from STEP text: holes of shapes whose sizes are known, and a shell's casing."""

from __future__ import annotations

import numpy as np
import pytest
from tbcad_verify.record.export import Export
from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.solids_text import Casing, RoundFace, holes, read_casing, read_solids, wall


@pytest.fixture(scope="module")
def text(sample: Export) -> str:
    return (sample.folder / "shell_a.step").read_text()


@pytest.fixture(scope="module")
def casing(sample: Export, text: str) -> Casing:
    return read_casing(StepTable(text), frozenset(sample.mirrors.ids))


def test_a_solid_has_its_product_name_and_corners(text: str) -> None:
    found = read_solids(text)
    assert list(found) == ["shell_a"]
    corners = found["shell_a"].corners
    assert (np.lexsort(corners.T[::-1]) == np.arange(len(corners))).all()
    assert corners[:, 0].min() == pytest.approx(0, abs=1e-9)


def test_holes_are_those_of_the_design(sample: Export, text: str) -> None:
    faces, shell = read_solids(text)["shell_a"].faces, sample.spec.shell
    for diameter, count in (
        (shell.seam_flange.bolt_hole_mm, shell.seam_flange.bolts + shell.foot_flange.bolts),
        (shell.seam_flange.dowel_hole_mm, shell.seam_flange.dowels + shell.foot_flange.dowels),
    ):
        found = holes(faces, diameter / 2, 1e-6)
        assert len(found) == count
        assert {round(hole.depth, 6) for hole in found} == {shell.seam_flange.thickness_mm}
        assert {round(hole.radius, 6) for hole in found} == {diameter / 2}
    assert holes(faces, 1.0, 1e-6) == []


def test_the_wall_is_the_design_s(casing: Casing, sample: Export) -> None:
    measured = wall(casing, sample.cameras["a"], sample.semi_minor_mm)
    assert measured == pytest.approx(sample.spec.shell.wall_mm, abs=1e-5)
    with pytest.raises(Unknown, match="another spheroid"):
        wall(casing, sample.cameras["b"], sample.semi_minor_mm)
    with pytest.raises(Unknown, match="another spheroid"):
        wall(casing, sample.cameras["a"], sample.semi_minor_mm + 0.01)


def test_what_is_no_shell_is_unknown(text: str) -> None:
    with pytest.raises(Unknown, match="0 surfaces of revolution"):
        read_casing(StepTable(text.replace("SURFACE_OF_REVOLUTION", "PLANE")), frozenset())
    with pytest.raises(Unknown, match="allowed is no such entity"):
        read_solids(text.replace("PRODUCT(", "PRODUCTS("))


@pytest.mark.parametrize(
    ("claimed", "allowed"), [("2.E-06", True), ("1.E-05", False), ("12345.E-07", False)]
)
def test_what_a_file_claims_to_be_true_to(text: str, claimed: str, allowed: bool) -> None:
    """A carrier of n = 60 says 2 nm; nothing may say more than gaps may be."""
    vague = text.replace("LENGTH_MEASURE(1.E-06)", f"LENGTH_MEASURE({claimed})")
    assert vague != text
    if allowed:
        assert list(read_solids(vague)) == ["shell_a"]
    else:
        with pytest.raises(Unknown, match="UNCERTAINTY_MEASURE_WITH_UNIT"):
            read_solids(vague)


def test_faces_of_one_hole_are_counted_once_and_of_two_twice() -> None:
    """Half shells of one bore, and a second bore on the same axis beyond a gap."""

    def face(low: float, high: float, sign: float = 1.0, hollow: bool = True) -> RoundFace:
        point, axis = np.array([1.0, 2.0, 5.0]), np.array([0.0, 0.0, sign])
        span = (low, high) if sign > 0 else (-high, -low)
        return RoundFace("cylinder", point, axis, 2.0, hollow, span)

    one = holes((face(0, 3), face(0, 3, -1.0)), 2.0, 1e-6)
    assert [(hole.depth, hole.point.tolist()) for hole in one] == [(3, [1, 2, 6.5])]
    assert [hole.depth for hole in holes((face(0, 3), face(2, 4)), 2.0, 1e-6)] == [4]
    assert [hole.depth for hole in holes((face(5, 9), face(0, 3)), 2.0, 1e-6)] == [3, 4]
    assert holes((face(0, 3, hollow=False),), 2.0, 1e-6) == []

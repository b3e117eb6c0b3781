"""Holes of flanges: where they belong, in closed form on a sphere, and what counts as a fault."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.record.export import Export, read_export
from tbcad_verify.record.flange_holes import Flange, Hole, HoleLimits, flanges, hole_faults
from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.solids_text import bores, read_casing

SAMPLE = Path(__file__).parents[3] / "docs" / "sample"
LIMITS = HoleLimits(size=1e-6, place=1e-3)
BEYOND_MM, FOOT_MM = 11.0, -10.0


@pytest.fixture(scope="module")
def sample() -> Export:
    return replace(read_export(SAMPLE), foot_z_mm=FOOT_MM)


@pytest.fixture(scope="module")
def wanted(sample: Export) -> tuple[Flange, Flange]:
    return flanges(sample, sample.cameras["a"], BEYOND_MM)


def holes(*some: Flange) -> list[Hole]:
    """The very holes that flanges should have."""
    return [
        Hole(middle, -np.eye(3)[flange.axis], diameter / 2, flange.thickness)
        for flange in some
        for middle, diameter in zip(flange.middle, flange.diameter.tolist(), strict=True)
    ]


@pytest.mark.parametrize("side", [1, -1])
def test_on_a_sphere_holes_are_at_even_angles(sample: Export, side: int) -> None:
    """Both foci at the origin: every section is a circle."""
    shell = sample.spec.shell
    near = sample.cameras["a"].model_copy(update={"pinhole": 1e-12 * np.array([side, 0, -1])})
    for flange, spec, at, least, end in zip(
        flanges(sample, near, BEYOND_MM),
        (shell.seam_flange, shell.foot_flange),
        (5.0, FOOT_MM),
        (FOOT_MM + 5, 5 + shell.seam_flange.width_mm / 2),
        (shell.seam_flange.width_mm, shell.foot_flange.width_mm / 2),
        strict=True,
    ):
        radius = np.sqrt((100 + BEYOND_MM + spec.width_mm / 2) ** 2 - at**2)
        last = np.arccos(least / radius) - end / radius
        angle = np.linspace(-last, last, spec.bolts + spec.dowels)
        up, y = radius * np.cos(angle), radius * np.sin(angle)
        if flange.name == "seam":
            expected = np.column_stack([np.full(len(y), side * 2.5), y, up])
        else:
            expected = np.column_stack([side * up, y, np.full(len(y), FOOT_MM + 2.5)])
        assert flange.middle == pytest.approx(expected, abs=1e-5)


def test_dowels_are_next_to_the_ends(wanted: tuple[Flange, Flange]) -> None:
    seam, foot = wanted
    assert seam.diameter.tolist() == [4.3, 4, 4.3, 4.3, 4.3, 4.3, 4, 4.3]
    assert foot.diameter.tolist() == [4.3, 4, 4.3, 4.3, 4.3, 4, 4.3]


@pytest.mark.parametrize("half", ["a", "b"])
def test_holes_of_a_build_are_where_they_belong(half: str) -> None:
    """The build divides exact ellipses by their own angle."""
    export = read_export(SAMPLE)
    table = StepTable((SAMPLE / f"shell_{half}.step").read_text())
    mirrors = frozenset(export.mirrors.ids)
    casing, found = read_casing(table, mirrors), bores(table, mirrors)
    camera, beyond = export.cameras[half], casing.semi_axes[1] - export.semi_minor_mm
    assert hole_faults(found, flanges(export, camera, beyond), LIMITS) == []
    other = {"a": "b", "b": "a"}[half]
    assert hole_faults(found, flanges(export, export.cameras[other], beyond), LIMITS)
    assert hole_faults(found, flanges(export, camera, beyond + 0.01), LIMITS)
    lower = replace(export, foot_z_mm=export.foot_z_mm - 0.01)
    assert hole_faults(found, flanges(lower, camera, beyond), LIMITS)


def test_a_back_that_reaches_no_flange_is_unknown(sample: Export) -> None:
    shell = sample.spec.shell
    seam = shell.seam_flange.model_copy(update={"thickness_mm": 1000.0})
    thick = shell.model_copy(update={"seam_flange": seam})
    for other in (
        replace(sample, foot_z_mm=-1000.0),
        replace(sample, foot_z_mm=1000.0),
        replace(sample, spec=sample.spec.model_copy(update={"shell": thick})),
    ):
        with pytest.raises(Unknown, match="does not reach"):
            flanges(other, sample.cameras["a"], BEYOND_MM)


def test_right_holes_have_no_faults(wanted: tuple[Flange, Flange]) -> None:
    assert hole_faults(holes(*wanted), wanted, LIMITS) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"radius": 2.15 + 1e-6}, ["4 holes of 4.3 mm, not 5", "1 holes of 4.3 mm, not 0"]),
        ({"depth": 5.001}, ["a hole 5.001 mm deep, not 5"]),
        ({"depth": 4.999}, ["a hole 4.999 mm deep, not 5"]),
        ({"radius": 2.0}, ["3 holes of 4 mm, not 2", "from its place"]),
        ({"radius": 2.15 + 4e-7}, []),
    ],
)
def test_another_hole_is_a_fault(
    wanted: tuple[Flange, Flange], change: dict[str, float], said: list[str]
) -> None:
    *rest, last = holes(*wanted)
    faults = hole_faults([*rest, replace(last, **change)], wanted, LIMITS)
    assert bool(faults) == bool(said)
    assert all(fault.startswith("foot flange: ") for fault in faults)
    for words in said:
        assert any(words in fault for fault in faults)


@pytest.mark.parametrize(("way", "wrong"), [(1.1e-3, True), (0.9e-3, False)])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_hole_elsewhere_is_a_fault(
    wanted: tuple[Flange, Flange], axis: int, way: float, wrong: bool
) -> None:
    *rest, last = holes(*wanted)
    moved = replace(last, point=last.point + way * np.eye(3)[axis])
    faults = hole_faults([*rest, moved], wanted, LIMITS)
    assert faults == (["foot flange: a hole of 4.3 mm is 0.0011 mm from its place"] * wrong)


def test_holes_too_few_and_too_many(wanted: tuple[Flange, Flange]) -> None:
    first, *rest = holes(*wanted)
    assert hole_faults(rest, wanted, LIMITS) == ["seam flange: 5 holes of 4.3 mm, not 6"]
    twice = hole_faults([first, first, *rest], wanted, LIMITS)
    assert twice == ["seam flange: 7 holes of 4.3 mm, not 6"]
    assert len(hole_faults([], wanted, LIMITS)) == 4


def test_a_hole_in_no_flange_is_a_fault(wanted: tuple[Flange, Flange]) -> None:
    lean = np.array([2e-3, 0, 1.0])
    for axis in ([0.0, 1.0, 0.0], lean / np.linalg.norm(lean)):
        extra = Hole(np.zeros(3), np.array(axis), 2.0, 5.0)
        faults = hole_faults([*holes(*wanted), extra], wanted, LIMITS)
        assert faults == ["a hole of 4 mm in no flange"]

"""Shells on pedestals: grooves as the spec has them, cells between the walls in the file."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tbcad_verify.record.export import read_export
from tbcad_verify.run.processes import Processes
from tbcad_verify.run.verify import verify
from tbcad_verify.step.front_checks import SURFACE_MM, FrontComparison, compare
from tbcad_verify.step.pedestals import wall_errors
from tbcad_verify.step.recorded_checks import area_checks
from tbcad_verify.step.sphere_union import bounds
from tbcad_verify.step.step_file import read_step_files
from tbcad_verify.types import Floats

from tbcad.output.build import write_export
from tests.pedestal_designs import pedestal_design

pytestmark = pytest.mark.usefixtures("standing")

COARSE = "mesh.structure_error_mm=0.5"
SETTINGS = [
    ["n=12", "coating_um=100"],  # some borders are shorter than the groove
    ["n=5", "shell.groove_mm=0.6"],
    ["n=4", "radius_rule=flat"],
    ["n=5", "camera_mm=[120, 15, -90]"],
]


def compared(folder: Path, camera: str = "a") -> FrontComparison:
    export = read_export(folder)
    (part,) = (part for part in export.parts if part.camera == camera)
    with Processes(1) as processes:
        file = read_step_files(replace(export, parts=(part,)), processes)[part.name]
    return compare(export, part, file)


@pytest.fixture(scope="module")
def shells(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pedestals")
    write_export(pedestal_design("n=3", COARSE), folder, ["shell"])
    return folder


@pytest.fixture(scope="module")
def shell(shells: Path) -> FrontComparison:
    return compared(shells)


def errors(shell: FrontComparison, widths: float = 1.0, **changes: Any) -> Floats:
    """Of the walls, with changes to what was read, and another width of grooves."""
    assert shell.grooves
    grooves, camera = replace(shell.grooves, **changes), shell.camera
    planes = bounds(float(np.sign(camera.pinhole[0])), shell.export.foot_z_mm)
    width = widths * shell.export.spec.shell.groove_mm
    return wall_errors(grooves, shell.mirrors.surfaces(), camera.pinhole, planes, width)


@pytest.mark.slow
def test_shells_are_verified(shells: Path) -> None:
    checks = verify(shells).checks
    assert all(check.passed for check in checks)
    walls = {check.file for check in checks if check.name == "step walls"}
    assert walls == {"shell_a.step", "shell_b.step"}


@pytest.mark.slow
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_grooves_of_other_designs(settings: list[str], tmp_path: Path) -> None:
    write_export(pedestal_design(COARSE, *settings), tmp_path, ["shell"])
    found = {camera: compared(tmp_path, camera) for camera in "ab"}
    assert max(errors(one).max() for one in found.values()) < SURFACE_MM
    (areas,) = area_checks(found["a"].export, {key: one.grooves for key, one in found.items()})
    assert areas.passed, areas


def test_a_wall_off_its_place_is_found(shell: FrontComparison) -> None:
    """Planes, bottoms and the spec's width: each changes the errors by as much as it is off."""
    assert shell.grooves
    assert errors(shell).max() < SURFACE_MM
    one, off = np.eye(len(shell.grooves.names))[3], 1e-6
    moved = shell.grooves.point + off * one * shell.grooves.normal
    assert np.flatnonzero(errors(shell, point=moved) > off / 2).tolist() == [3]
    turned = shell.grooves.normal + off * one * np.array([[0.6], [0.0], [0.8]])
    assert np.flatnonzero(errors(shell, normal=turned) > off / 10).tolist() == [3]
    assert (errors(shell, 1 + off) > off / 10).all()
    loose = shell.grooves.bottom.copy()
    loose[0] = np.nan
    assert 0 < np.isinf(errors(shell, bottom=loose)).sum() < len(one)


def test_areas_hold_where_walls_are(shell: FrontComparison) -> None:
    """The record's areas are those between the walls of the files, both."""
    other = compared(shell.export.folder, "b")
    assert shell.grooves
    found = {"a": shell.grooves, "b": other.grooves}
    assert area_checks(shell.export, found)[0].passed
    moved = shell.grooves.point + 1e-4 * shell.grooves.normal
    found["a"] = replace(shell.grooves, point=moved)
    assert area_checks(shell.export, found)[0].passed is False


@pytest.mark.slow
def test_a_wall_with_the_name_of_another_is_found(shells: Path) -> None:
    step = shells / "shell_a.step"
    text = step.read_text()
    one, two = re.findall(r"'(a\d{4}_a\d{4})'", text)[:2]
    swapped = text.replace(f"'{one}'", "'?'").replace(f"'{two}'", f"'{one}'")
    step.write_text(swapped.replace("'?'", f"'{two}'"))
    try:
        failed = {check.name for check in verify(shells).checks if check.passed is False}
        assert "step walls" in failed
    finally:
        step.write_text(text)

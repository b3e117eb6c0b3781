"""PrusaSlicer's time for the coupons of the paper's design: one print of an afternoon."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import trimesh
from tbcad_verify.programs import prusa
from tbcad_verify.programs.program_query import Sandbox
from tbcad_verify.run.child import Limits

import tbcad
from tbcad.mirrors.array import design
from tbcad.prototype.arrangement import arrange
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.coupon_seat import expected_downs, worst_pose
from tbcad.prototype.printing.placing import PrintedPart, part_mesh

pytestmark = [pytest.mark.clients, pytest.mark.slow]

LIMIT_H = 4.0  # a third of the 12 h that the coupons of all sizes took
FILAMENT_MM3 = 68.0 / 1.27e-3  # a third of their 203 g
ON_THE_PLATE = ("--support-material-buildplate-only",)


def test_the_coupons_take_a_third_of_what_they_took(tmp_path: Path) -> None:
    if shutil.which("prusa-slicer") is None:
        pytest.skip("prusa-slicer is not installed")
    arranged = arrange(design(tbcad.load_spec(None)))
    base, split, printer = arranged.base, arranged.split, arranged.spec.printer
    pose = worst_pose(base, split, expected_downs(base, split))
    hours = filament = 0.0
    for plate in coupon_plates(base, printer, pose, 0.02):
        mesh = part_mesh(PrintedPart(plate, "tool", "coupon"))
        file = tmp_path / f"{plate.name}.stl"
        trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(file)
        length, time = _sliced(tmp_path, file)
        hours, filament = hours + time, filament + length
    assert 1.0 < hours <= LIMIT_H
    assert prusa._volume(filament) <= FILAMENT_MM3


def _sliced(folder: Path, file: Path) -> tuple[float, float]:
    sandbox = Sandbox(prusa.find(), folder, file, file.name, Limits())
    return prusa._sliced(sandbox, (*prusa.PRINT_PROFILE, *ON_THE_PLATE))

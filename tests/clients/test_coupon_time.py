"""PrusaSlicer's time for the coupons of the paper's design: one print of an afternoon."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import trimesh

import tbcad
from tbcad.core.mirrors.array import design
from tbcad.prototype.arrangement import arrange
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.coupon_seats import expected_downs, worst_pose
from tbcad.prototype.printed import PrintedPart, part_mesh

pytestmark = [pytest.mark.clients, pytest.mark.slow]

LIMIT_H = 4.5  # an afternoon; coupons of all sizes took 12 h, bars too thin to print 4.0
FILAMENT_MM3 = 68.0 / 1.27e-3  # a third of the 203 g that coupons of all sizes took
FILAMENT_MM = 1.75
HOURS = {"d": 24.0, "h": 1.0, "m": 1 / 60, "s": 1 / 3600}
PROFILE = (
    *("--bed-shape", "0x0,1000x0,1000x1000,0x1000", "--skirts", "0"),
    *("--filament-diameter", str(FILAMENT_MM), "--nozzle-diameter", "0.4"),
    *("--layer-height", "0.2", "--first-layer-height", "0.2", "--perimeters", "4"),
    *("--top-solid-layers", "5", "--bottom-solid-layers", "5"),
    *("--fill-density", "25%", "--fill-pattern", "gyroid"),
    *("--support-material", "--support-material-threshold", "40"),
    "--support-material-buildplate-only",
)


def test_the_coupons_take_an_afternoon(tmp_path: Path) -> None:
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
        volume, time = _sliced(tmp_path, file)
        hours, filament = hours + time, filament + volume
    assert 1.0 < hours <= LIMIT_H
    assert 0 < filament <= FILAMENT_MM3


def _sliced(folder: Path, file: Path) -> tuple[float, float]:
    """Volume of filament, mm^3, and time, h, that PrusaSlicer says of a print."""
    code = folder / f"{file.stem}.gcode"
    words = ["prusa-slicer", "--datadir", folder / "home", "--export-gcode", *PROFILE]
    subprocess.run([*words, "--output", code, file], check=True, capture_output=True)
    text = code.read_text(encoding="utf-8")
    length = re.search(r"filament used \[mm\] = ([\d.]+)", text)
    printed = re.search(r"estimated printing time \(normal mode\) = (.*)", text)
    assert length is not None
    assert printed is not None
    spans = re.findall(r"(\d+)([dhms])", printed[1])
    volume = float(length[1]) * math.pi / 4 * FILAMENT_MM**2
    return volume, sum(int(count) * HOURS[unit] for count, unit in spans)

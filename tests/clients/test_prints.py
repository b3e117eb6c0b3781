"""PrusaSlicer on printed parts: supports off the pads, an afternoon of coupons, estimates."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh

import tbcad
from tbcad.cad.formats.mesh_files import write_stl
from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.mirrors.array import design
from tbcad.prototype import slicing
from tbcad.prototype.arrangement import arrange
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.coupon_seats import expected_downs, worst_pose
from tbcad.prototype.printed import PrintedPart, part_mesh
from tbcad.prototype.slicing import print_estimate

pytestmark = [
    *(pytest.mark.clients, pytest.mark.slow),
    pytest.mark.skipif(not shutil.which("prusa-slicer"), reason="prusa-slicer is not installed"),
]

LIMIT_H = 4.5  # an afternoon; coupons of all sizes took 12 h, bars too thin to print 4.0
FILAMENT_MM3 = 68.0 / 1.27e-3  # a third of the 203 g that coupons of all sizes took
FILAMENT_MM = 1.75
HOURS = {"d": 24.0, "h": 1.0, "m": 1 / 60, "s": 1 / 3600}

BED_MIDDLE = 200.0
# docs/assembly.md: layers of 0.2 mm, supports below slopes of 40 degrees, on the build plate only.
SETTINGS = (
    *("--nozzle-diameter", "0.4", "--skirts", "0"),
    *("--layer-height", "0.2", "--first-layer-height", "0.2"),
    *("--support-material", "--support-material-threshold", "40"),
    "--support-material-buildplate-only",
)
CARRIER = "--bed-shape", "0x0,400x0,400x400,0x400", "--fill-density", "10%"
COUPON = (
    *("--bed-shape", "0x0,1000x0,1000x1000,0x1000", "--filament-diameter", str(FILAMENT_MM)),
    *("--perimeters", "4", "--top-solid-layers", "5", "--bottom-solid-layers", "5"),
    *("--fill-density", "25%", "--fill-pattern", "gyroid"),
)
BED = "--bed-shape", "0x0,400x0,400x400,0x400"
NEAR_MM = (0.0, 1.0)  # in front of a pad
BESIDE_MM = 0.3  # its edge
STEP_MM = 0.5


def sliced(file: Path, *settings: str) -> str:
    """What PrusaSlicer makes of a mesh."""
    home, code = file.parent / "home", file.with_suffix(".gcode")
    words = ["prusa-slicer", "--datadir", home, "-g", *SETTINGS, *settings, "--output", code, file]
    subprocess.run(words, check=True, capture_output=True)
    return code.read_text(encoding="utf-8")


def supports(code: str) -> Iterator[np.ndarray]:
    """Points along the extruded lines of support, mm about the middle of the bed."""
    kind, place = "", np.zeros(3)
    for line in code.splitlines():
        if line.startswith(";TYPE:"):
            kind = line[6:]
        elif line.startswith("G1 "):
            words = dict(re.findall(r"([XYZE])(-?[\d.]+)", line))
            before = dict(zip("XYZ", place, strict=True))
            after = np.array([float(words.get(axis, before[axis])) for axis in "XYZ"])
            if kind.startswith("Support") and float(words.get("E", 0)) > 0:
                count = max(int(np.linalg.norm(after - place) / STEP_MM), 2)
                yield np.linspace(place, after, count) - [BED_MIDDLE, BED_MIDDLE, 0.0]
            place = after


def test_supports_on_the_build_plate_touch_no_pad(prototype_build: Path) -> None:
    record = json.loads((prototype_build / "prototype.json").read_text())
    part = next(one for one in record["parts"] if one["name"] == "carrier")
    lines = list(supports(sliced(prototype_build / "carrier.stl", *CARRIER)))
    assert lines
    points = np.concatenate(lines)
    for seat in record["seats"]:
        normals = np.array(seat["normals"]) @ part["axes"]
        contacts = np.array(seat["contacts_mm"]) @ part["axes"] + part["origin_mm"]
        for contact, normal in zip(contacts, normals, strict=True):
            height = (points - contact) @ normal
            beside = np.linalg.norm(points - contact - np.outer(height, normal), axis=1)
            near = (height > NEAR_MM[0]) & (height < NEAR_MM[1])
            assert not (near & (beside < seat["pad_diameter_mm"] / 2 + BESIDE_MM)).any()


def print_of(code: str) -> tuple[float, float]:
    """Filament, mm^3, and hours of a print by PrusaSlicer."""
    length = re.search(r"filament used \[mm\] = ([\d.]+)", code)
    printed = re.search(r"estimated printing time \(normal mode\) = (.*)", code)
    assert length is not None
    assert printed is not None
    spans = re.findall(r"(\d+)([dhms])", printed[1])
    hours = sum(int(count) * HOURS[unit] for count, unit in spans)
    return float(length[1]) * math.pi / 4 * FILAMENT_MM**2, hours


def test_the_coupons_take_an_afternoon(tmp_path: Path) -> None:
    arranged = arrange(design(tbcad.load_spec(None)))
    base, split, printer = arranged.base, arranged.split, arranged.spec.printer
    pose = worst_pose(base, split, expected_downs(base, split))
    hours = filament = 0.0
    for plate in coupon_plates(base, printer, pose, 0.02):
        file = tmp_path / f"{plate.name}.stl"
        write_stl(file, part_mesh(PrintedPart(plate, "tool", "coupon")))
        volume, duration = print_of(sliced(file, *COUPON))
        filament, hours = filament + volume, hours + duration
    assert 1.0 < hours <= LIMIT_H
    assert 0 < filament <= FILAMENT_MM3


@pytest.mark.parametrize("nozzle", [0.4, 0.6])
@pytest.mark.parametrize("name", ["camera_plate", "home_bracket", "bearing_head", "stage_crown"])
def test_estimates_are_within_15_percent(prototype_build: Path, name: str, nozzle: float) -> None:
    file = prototype_build / f"{name}.stl"
    settings = Path(slicing.__file__).parent / "slicer" / f"nozzle_{nozzle:g}.ini"
    code = file.with_name(f"{name}_{nozzle:g}.gcode")
    words = ["prusa-slicer", "--datadir", file.parent / "home", "-g", "--load", settings, *BED]
    subprocess.run([*words, "--output", code, file], check=True, capture_output=True)
    whole = trimesh.load_mesh(file)
    mesh = Mesh(np.asarray(whole.vertices, dtype=float), np.asarray(whole.faces))
    estimated = print_estimate(mesh, 0.25, nozzle)
    assert estimated == pytest.approx(print_of(code.read_text(encoding="utf-8")), rel=0.15)

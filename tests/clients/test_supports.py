"""PrusaSlicer's own supports stay off the pads when they stand on the build plate only."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tbcad.app.cli import run

pytestmark = [pytest.mark.clients, pytest.mark.slow]

SMALL = ("optics.n=4", "prototype.k=3", "mesh.structure_error_mm=0.1")
BED_MIDDLE = 200.0
# docs/assembly.md: layers of 0.2 mm, supports below slopes of 40 degrees.
SETTINGS = (
    *("--bed-shape", "0x0,400x0,400x400,0x400", "--nozzle-diameter", "0.4", "--skirts", "0"),
    *("--layer-height", "0.2", "--first-layer-height", "0.2", "--fill-density", "10%"),
    *("--support-material", "--support-material-threshold", "40"),
)
NEAR_MM = (0.0, 1.0)  # in front of a pad
BESIDE_MM = 0.3  # its edge
STEP_MM = 0.5


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("prusa-slicer") is None:
        pytest.skip("prusa-slicer is not installed")
    folder = tmp_path_factory.mktemp("supports") / "export"
    options = [word for key in SMALL for word in ("--set", key)]
    words = ["build", "--parts", "prototype", "--no-verify", *options, "--out", str(folder)]
    assert run(words) == 0
    return folder


def supports(code: Path) -> Iterator[np.ndarray]:
    """Points along the extruded lines of support, mm about the middle of the bed."""
    kind, place = "", np.zeros(3)
    for line in code.read_text(encoding="utf-8").splitlines():
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


def touched_pads(folder: Path, *settings: str) -> tuple[int, int]:
    """Pads with support in front of them, and lines of support."""
    code = folder / "carrier.gcode"
    home = ("--datadir", str(folder / "home"))
    words = ["prusa-slicer", *home, "-g", *SETTINGS, *settings, "--output", str(code)]
    subprocess.run([*words, str(folder / "carrier.stl")], check=True, capture_output=True)
    record = json.loads((folder / "prototype.json").read_text())
    part = next(one for one in record["parts"] if one["name"] == "carrier")
    lines = list(supports(code))
    points, touched = np.concatenate(lines), 0
    for seat in record["seats"]:
        normals = np.array(seat["normals"]) @ part["axes"]
        contacts = np.array(seat["contacts_mm"]) @ part["axes"] + part["origin_mm"]
        for contact, normal in zip(contacts, normals, strict=True):
            height = (points - contact) @ normal
            beside = np.linalg.norm(points - contact - np.outer(height, normal), axis=1)
            near = (height > NEAR_MM[0]) & (height < NEAR_MM[1])
            touched += bool((near & (beside < seat["pad_diameter_mm"] / 2 + BESIDE_MM)).any())
    return touched, len(lines)


def test_supports_on_the_build_plate_touch_no_pad(export: Path) -> None:
    touched, lines = touched_pads(export, "--support-material-buildplate-only")
    assert lines > 0
    assert touched == 0

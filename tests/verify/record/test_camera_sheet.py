"""camera.json is verified from mirrors and cameras by rays, not by formulas of images."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tbcad_verify.errors import BadExport
from tbcad_verify.record.camera_sheet import image_depths, sheet_check
from tbcad_verify.record.export import Export, read_export

from tbcad.camera.requirements import camera_requirements
from tbcad.camera.sheet import CAMERA_FILE, write_camera_sheet
from tbcad.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.mirrors.record import write_record
from tbcad.output.manifest import write_manifest
from tbcad.spec.load import load_spec

NAME = ("camera sheet", CAMERA_FILE, "wrong figures")
OPTIONS = [
    ["n=5"],
    ["n=4", "radius_rule=flat"],
    ["n=4", "camera_mm=[100, 20, -110]", "capture_diameter_mm=40"],
]


def written(folder: Path, mirrors: MirrorDesign) -> Export:
    folder.mkdir()
    write_camera_sheet(folder, mirrors.arrays[0], mirrors.spec.optics.capture_diameter_mm / 2)
    write_record(folder, mirrors, shells=True)
    write_manifest(folder, "build")
    return read_export(folder)


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Export:
    return written(tmp_path_factory.mktemp("sheet") / "x", design(load_spec(None, ["n=5"])))


@pytest.mark.parametrize("options", OPTIONS)
def test_a_build_is_right(tmp_path: Path, options: list[str]) -> None:
    assert sheet_check(NAME, written(tmp_path / "x", design(load_spec(None, options)))).passed


def test_images_by_rays_are_those_of_coddingtons_equations(
    tmp_path: Path, paper_design: MirrorDesign, paper_array: MirrorArray
) -> None:
    export, needed = written(tmp_path / "x", paper_design), camera_requirements(paper_array, 30.0)
    depths = image_depths(export, export.cameras["a"])
    assert depths.near == pytest.approx(needed.near_mm, rel=1e-6)
    assert depths.far == pytest.approx(needed.far_mm, rel=1e-6)


@pytest.mark.parametrize(
    "change",
    [
        lambda sheet: sheet.update(near_mm=sheet["near_mm"] * 1.001),
        lambda sheet: sheet.update(far_mm=sheet["far_mm"] - 0.1),
        lambda sheet: sheet.update(focus_mm=sheet["focus_mm"] + 0.1),
        lambda sheet: sheet.update(pupil_mm=sheet["pupil_mm"] * 1.01),
        lambda sheet: sheet.update(total_px=sheet["total_px"] / 2),
        lambda sheet: sheet.update(width_px=sheet["width_px"] - 1),
        lambda sheet: sheet.update(hfov_deg=sheet["hfov_deg"] - 10),
        lambda sheet: sheet.update(vfov_deg=sheet["vfov_deg"] + 60),
    ],
)
def test_another_figure_is_a_fault(
    export: Export, tmp_path: Path, change: Callable[[dict[str, Any]], None]
) -> None:
    shutil.copytree(export.folder, folder := tmp_path / "x")
    sheet = json.loads((folder / CAMERA_FILE).read_text())
    change(sheet["requirements"])
    (folder / CAMERA_FILE).write_text(json.dumps(sheet))
    check = sheet_check(NAME, replace(export, folder=folder))
    assert check.passed is False
    assert check.detail


def test_a_missing_sheet_is_bad(export: Export, tmp_path: Path) -> None:
    with pytest.raises(BadExport, match=r"camera\.json: missing"):
        sheet_check(NAME, replace(export, folder=tmp_path))

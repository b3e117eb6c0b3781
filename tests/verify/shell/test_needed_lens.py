"""Virtual images by rays are those of the builder's closed forms, and so is the lens they need."""

from pathlib import Path

import pytest
from tbcad_verify.record.export import read_export

from tbcad.core.camera.requirements import camera_requirements
from tbcad.core.mirrors.array import design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.output.manifest import write_manifest
from tests.verify.shell.rays_of_images import image_depths, needed_lens


@pytest.mark.parametrize(
    "options",
    [
        ["n=5"],
        ["n=4", "radius_rule=flat"],
        ["n=4", "camera_mm=[100, 20, -110]", "capture_diameter_mm=40"],
    ],
)
def test_the_builder_asks_for_the_lens_that_rays_need(tmp_path: Path, options: list[str]) -> None:
    mirrors = design(load_spec(None, options))
    write_record(tmp_path, mirrors, shells=True)
    write_manifest(tmp_path, "build")
    export = read_export(tmp_path)
    asked = camera_requirements(mirrors.arrays[0], mirrors.spec.optics.capture_diameter_mm / 2)
    camera = export.cameras["a"]
    depths, lens = image_depths(export, camera), needed_lens(export, camera)
    assert depths == pytest.approx((asked.near_mm, asked.far_mm), rel=1e-5)
    assert (lens.focus, lens.pupil) == pytest.approx((asked.focus_mm, asked.pupil_mm), rel=1e-4)

"""Mirror images of STEP files, written as text and read by the kernel."""

import re
from pathlib import Path

import pytest

from tbcad.cad.formats.step import write_step
from tbcad.cad.formats.step_mirror import NoMirrorImageError, mirrored_step
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.checks import properties
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.shell.files import camera_solid
from tests.helpers import read_step

NUMBER = re.compile(r"-?\d+\.\d*(?:E[-+]\d+)?")


@pytest.fixture(scope="module")
def solid(small_design: MirrorDesign) -> Solid:
    return camera_solid(small_design, small_design.arrays[0])


@pytest.fixture(scope="module")
def text(solid: Solid, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("original") / "solid.step"
    write_step(path, solid)
    return path.read_text()


def test_the_solid_is_reflected(text: str, solid: Solid, tmp_path: Path) -> None:
    (tmp_path / "image.step").write_text(mirrored_step(text, {"a0001": "b0001"}))
    found, original = read_step(tmp_path / "image.step"), properties(solid.shape)
    image = properties(found.shape)
    assert image.volume == pytest.approx(original.volume, rel=1e-7)
    assert image.area == pytest.approx(original.area, rel=1e-7)
    x, y, z = original.centroid
    assert image.centroid == pytest.approx((-x, y, z), abs=1e-5)


def test_twice_mirrored_is_the_original(text: str) -> None:
    once = mirrored_step(text, {"a0001": "b0001"})
    twice = mirrored_step(once, {"b0001": "a0001"})
    assert "'b0001'" in once
    assert "'a0001'" not in once
    assert NUMBER.sub("", twice) == NUMBER.sub("", text)
    assert [float(x) for x in NUMBER.findall(twice)] == [float(x) for x in NUMBER.findall(text)]
    assert once != text


def test_geometry_without_a_rule_is_refused(text: str) -> None:
    with pytest.raises(NoMirrorImageError, match="no rule for the mirror image of OFFSET_SURFACE"):
        mirrored_step(text.replace("PLANE(", "OFFSET_SURFACE("), {})

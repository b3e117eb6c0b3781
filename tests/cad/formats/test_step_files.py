"""prototype.step has the tree of solids that cadquery makes of them."""

import re
from pathlib import Path

import cadquery
import numpy as np
import pytest
from cadquery.occ_impl.assembly import toCAF
from OCP.Interface import Interface_Static
from OCP.TDocStd import TDocStd_Document

from tbcad.cad.formats import assembly
from tbcad.cad.formats.assembly import ColouredSolid, SolidGroup, write_assembly
from tbcad.cad.formats.step import write_step
from tbcad.cad.formats.step_mirror import NoMirrorImageError, mirrored_step
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.checks import properties
from tbcad.cad.kernel.solids import sphere
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.shell.files import camera_solid
from tests.helpers import read_step

GREY, CLEAR = (0.5, 0.5, 0.5, 1.0), (0.1, 0.2, 0.3, 0.4)
NUMBER = re.compile(r"-?\d+\.\d*(?:E[-+]\d+)?")


def balls() -> tuple[ColouredSolid, ...]:
    return tuple(
        ColouredSolid(f"ball_{k}", sphere(np.array([10.0 * k, 0, 0]), 3.0 + k), GREY)
        for k in range(3)
    )


def view() -> ColouredSolid:
    return ColouredSolid("view", sphere(np.zeros(3), 30.0), CLEAR)


def by_cadquery(name: str, groups: tuple[SolidGroup, ...]) -> TDocStd_Document:
    tree = cadquery.Assembly(name=name)
    for group in groups:
        branch = cadquery.Assembly(name=group.name)
        for body in group.bodies:
            branch.add(cadquery.Shape.cast(body.shape), name=body.name)
        tree.add(branch)
    return toCAF(tree, True)[1]


def test_the_same_bytes_as_by_cadquery(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    groups = SolidGroup("balls", balls()), SolidGroup("views", (view(),))
    write_assembly(tmp_path / "ours.step", "prototype", groups)
    monkeypatch.setattr(assembly, "_document", by_cadquery)
    write_assembly(tmp_path / "theirs.step", "prototype", groups)
    assert (tmp_path / "ours.step").read_bytes() == (tmp_path / "theirs.step").read_bytes()


def test_the_same_bytes_after_a_file_with_tolerances(tmp_path: Path) -> None:
    groups = (SolidGroup("balls", balls()),)
    write_assembly(tmp_path / "first.step", "prototype", groups)
    Interface_Static.SetCVal_s("write.step.schema", "AP242DIS")  # as such a file leaves it
    write_assembly(tmp_path / "second.step", "prototype", groups)
    assert (tmp_path / "first.step").read_bytes() == (tmp_path / "second.step").read_bytes()


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


def test_geometry_without_a_rule_is_refused(text: str) -> None:
    with pytest.raises(NoMirrorImageError, match="no rule for the mirror image of OFFSET_SURFACE"):
        mirrored_step(text.replace("PLANE(", "OFFSET_SURFACE("), {})

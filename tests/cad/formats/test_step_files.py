"""prototype.step has the tree of solids that cadquery makes of them."""

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
from tbcad.cad.kernel.solids import cylinder, sphere

GREY, CLEAR = (0.5, 0.5, 0.5, 1.0), (0.1, 0.2, 0.3, 0.4)


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


def test_a_mirror_image_without_a_rule_is_refused(tmp_path: Path) -> None:
    rod = Solid("rod", cylinder(np.zeros(3), np.eye(3)[2], 1.0, 2.0), ())
    write_step(tmp_path / "rod.step", rod)
    text = (tmp_path / "rod.step").read_text()
    assert mirrored_step(text, {}) != text
    with pytest.raises(NoMirrorImageError, match="no rule for the mirror image of OFFSET_SURFACE"):
        mirrored_step(text.replace("PLANE(", "OFFSET_SURFACE("), {})

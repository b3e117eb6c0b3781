"""prototype.step has the tree of solids that cadquery makes of them."""

import locale
from pathlib import Path

import cadquery
import numpy as np
import pytest
import trimesh
from cadquery.occ_impl.assembly import toCAF
from OCP.Interface import Interface_Static
from OCP.TDocStd import TDocStd_Document
from tbcad_verify.mesh.threemf import read_3mf

from tbcad.cad.formats import assembly
from tbcad.cad.formats.assembly import ColouredSolid, SolidGroup, write_assembly
from tbcad.cad.formats.mesh_files import write_3mf, write_stl
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.solids import sphere

GREY, CLEAR = (0.5, 0.5, 0.5, 1.0), (0.1, 0.2, 0.3, 0.4)
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


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


def box() -> Mesh:
    solid = trimesh.creation.box((1.0, 2.0, 3.0))
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces))


def test_same_bytes_same_mesh_and_the_locale_stays(tmp_path: Path) -> None:
    """In the locale C, into which lib3mf changes, Python opens texts as ASCII."""
    before = locale.setlocale(locale.LC_ALL)
    for name in ("box.3mf", "again.3mf"):
        write_3mf(tmp_path / name, "box", box())
        assert locale.setlocale(locale.LC_ALL) == before
    assert (tmp_path / "box.3mf").read_bytes() == (tmp_path / "again.3mf").read_bytes()
    corners, _ = read_3mf(tmp_path, "box.3mf")
    assert corners == pytest.approx(box().vertices[box().triangles])


def test_normals_are_those_of_the_coordinates_as_written(tmp_path: Path) -> None:
    """Rounding to 32 bits tilts this triangle, 5 mm long and 3 um high, by more than 0.001."""
    thin = [[123.4, 40.1, 7.3], [128.3, 40.1, 7.3], [125.0, 40.1000021, 7.3000019]]
    mesh = Mesh(np.array(thin), np.array([[0, 1, 2]]))
    write_stl(tmp_path / "thin.stl", mesh)
    facet = np.fromfile(tmp_path / "thin.stl", FACET, offset=84)[0]
    a, b, c = facet["corners"].astype(float)
    across = np.cross(b - a, c - a)
    np.testing.assert_allclose(facet["normal"], across / np.linalg.norm(across), atol=1e-7)
    exact = np.cross(*(np.array(thin[1:]) - thin[0]))
    assert np.abs(exact / np.linalg.norm(exact) - facet["normal"]).max() > 1e-3

"""3MF files, and what writing and reading them leaves behind."""

import locale
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tbcad_verify.mesh.threemf import _corners

from tbcad.cad.formats.mesh_files import write_3mf, write_stl
from tbcad.cad.kernel.mesh import Mesh

FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def box() -> Mesh:
    solid = trimesh.creation.box((1.0, 2.0, 3.0))
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces))


def test_same_bytes_and_same_mesh(tmp_path: Path) -> None:
    for name in ("one.3mf", "two.3mf"):
        write_3mf(tmp_path / name, "box", box())
    assert (tmp_path / "one.3mf").read_bytes() == (tmp_path / "two.3mf").read_bytes()
    corners = _corners("one.3mf", tmp_path / "one.3mf")
    assert corners == pytest.approx(box().vertices[box().triangles])


def test_the_locale_stays(tmp_path: Path) -> None:
    """In the locale C, into which lib3mf changes, Python opens texts as ASCII."""
    before = locale.setlocale(locale.LC_ALL)
    write_3mf(tmp_path / "box.3mf", "box", box())
    assert locale.setlocale(locale.LC_ALL) == before
    _corners("box.3mf", tmp_path / "box.3mf")
    assert locale.setlocale(locale.LC_ALL) == before


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

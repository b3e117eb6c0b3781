"""3MF files, and what writing and reading them leaves behind."""

import locale
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tbcad_verify.mesh.threemf import _corners

from tbcad.cad.formats.mesh_files import write_3mf
from tbcad.cad.kernel.mesh import Mesh


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

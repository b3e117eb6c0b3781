"""Assemblies of which no sag can be computed."""

from pathlib import Path

import numpy as np
import pytest
from trimesh.creation import box

from tbcad.cad.formats.glb import ColouredMesh, write_glb
from tbcad.cad.kernel.mesh import Mesh
from tbcad.errors import InputError
from tbcad.rig.gravity.sag import BEARINGS, UPRIGHTS, read_solids

NAMES = ("carrier", "shaft", "bearing_head", *UPRIGHTS, *BEARINGS)


def written(path: Path, names: tuple[str, ...], size: float = 20.0) -> Path:
    cube = box((size, size, size))
    mesh = Mesh(np.array(cube.vertices), np.array(cube.faces))
    write_glb(path, "rig", [ColouredMesh(name, "rig", mesh, (1, 1, 1, 1)) for name in names])
    return path


def test_bodies_are_read_in_the_frame_that_is_asked_for(tmp_path: Path) -> None:
    solids = read_solids(written(tmp_path / "a.glb", NAMES), np.eye(3), ["carrier"])
    assert np.ptp(solids["shaft"].bounds, axis=0) == pytest.approx([20, 20, 20], abs=1e-4)


@pytest.mark.parametrize(("names", "size"), [(NAMES[1:], 20.0), (NAMES[:-1], 20.0), (NAMES, 2e4)])
def test_another_assembly_is_refused(tmp_path: Path, names: tuple[str, ...], size: float) -> None:
    path = written(tmp_path / "a.glb", names, size)
    with pytest.raises(InputError, match="no assembly that tbcad wrote"):
        read_solids(path, np.eye(3), ["carrier"])


def test_an_assembly_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "a.glb", NAMES)
    path.write_bytes(path.read_bytes()[:600])
    with pytest.raises(InputError, match="cannot be read"):
        read_solids(path, np.eye(3), ["carrier"])

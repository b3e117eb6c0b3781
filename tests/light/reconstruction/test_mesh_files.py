"""Files of a mesh, read back."""

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tbcad.errors import InputError
from tbcad.light.reconstruction.files import MESH_SUFFIXES, mesh_file
from tbcad.light.reconstruction.surface import field_mesh
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_or_built_in
from tests.light.reconstruction.balls import BELOW, COLOUR, made_of

MIDDLE, RADIUS = (1.0, 2.0, 3.0), 4.0


@pytest.fixture(scope="module")
def mesh() -> trimesh.Trimesh:
    made = made_of(lambda at: BELOW + 8 * (RADIUS - np.linalg.norm(at - MIDDLE, axis=1)))
    return field_mesh(made, 1.0)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_the_file_is_closed_and_always_the_same(mesh: trimesh.Trimesh, suffix: str) -> None:
    content = mesh_file(mesh, suffix)
    assert content == mesh_file(mesh, suffix)
    read = trimesh.load(BytesIO(content), file_type=suffix[1:], force="mesh")
    assert read.is_watertight
    assert read.volume > 0
    middle, unit = (MIDDLE, 1.0) if suffix != ".glb" else ((1.0, 3.0, -2.0), 1000.0)
    assert unit * read.bounds.mean(axis=0) == pytest.approx(middle, abs=0.05)
    assert unit * read.extents == pytest.approx([2 * RADIUS] * 3, abs=0.1)


@pytest.mark.parametrize("suffix", [".glb", ".ply"])
def test_colours_are_those_of_the_field(mesh: trimesh.Trimesh, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"ball{suffix}"
    path.write_bytes(mesh_file(mesh, suffix))
    unit = "m" if suffix == ".glb" else "mm"
    read = load_or_built_in(path, 60.0, ObjectOptions(unit=unit))
    assert read.albedo.reshape(-1, 3).mean(axis=0) == pytest.approx(COLOUR, abs=0.01)


def test_another_suffix_is_refused(mesh: trimesh.Trimesh) -> None:
    with pytest.raises(InputError, match=r"'\.obj' is no kind of mesh file: allowed are \.glb"):
        mesh_file(mesh, ".obj")

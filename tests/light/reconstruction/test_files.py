"""Files of a field's mesh and volume, read back."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import trimesh
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLImageDataReader

from tbcad.errors import InputError
from tbcad.light.reconstruction import files
from tbcad.light.reconstruction.field import Field, Grid, write_field
from tbcad.light.reconstruction.files import MESH_SUFFIXES, mesh_distance, mesh_file
from tbcad.light.reconstruction.surface import field_mesh
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_or_built_in
from tests.light.reconstruction.balls import (
    BELOW,
    COLOUR,
    NODES,
    RADIUS,
    WIDTH_MM,
    ball,
    made_of,
    parallel_rays,
)

MIDDLE, SMALL = (1.0, 2.0, 3.0), 4.0
RAYS = parallel_rays(lambda away: away < 7, across=41)


@pytest.fixture(scope="module")
def mesh() -> trimesh.Trimesh:
    made = made_of(lambda at: BELOW + 8 * (SMALL - np.linalg.norm(at - MIDDLE, axis=1)))
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
    assert unit * read.extents == pytest.approx([2 * SMALL] * 3, abs=0.1)


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


def some_of_it() -> Field:
    """A ball's upper half."""
    whole = ball()
    wanted = whole.grid.dense((whole.grid.points[:, 2] > 0).astype(np.float32)) > 0
    grid = Grid.about(wanted, WIDTH_MM)
    kept = whole.grid.row[tuple(grid.place.T)]
    return Field(grid, whole.values[kept])


def test_the_volume_has_density_and_colour_in_place() -> None:
    made = some_of_it()
    content = files.volume_file(made)
    assert content == files.volume_file(made)
    reader = vtkXMLImageDataReader()
    reader.ReadFromInputStringOn()
    reader.SetInputString(content.decode())
    reader.Update()
    image = reader.GetOutput()
    for point, inside in (((0, 0, 5.0), True), ((0, 0, 8.0), False), ((0, 0, -5.0), False)):
        number = image.FindPoint(point)
        density = image.GetPointData().GetArray("density").GetTuple1(number)
        assert (density > 1) == inside
    x = image.FindPoint((6.0, 0.0, 1.0))
    assert np.allclose(image.GetPoint(x), (6.0, 0.0, 1.0))
    colour = vtk_to_numpy(image.GetPointData().GetArray("colour"))[x]
    assert np.allclose(colour, COLOUR)


def test_numpy_has_the_same_from_the_fields_file(tmp_path: Path) -> None:
    made = some_of_it()
    write_field(tmp_path / "field.npz", made)
    told = [line for line in (files.__doc__ or "").splitlines() if line.startswith("    ")]
    lines = "\n".join(line.strip() for line in told)
    names = {"np": np}
    exec(lines.replace("field.npz", str(tmp_path / "field.npz")), names)
    density, colour = (np.asarray(names[name]) for name in ("density", "colour"))
    assert density.shape == (NODES,) * 3
    at = tuple(made.grid.place.T)
    assert np.allclose(density[at], made.density(), atol=1e-4)
    assert np.allclose(colour[at], COLOUR)
    assert density.sum() == density[at].sum()
    assert density[NODES // 2, NODES // 2, int((5 / WIDTH_MM + 0.5) * (NODES - 1))] > RADIUS


def sphere(radius: float) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=5, radius=radius)


def test_of_two_spheres_it_is_the_difference_of_their_radii() -> None:
    found = mesh_distance(sphere(6.5), patterned_ball(7.0), RAYS)
    for value in (found.mean_mm, found.percentile_95_mm, found.hausdorff_mm,
                  found.whole_mean_mm, found.whole_hausdorff_mm):  # fmt: skip
        assert value == pytest.approx(0.5, abs=0.01)


def test_what_no_ray_meets_counts_for_the_whole_alone() -> None:
    """A ball that ends at z = -4, though the true one goes on, seen from above."""
    flat = sphere(7.0)
    points = np.array(flat.vertices)
    points[:, 2] = np.maximum(points[:, 2], -4.0)
    steep = RAYS.direction[:, 2] < -0.9
    above = replace(RAYS, entry=RAYS.entry[steep], direction=RAYS.direction[steep])
    found = mesh_distance(
        trimesh.Trimesh(points, flat.faces, process=False), patterned_ball(7.0), above
    )
    assert found.hausdorff_mm < 0.1
    assert found.whole_hausdorff_mm == pytest.approx(3.0, abs=0.05)
    assert found.whole_mean_mm > found.mean_mm

"""The volume of a field, read back, and the lines of NumPy that its module gives."""

from pathlib import Path

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLImageDataReader

from tbcad.light.reconstruction import files
from tbcad.light.reconstruction.field import Field, write_field
from tbcad.light.reconstruction.grid import Grid
from tests.light.reconstruction.balls import COLOUR, NODES, RADIUS, WIDTH_MM, ball


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

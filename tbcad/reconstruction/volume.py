"""A field as a volume for other programs: VTK's image data (.vti), for ParaView and PyVista.

It is dense, so every reader understands it. NumPy has the same from the field's file:

    field = np.load("field.npz")
    at = tuple(field["node"].T)
    density = np.zeros((field["nodes"],) * 3, np.float32); x = field["density"]
    density[at] = (x + np.sqrt(x * x + 0.01)) / 2
    colour = np.zeros((*density.shape, 3), np.float32); colour[at] = field["colour"]

Their values between nodes are those of a linear density, a little softer than the field's own.
"""

import numpy as np

from tbcad.reconstruction.field import Field
from tbcad.reconstruction.marching import MATT

SUFFIX = ".vti"


def volume_file(made: Field) -> bytes:
    """The file of a field: `density`, 1/mm, and `colour`, 0 to 1, at all nodes of its cube, mm.

    Of a view-dependent field it has the colours without what depends on the direction.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

    grid, corner = made.grid, -made.grid.width_mm / 2
    image = vtkImageData()
    image.SetDimensions(grid.n, grid.n, grid.n)
    image.SetOrigin(corner, corner, corner)
    image.SetSpacing(grid.pitch_mm, grid.pitch_mm, grid.pitch_mm)
    colours = [np.clip(column, 0, 1) for column in made.values[:, 1:MATT].T]
    for name, columns in {"density": [made.density()], "colour": colours}.items():
        dense = [grid.dense(column.astype(np.float32)).ravel(order="F") for column in columns]
        values = numpy_to_vtk(np.column_stack(dense), deep=True)
        values.SetName(name)
        image.GetPointData().AddArray(values)
    image.GetPointData().SetActiveScalars("density")
    writer = vtkXMLImageDataWriter()
    writer.SetInputData(image)
    writer.SetHeaderTypeToUInt64()
    writer.WriteToOutputStringOn()
    writer.EncodeAppendedDataOn()
    writer.Write()
    return str(writer.GetOutputString()).encode("ascii")

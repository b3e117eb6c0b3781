"""Pictures of light in Radiance's format (.hdr; G. Ward, Real Pixels, Graphics Gems II, 1991)."""

from pathlib import Path

import numpy as np

from tbcad.errors import InputError
from tbcad.types import Floats

SIGNATURE = b"#?"
MOST_PIXELS = 1 << 27
GIVE = "give a picture in Radiance's format (.hdr)"


def read_hdr(path: Path) -> Floats:
    """Red, green and blue (h, w, 3), linear, from the top row down.

    Raises:
        InputError: it cannot be read.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOImage import vtkHDRReader

    if not path.is_file():
        raise InputError(f"{path}: no such file; {GIVE}")
    with path.open("rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            raise InputError(f"{path} does not begin as a file of that format: {GIVE}")
    reader = vtkHDRReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    low_x, high_x, low_y, high_y, *_ = reader.GetDataExtent()
    width, height = high_x - low_x + 1, high_y - low_y + 1
    if not 0 < width * height <= MOST_PIXELS:
        raise InputError(f"{path} is damaged or larger than {MOST_PIXELS} pixels: {GIVE}")
    reader.Update()
    values = reader.GetOutput().GetPointData().GetScalars()
    if reader.GetErrorCode() or values is None:
        raise InputError(f"{path} is damaged: {GIVE}")
    rows = np.asarray(vtk_to_numpy(values), dtype=np.float64).reshape(height, width, 3)
    picture = rows[::-1]
    if not np.isfinite(picture).all() or picture.min() < 0:
        raise InputError(f"{path} has values that are no light: {GIVE}")
    return picture

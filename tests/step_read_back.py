"""A solid as a reader of its STEP file gets it: whole, valid, and without gaps.

The oracle of `tbcad.cad.kernel.checks.without_slack`, which needs no file.
"""

import tempfile
from pathlib import Path

from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.IFSelect import IFSelect_RetDone
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.STEPControl import STEPControl_Reader
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import InvalidSolidError, Solid
from tbcad.cad.kernel.checks import MAX_GAP_MM, SolidProperties, volume

VOLUME_ERROR = 1e-5  # as a share of the volume; the kernel integrates to some 2e-6
MAXIMUM = 1  # of the tolerances in a shape


def check_read_back(name: str, shape: TopoDS_Solid, known: SolidProperties) -> None:
    """Refuse a solid that its file does not keep, although the kernel takes it for valid.

    Args:
        name: of the part.
        shape: the solid.
        known: its properties.

    Raises:
        InvalidSolidError: as said.
    """
    again = _read_back(name, shape, known)
    gap = ShapeAnalysis_ShapeTolerance().Tolerance(again, MAXIMUM)
    if gap > MAX_GAP_MM:
        raise InvalidSolidError(f"{name}: its edges are up to {gap:.2g} mm off its faces")
    if not BRepCheck_Analyzer(again).IsValid() or (
        abs(volume(again) - known.volume) > VOLUME_ERROR * known.volume
    ):
        raise InvalidSolidError(f"{name}: its STEP file does not give the same valid solid")


def _read_back(name: str, shape: TopoDS_Solid, known: SolidProperties) -> TopoDS_Shape:
    with tempfile.TemporaryDirectory(prefix="tbcad-") as folder:
        file = Path(folder) / "part.step"
        write_step(file, Solid(name, shape, ()), known=known)
        reader = STEPControl_Reader()
        if reader.ReadFile(str(file)) != IFSelect_RetDone:
            raise InvalidSolidError(f"{name}: the kernel cannot read its own STEP file")
        reader.TransferRoots()
        return reader.OneShape()

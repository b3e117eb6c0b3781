"""A solid and the names of its faces, as a STEP file has them."""

from pathlib import Path

from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.StepShape import StepShape_AdvancedFace
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopoDS import TopoDS

from tbcad.cad.brep import Solid
from tbcad.cad.solids import faces
from tbcad.errors import InputError
from tbcad.formats.step import configure


def read_named_solid(path: Path) -> Solid:
    """Read a file of one solid.

    Raises:
        InputError: it cannot be read, or is not one solid.
    """
    configure(pcurves=False)
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone or reader.TransferRoots() != 1:
        raise InputError(f"{path} is no STEP file of one solid: run tbcad build again")
    shape = reader.OneShape()
    named = _face_names(reader)
    if shape.ShapeType() != TopAbs_ShapeEnum.TopAbs_SOLID or len(faces(shape)) != len(named):
        raise InputError(f"{path} is no STEP file of one solid: run tbcad build again")
    # The kernel keeps the order of the file.
    return Solid(path.stem, TopoDS.Solid_s(shape), tuple(zip(named, faces(shape), strict=True)))


def _face_names(reader: STEPControl_Reader) -> list[str]:
    model = reader.WS().Model()
    entities = (model.Value(k) for k in range(1, model.NbEntities() + 1))
    return [one.Name().ToCString() for one in entities if isinstance(one, StepShape_AdvancedFace)]

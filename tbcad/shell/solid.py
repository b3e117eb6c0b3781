"""One camera's half as a closed solid, built face by face without boolean operations."""

from dataclasses import dataclass

from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.TopoDS import TopoDS_Face, TopoDS_Solid

from tbcad.cad.brep import Maker
from tbcad.optics.cells import Cells
from tbcad.shell.casing import casing
from tbcad.shell.envelope import Body
from tbcad.shell.front import front


@dataclass(frozen=True)
class Solid:
    """A solid and the names of its faces.

    Attributes:
        name: of the part.
        shape: the closed solid.
        faces: name and face, mirrors first in the order of their ids.
    """

    name: str
    shape: TopoDS_Solid
    faces: tuple[tuple[str, TopoDS_Face], ...]


class InvalidSolidError(RuntimeError):
    """The kernel's check refuses a solid: a fault of tbcad, not of the input."""


def shell(name: str, ids: list[str], cells: Cells, body: Body, mirrored: bool) -> Solid:
    """Solid of one half.

    Args:
        name: of the part.
        ids: names of the mirrors, in the order of the cells.
        cells: camera a's cells of the modelled surfaces.
        body: what closes them.
        mirrored: build the mirror image, camera b's half.

    Raises:
        InvalidSolidError: when the kernel finds the solid invalid.
    """
    maker = Maker(mirrored)
    mirrors = front(maker, cells)
    faces = [*zip(ids, mirrors.faces(), strict=True), *casing(mirrors, body)]
    solid = maker.solid([face for _, face in faces])
    if not BRepCheck_Analyzer(solid).IsValid():
        raise InvalidSolidError(f"{name}: the kernel's check finds the solid invalid")
    return Solid(name, solid, tuple(faces))

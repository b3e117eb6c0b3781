"""One camera's half as a closed solid, built face by face without boolean operations."""

from OCP.BRepCheck import BRepCheck_Analyzer

from tbcad.cad.brep import InvalidSolidError, Maker, Solid
from tbcad.optics.cells import Cells
from tbcad.shell.casing import casing_faces
from tbcad.shell.envelope import Envelope
from tbcad.shell.front import front_edges


def shell_solid(
    name: str, ids: list[str], cells: Cells, envelope: Envelope, mirrored: bool
) -> Solid:
    """Solid of one half.

    Args:
        name: of the part.
        ids: names of the mirrors, in the order of the cells.
        cells: camera a's cells of the modelled surfaces.
        envelope: what closes them.
        mirrored: build the mirror image, camera b's half.

    Raises:
        InvalidSolidError: when the kernel finds the solid invalid.
    """
    maker = Maker(mirrored)
    mirrors = front_edges(maker, cells)
    faces = [*zip(ids, mirrors.faces(), strict=True), *casing_faces(mirrors, envelope)]
    solid = maker.solid([face for _, face in faces])
    if not BRepCheck_Analyzer(solid).IsValid():
        raise InvalidSolidError(f"{name}: the kernel's check finds the solid invalid")
    return Solid(name, solid, tuple(faces))

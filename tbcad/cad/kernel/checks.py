"""Checks of the kernel's booleans: a wrong result may pass for valid."""

import numpy as np
from OCP.ShapeFix import ShapeFix_ShapeTolerance
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.cad.kernel.measures import SolidProperties, plane_faces, properties
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.meshing import meshed, welded
from tbcad.cad.kernel.solids import one_solid, without_cavities
from tbcad.core.geometry.vectors import norm
from tbcad.types import Floats

NEAR_MM = 1e-4
MAX_GAP_MM = 1e-5  # of edges from their faces
COARSE_MM = 0.05
VOLUME_ERROR = 1e-3


def checked(
    name: str,
    shape: TopoDS_Shape,
    expected: float,
    contacts: Floats,
    radius: Floats,
    mesh_mm: float,
) -> tuple[TopoDS_Solid, Mesh, SolidProperties]:
    """The one solid without cavities that a shape must be, its mesh and its properties.

    Its volume (mm^3) must be that expected by booleans of meshes; pads are whole discs of radii
    (p,) about contacts (p, 3), mm; the mesh is within mesh_mm of the surface. Else
    InvalidSolidError.
    """
    solid = without_cavities(one_solid(name, without_slack(shape)))
    mesh = closed_mesh(name, solid, mesh_mm)
    solid_properties = properties(solid)
    check_volume(name, solid_properties.volume, expected)
    check_pads(name, solid, contacts, radius)
    return solid, mesh, solid_properties


def without_slack(shape: TopoDS_Shape) -> TopoDS_Shape:
    """The shape with tolerances of at most MAX_GAP_MM, so that the kernel's check finds gaps.

    A boolean with faces that graze each other can leave edges that are off their faces, where a
    reader of its STEP file finds a gap. In memory its tolerances hide them: they are up to a
    hundred times as large as the gaps.
    """
    ShapeFix_ShapeTolerance().LimitTolerance(shape, 0.0, MAX_GAP_MM)
    return shape


def closed_mesh(name: str, shape: TopoDS_Shape, tolerance: float) -> Mesh:
    """The mesh of a solid as it is exported, no farther than a tolerance (mm) from the surface.

    InvalidSolidError if it is not closed: a face may be valid and yet have no mesh.
    """
    mesh = welded(meshed(shape, tolerance))
    check_mesh(name, mesh)
    return mesh


def check_mesh(name: str, mesh: Mesh) -> None:
    """InvalidSolidError if a mesh is not closed: faces may end nanometres from a shared edge."""
    ends = mesh.triangles, np.roll(mesh.triangles, -1, axis=1)
    # One number for an edge, which is sorted far faster than two.
    edges = np.minimum(*ends) * len(mesh.vertices) + np.maximum(*ends)
    _, count = np.unique(edges, return_counts=True)
    if (count != 2).any():
        raise InvalidSolidError(f"{name}: the kernel's mesh of the solid is not closed")


def check_volume(name: str, actual: float, expected: float, error: float = VOLUME_ERROR) -> None:
    """InvalidSolidError if a volume (mm^3) is not, within a share, what booleans of meshes give.

    A boolean of the kernel can lose bodies so that its result passes for valid.
    """
    if abs(actual - expected) > error * expected:
        raise InvalidSolidError(f"{name}: the kernel made {actual:.0f} mm^3 of {expected:.0f}")


def check_pads(name: str, shape: TopoDS_Shape, contacts: Floats, radius: Floats) -> None:
    """InvalidSolidError if pads are not whole discs about the contacts (p, 3), radii (p,)."""
    # Faces in other planes hold no pad, and to integrate them takes most of the time.
    centre, area = plane_faces(shape, contacts, NEAR_MM)
    near = norm(contacts[:, None] - centre) <= NEAR_MM
    whole = np.abs(area - np.pi * radius[:, None] ** 2) <= NEAR_MM
    lost = ~near.any(axis=1) | (near & ~whole).any(axis=1)
    if lost.any():
        raise InvalidSolidError(f"{name}: the kernel lost pad {int(lost.argmax()) + 1}")

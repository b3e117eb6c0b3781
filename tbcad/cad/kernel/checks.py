"""Volume, area and centroid of solids and faces, and checks of the kernel's booleans.

A wrong result of a boolean may pass for valid.
"""

from dataclasses import dataclass

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.GeomAbs import GeomAbs_Plane
from OCP.gp import gp_Pln, gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.ShapeFix import ShapeFix_ShapeTolerance
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape, TopoDS_Solid

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.meshing import meshed, welded
from tbcad.cad.kernel.solids import faces, one_solid, vertices, without_cavities
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.cells import FaceIntegrals
from tbcad.types import Floats

NEAR_MM = 1e-4
MAX_GAP_MM = 1e-5  # of edges from their faces
COARSE_MM = 0.05
VOLUME_ERROR = 1e-3


@dataclass(frozen=True)
class SolidProperties:
    """What integrals over a homogeneous solid give."""

    volume: float  # mm^3
    area: float  # of the surface, mm^2
    centroid: tuple[float, float, float]  # x, y and z, mm

    def mirrored(self) -> "SolidProperties":
        """Those of the mirror image in the plane x = 0."""
        x, y, z = self.centroid
        return SolidProperties(self.volume, self.area, (-x, y, z))

    def rotated(self, axes: Floats) -> "SolidProperties":
        """Those of the solid rotated about 0: axes (3, 3) are what x, y and z become, as rows."""
        x, y, z = (np.array(self.centroid) @ axes).tolist()
        return SolidProperties(self.volume, self.area, (x, y, z))


def volume(shape: TopoDS_Shape) -> float:
    """Volume, mm^3."""
    inside = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, inside)
    return float(inside.Mass())


def properties(shape: TopoDS_Shape) -> SolidProperties:
    """Volume, area and centroid by the kernel's integrals, which take seconds for a shell."""
    inside, surface = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, inside)
    BRepGProp.SurfaceProperties_s(shape, surface)
    centre = inside.CentreOfMass()
    return SolidProperties(inside.Mass(), surface.Mass(), (centre.X(), centre.Y(), centre.Z()))


def properties_within(faces: FaceIntegrals) -> SolidProperties:
    """Those of the solid that all its faces close."""
    x, y, z = (faces.origin + faces.volume_moment / faces.volume).tolist()
    return SolidProperties(faces.volume, faces.area, (x, y, z))


def mean_corner(shape: TopoDS_Shape) -> Floats:
    """Mean of a shape's corners, mm, (3,)."""
    points = np.array([BRep_Tool.Pnt_s(vertex).Coord() for vertex in vertices(shape)])
    return np.asarray(points.mean(axis=0))


def face_integrals(face: TopoDS_Face, origin: Floats) -> FaceIntegrals:
    """Integrals over a face by the kernel."""
    inside, surface = BRepGProp_Vinert(), GProp_GProps()
    inside.SetLocation(gp_Pnt(*origin.tolist()))
    inside.Perform(BRepGProp_Face(face), BRepGProp_Domain(face))
    BRepGProp.SurfaceProperties_s(face, surface)
    moment = inside.Mass() * (np.array(inside.CentreOfMass().Coord()) - origin)
    return FaceIntegrals(origin, inside.Mass(), moment, surface.Mass())


def plane_faces(
    shape: TopoDS_Shape, through: Floats | None = None, near: float = 0.0
) -> tuple[Floats, Floats]:
    """Centres (f, 3) and areas (f,) of plane faces of a shape, mm and mm^2.

    Only of those whose planes pass near (mm) one of the points (p, 3), if there are any.
    """
    centre, area = [], []
    for face in faces(shape):
        adaptor = BRepAdaptor_Surface(face)
        if adaptor.GetType() == GeomAbs_Plane and _passes(adaptor.Plane(), through, near):
            surface = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, surface)
            centre.append(surface.CentreOfMass().Coord())
            area.append(surface.Mass())
    return np.array(centre).reshape(-1, 3), np.array(area)


def _passes(plane: gp_Pln, points: Floats | None, near: float) -> bool:
    if points is None:
        return True
    normal = np.array(plane.Axis().Direction().Coord())
    return bool((np.abs(points @ normal - normal @ plane.Location().Coord()) <= near).any())


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
    """The mesh of a solid as it is written, no farther than a tolerance (mm) from the surface.

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

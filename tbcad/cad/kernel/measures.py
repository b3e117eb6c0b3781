"""Volume, area and centroid of solids, and of the faces that close them, by the kernel."""

from dataclasses import dataclass

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.GeomAbs import GeomAbs_Plane
from OCP.gp import gp_Pln, gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape

from tbcad.cad.kernel.solids import faces, vertices
from tbcad.types import Floats


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


@dataclass(frozen=True)
class FaceIntegrals:
    """Integrals over faces, by which they add up to those of a solid."""

    # any point near the faces, mm, (3,): the nearer, the less errors of the kernel count
    origin: Floats
    volume: float  # between the origin and the faces, mm^3
    volume_moment: Floats  # of the distance from the origin over that volume, mm^4, (3,)
    area: float  # mm^2

    def __add__(self, other: "FaceIntegrals") -> "FaceIntegrals":
        """Those of both together; they have the same origin."""
        return FaceIntegrals(
            self.origin,
            self.volume + other.volume,
            self.volume_moment + other.volume_moment,
            self.area + other.area,
        )

    @property
    def properties(self) -> SolidProperties:
        """Those of the solid that the faces close."""
        x, y, z = (self.origin + self.volume_moment / self.volume).tolist()
        return SolidProperties(self.volume, self.area, (x, y, z))


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

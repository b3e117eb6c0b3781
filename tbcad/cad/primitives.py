"""Simple solids to look at."""

from OCP.BRepBuilderAPI import BRepBuilderAPI_MakePolygon, BRepBuilderAPI_MakeVertex
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
from OCP.gp import gp_Pnt
from OCP.TopoDS import TopoDS_Solid

from tbcad.cad.solids import one_solid
from tbcad.types import Floats


def sphere(centre: Floats, radius: float) -> TopoDS_Solid:
    """A ball about a point (3,), mm."""
    return one_solid("sphere", BRepPrimAPI_MakeSphere(gp_Pnt(*centre.tolist()), radius).Shape())


def pyramid(apex: Floats, corners: Floats) -> TopoDS_Solid:
    """What lies between a point (3,) and a plane polygon (n, 3), mm."""
    rim = BRepBuilderAPI_MakePolygon()
    for corner in corners.tolist():
        rim.Add(gp_Pnt(*corner))
    rim.Close()
    loft = BRepOffsetAPI_ThruSections(True, True)
    loft.AddVertex(BRepBuilderAPI_MakeVertex(gp_Pnt(*apex.tolist())).Vertex())
    loft.AddWire(rim.Wire())
    return one_solid("pyramid", loft.Shape())

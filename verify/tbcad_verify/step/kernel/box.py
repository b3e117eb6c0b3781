"""The box of a solid, from where its extremes can be.

Along an axis the extreme of a solid lies on a corner, on an edge, or inside a face that is curved
both ways: inside a plane, cylinder, cone or extrusion a line through the extreme leads to an edge.
The kernel's own boxes are those of whole surfaces, too large for a patch of a spheroid.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BndLib import BndLib_Add3dCurve
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepClass import BRepClass_FaceClassifier
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepTools import BRepTools
from OCP.GeomAbs import (
    GeomAbs_Cone,
    GeomAbs_Cylinder,
    GeomAbs_Line,
    GeomAbs_Plane,
    GeomAbs_Sphere,
    GeomAbs_SurfaceOfExtrusion,
)
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt, gp_Pnt2d
from OCP.ShapeAnalysis import ShapeAnalysis_Surface
from OCP.TopAbs import TopAbs_IN, TopAbs_ON
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape

from tbcad_verify.step.kernel.topology import edges_of, faces_of, triple
from tbcad_verify.types import Floats

RULED = (GeomAbs_Plane, GeomAbs_Cylinder, GeomAbs_Cone, GeomAbs_SurfaceOfExtrusion)
NEAR_MM = 1e-6  # of a point to a face that it is on
FULL_TURN, SLACK = 2 * np.pi, 1e-9
FAR_MM = 1e4  # farther than any part, near enough for the digits
OUTWARD = np.vstack([-np.eye(3), np.eye(3)])  # minimum x, y, z, then maximum


def box(shape: TopoDS_Shape, corners: Floats) -> list[list[float]]:
    """Minimum and maximum x, y, z, mm; infinite without corners (V, 3) and edges."""
    reach = np.maximum(_of_corners(corners), _of_edges(shape))
    faces = [(face, BRepAdaptor_Surface(face)) for face in faces_of(shape)]
    spheres = [pair for pair in faces if pair[1].GetType() == GeomAbs_Sphere]
    others = [face for face, surface in faces if surface.GetType() not in (GeomAbs_Sphere, *RULED)]
    for k, axis in enumerate(OUTWARD):
        reach[k] = max([reach[k], *(reach_of_face(face, axis) for face in others)])
        reach[k] = _of_spheres(spheres, axis, float(reach[k]))
    return [(-reach[:3]).tolist(), reach[3:].tolist()]


def _of_corners(corners: Floats) -> Floats:
    """(6,) how far corners reach along `OUTWARD`."""
    return np.asarray((OUTWARD @ corners.T).max(axis=1, initial=-np.inf))


def _of_edges(shape: TopoDS_Shape) -> Floats:
    """(6,) how far the edges reach between their ends, which straight ones do not."""
    curves = map(BRepAdaptor_Curve, edges_of(shape))
    bent = [_of_curve(curve) for curve in curves if curve.GetType() != GeomAbs_Line]
    return np.asarray(np.max([np.full(6, -np.inf), *bent], axis=0))


def _of_curve(curve: BRepAdaptor_Curve) -> Floats:
    """(6,) how far a curve reaches, by the kernel's search for its extremes."""
    bounds = Bnd_Box()
    BndLib_Add3dCurve.AddOptimal_s(curve, 0.0, bounds)
    bounds.SetGap(0.0)
    return np.array([-value for value in triple(bounds.CornerMin())] + triple(bounds.CornerMax()))


def reach_of_face(face: TopoDS_Shape, axis: Floats) -> float:
    """A face's extreme along an axis, from its distance to a wall far out, mm; NaN if it fails."""
    wall = gp_Pln(gp_Pnt(*(FAR_MM * axis).tolist()), gp_Dir(*axis.tolist()))
    far = BRepBuilderAPI_MakeFace(wall, -FAR_MM, FAR_MM, -FAR_MM, FAR_MM).Face()
    distance = BRepExtrema_DistShapeShape(face, far)
    return float(FAR_MM - distance.Value()) if distance.IsDone() else float("nan")


def _of_spheres(spheres: list[tuple[TopoDS_Face, Any]], axis: Floats, beyond: float) -> float:
    """The largest of an extreme and of those of spheres, where they are within their faces."""
    tops = []
    for face, surface in spheres:
        sphere = surface.Sphere()
        top = np.array(triple(sphere.Location())) + sphere.Radius() * axis
        if top @ axis > beyond:
            tops.append((float(top @ axis), face, top))
    tops.sort(key=lambda one: -one[0])
    return next((reach for reach, face, top in tops if _is_on(face, top)), beyond)


def _is_on(face: TopoDS_Face, point: Floats) -> bool:
    """Whether a point of a face's sphere is on the face: in parameters, of which u is periodic."""
    around, up = (
        ShapeAnalysis_Surface(BRep_Tool.Surface_s(face))
        .ValueOfUV(gp_Pnt(*point.tolist()), NEAR_MM)
        .Coord()
    )
    low, high, _, _ = BRepTools.UVBounds_s(face)
    turns = np.arange(
        np.ceil((low - around) / FULL_TURN - SLACK), (high - around) / FULL_TURN + SLACK
    )
    return any(
        BRepClass_FaceClassifier(face, gp_Pnt2d(around + k * FULL_TURN, up), NEAR_MM).State()
        in (TopAbs_IN, TopAbs_ON)
        for k in turns.tolist()
    )

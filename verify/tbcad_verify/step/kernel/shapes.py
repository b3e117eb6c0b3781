"""Parts of a shape as the CAD kernel counts them, its box, and faces of spheres between arcs.

Along an axis the extreme of a solid lies on a corner, on an edge, or inside a face that is curved
both ways: inside a plane, cylinder, cone or extrusion a line through the extreme leads to an edge.
The kernel's own boxes are those of whole surfaces, too large for a patch of a spheroid.

With n the unit normal and p the middle of the outline, Stokes' theorem gives on the unit sphere
    area = integral of p.(n x dn) / (1 + p.n), up to whole spheres,
    integral of n over the face = 1/2 integral of n x dn,
    integral of n n^T over the face = (area + integral of n (n x dn)^T) / 3.
All are analytic along an arc: Gauss's rule is exact to rounding.
"""

from __future__ import annotations

from collections.abc import Iterator
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
    GeomAbs_Circle,
    GeomAbs_Cone,
    GeomAbs_Cylinder,
    GeomAbs_Line,
    GeomAbs_Plane,
    GeomAbs_Sphere,
    GeomAbs_SurfaceOfExtrusion,
)
from OCP.gp import gp_Circ, gp_Dir, gp_Pln, gp_Pnt, gp_Pnt2d
from OCP.ShapeAnalysis import ShapeAnalysis_Surface
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_FORWARD,
    TopAbs_IN,
    TopAbs_ON,
    TopAbs_VERTEX,
    TopAbs_WIRE,
)
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape, TopTools_IndexedMapOfShape

from tbcad_verify.types import Floats

RULED = (GeomAbs_Plane, GeomAbs_Cylinder, GeomAbs_Cone, GeomAbs_SurfaceOfExtrusion)
NEAR_MM = 1e-6  # of a point to a face that it is on
FULL_TURN, SLACK = 2 * np.pi, 1e-9
FAR_MM = 1e4  # farther than any part, near enough for the digits
OUTWARD = np.vstack([-np.eye(3), np.eye(3)])  # minimum x, y, z, then maximum
NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
LONGEST = np.pi / 2 * 1.01  # of an arc that the rule integrates to rounding, rad
MIN_COSINE = 0.3  # of the outline's points to its middle: far from the pole of the integrals


def each(shape: TopoDS_Shape, kind: Any) -> Iterator[TopoDS_Shape]:
    """All parts of a kind, those of several owners several times."""
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def faces_of(shape: TopoDS_Shape) -> list[TopoDS_Face]:
    """All faces, in the order of the shape."""
    return [TopoDS.Face_s(face) for face in each(shape, TopAbs_FACE)]


def each_once(shape: TopoDS_Shape, kind: Any) -> list[TopoDS_Shape]:
    """All parts of a kind, each once."""
    shapes = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, shapes)
    return [shapes.FindKey(k) for k in range(1, shapes.Extent() + 1)]


def edges_of(shape: TopoDS_Shape) -> list[TopoDS_Edge]:
    """All edges that are curves, each once; a pole is a point."""
    edges = [TopoDS.Edge_s(edge) for edge in each_once(shape, TopAbs_EDGE)]
    return [edge for edge in edges if not BRep_Tool.Degenerated_s(edge)]


def corners_of(shape: TopoDS_Shape) -> Floats:
    """(V, 3) corners of all edges, those of several edges several times, mm."""
    corners = [triple(BRep_Tool.Pnt_s(TopoDS.Vertex_s(one))) for one in each(shape, TopAbs_VERTEX)]
    return np.array(corners, dtype=np.float64).reshape(-1, 3)


def count(shape: TopoDS_Shape, kind: Any) -> int:
    """How many parts of a kind there are."""
    return sum(1 for _ in each(shape, kind))


def open_edges(shape: TopoDS_Shape) -> int:
    """Edges without exactly two sides; a seam has both its own, and a pole is a point."""
    sides = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, sides)
    return sum(
        sides.FindFromIndex(k).Extent() != 2
        and not BRep_Tool.Degenerated_s(TopoDS.Edge_s(sides.FindKey(k)))
        for k in range(1, sides.Extent() + 1)
    )


def triple(vector: Any) -> list[float]:
    """Coordinates of a point or direction of the kernel."""
    return list(vector.Coord())


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


def between_arcs(
    face: TopoDS_Face, centre: Floats, radius: float
) -> tuple[float, Floats, Floats] | None:
    """Area, and first and second moment about the centre, of a face of a sphere.

    Args:
        face: whose natural normal leads away from the centre if it is turned forward.
        centre: (3,) mm.
        radius: mm.

    Returns:
        mm^2, (3,) mm^3 and (3, 3) mm^4; None unless one outline of short arcs bounds the face.
    """
    arcs = _arcs(face)
    if arcs is None:
        return None
    rows, signs = np.array([row for row, _ in arcs]), np.array([sign for _, sign in arcs])
    n, dn = _along(rows, signs, centre, radius)
    middle = n.mean(axis=0)
    middle /= max(float(np.linalg.norm(middle)), np.finfo(np.float64).tiny)
    cosine = n @ middle
    if cosine.min() < MIN_COSINE:
        return None
    turning = np.cross(n, dn)
    area = float((turning @ middle / (1 + cosine)).sum())
    area += 4 * np.pi if area < 0 else 0.0  # all of the sphere but what the outline holds
    second = (area * np.eye(3) + np.einsum("ni,nj->ij", n, turning)) / 3
    return radius**2 * area, radius**3 * turning.sum(axis=0) / 2, radius**4 * second


def _arcs(face: TopoDS_Face) -> list[tuple[list[float], float]] | None:
    """Each edge of a face as centre, two radii as vectors and both ends; and its direction."""
    forward = face.Oriented(TopAbs_FORWARD)
    if count(forward, TopAbs_WIRE) != 1:
        return None
    arcs = []
    for edge in map(TopoDS.Edge_s, each(forward, TopAbs_EDGE)):
        curve = BRepAdaptor_Curve(edge)
        if curve.GetType() != GeomAbs_Circle:
            return None
        first, last = curve.FirstParameter(), curve.LastParameter()
        if last - first > LONGEST:
            return None
        sign = 1.0 if edge.Orientation() == TopAbs_FORWARD else -1.0
        arcs.append(([*_radii(curve.Circle()), first, last], sign))
    return arcs


def _radii(circle: gp_Circ) -> list[float]:
    place, radius = circle.Position(), circle.Radius()
    one, two = triple(place.XDirection()), triple(place.YDirection())
    return [
        *triple(place.Location()),
        *(radius * value for value in one),
        *(radius * value for value in two),
    ]


def _along(rows: Floats, signs: Floats, centre: Floats, radius: float) -> tuple[Floats, Floats]:
    """(N, 3) unit normals at the nodes of all arcs, and (N, 3) their changes by the weights."""
    half = (rows[:, 10] - rows[:, 9]) / 2
    at = (rows[:, 9] + half)[:, None] + half[:, None] * NODES
    cosine, sine = np.cos(at)[:, :, None], np.sin(at)[:, :, None]
    one, two = rows[:, None, 3:6], rows[:, None, 6:9]
    n = (rows[:, None, :3] - centre + cosine * one + sine * two) / radius
    weight = (signs * half)[:, None] * WEIGHTS / radius
    return n.reshape(-1, 3), (weight[:, :, None] * (cosine * two - sine * one)).reshape(-1, 3)

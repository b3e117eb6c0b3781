"""Area and moments of faces, and the volume that they enclose.

By the divergence theorem, 3 V is the integral of x.n over all faces, and 4 times the volume's first
moment that of x (x.n). On planes, spheres and cylinders n is linear in x, so both follow from the
area's moments, which the kernel integrates once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane, GeomAbs_Sphere
from OCP.gp import gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_FORWARD
from OCP.TopoDS import TopoDS_Face

from tbcad_verify.step.kernel.shapes import between_arcs, triple
from tbcad_verify.types import Floats

Row = dict[str, Any]

# Arcs that are farther from where the kernel has a face end do not say what the kernel has read.
CLOSE_MM = 1e-5


@dataclass(frozen=True)
class AreaMoments:
    """Moments of a surface."""

    area: float  # mm^2
    middle: Floats  # (3,) mm
    second: Floats  # (3, 3) about the middle, mm^4


def measure_face(face: TopoDS_Face, origin: Floats, gap: float = 0.0) -> tuple[Row, Floats]:
    """A face's kind, figures, area and centroid; and the moments of what it encloses.

    `origin`: (3,) mm; errors of integration are least if it is in the middle of the solid.
    `gap`: how far edges may be from where the kernel has their faces end, mm.

    Returns:
        The figures as plain numbers, and (4,) the volume between face and origin and its first
        moment about the origin.
    """
    surface = BRepAdaptor_Surface(face)
    exact = _of_sphere(face, surface) if gap <= CLOSE_MM else None
    moments = exact or moments_of(face)
    row = {"area": moments.area, "centroid": moments.middle.tolist(), **_figures(face, surface)}
    return row, _enclosed(face, surface, moments, origin)


def _of_sphere(face: TopoDS_Face, surface: BRepAdaptor_Surface) -> AreaMoments | None:
    """Of a sphere between arcs; None for other faces."""
    if surface.GetType() != GeomAbs_Sphere or not surface.Sphere().Position().Direct():
        return None
    centre = np.array(triple(surface.Sphere().Location()))
    figures = between_arcs(face, centre, surface.Sphere().Radius())
    if figures is None:
        return None
    area, first, second = figures
    offset = first / area
    return AreaMoments(area, centre + offset, second - area * np.outer(offset, offset))


def moments_of(face: TopoDS_Face) -> AreaMoments:
    """Of any face, integrated by the kernel."""
    measured = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, measured)
    inertia = measured.MatrixOfInertia()
    matrix = np.array([[inertia.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
    return AreaMoments(
        measured.Mass(),
        np.array(triple(measured.CentreOfMass())),
        np.trace(matrix) / 2 * np.eye(3) - matrix,
    )


def _figures(face: TopoDS_Face, surface: BRepAdaptor_Surface) -> Row:
    """Kind and figures; `outward`: whether the natural normal points out of the solid."""
    if surface.GetType() == GeomAbs_Sphere:
        sphere = surface.Sphere()
        return {
            "kind": "sphere",
            "point": triple(sphere.Location()),
            "radius": sphere.Radius(),
            "outward": _outward(face, sphere),
        }
    if surface.GetType() == GeomAbs_Plane:
        plane = surface.Plane()
        axis, sign = triple(plane.Axis().Direction()), 1 if _outward(face, plane) else -1
        return {
            "kind": "plane",
            "point": triple(plane.Location()),
            "axis": axis,
            "normal": [sign * value for value in axis],
        }
    return {"kind": "other"}


def _outward(face: TopoDS_Face, figure: Any) -> bool:
    """Whether a plane's axis, or the way from a sphere's centre or axis, leads out of the solid."""
    return bool((face.Orientation() == TopAbs_FORWARD) == figure.Position().Direct())


def _enclosed(
    face: TopoDS_Face, surface: BRepAdaptor_Surface, moments: AreaMoments, origin: Floats
) -> Floats:
    """(4,) volume between a face and the origin, and its first moment about it."""
    kind, middle = surface.GetType(), moments.middle - origin
    if kind == GeomAbs_Plane:
        figure = surface.Plane()
        height = middle @ triple(figure.Axis().Direction()) * moments.area
        enclosed = np.append(height / 3, height * middle / 4)
    elif kind == GeomAbs_Sphere:
        figure = surface.Sphere()
        centre = np.array(triple(figure.Location())) - origin
        enclosed = _under_round(moments, middle, centre, centre, figure.Radius())
    elif kind == GeomAbs_Cylinder:
        figure = surface.Cylinder()
        centre = np.array(triple(figure.Location())) - origin
        axis = np.array(triple(figure.Axis().Direction()))
        across = centre - centre @ axis * axis
        enclosed = _under_round(moments, middle, centre, across, figure.Radius())
    else:
        return _integrated(face, origin)
    return enclosed if _outward(face, figure) else -enclosed


def _under_round(
    moments: AreaMoments, middle: Floats, centre: Floats, across: Floats, radius: float
) -> Floats:
    """(4,) of a face of a sphere or cylinder.

    The normal at centre + y is y / radius, of a cylinder only the part of y across the axis is
    counted; `across` is that part of the centre.
    """
    offset, area = middle - centre, moments.area
    second = moments.second + area * np.outer(offset, offset)
    height = area * (offset @ across / radius + radius)  # the integral of x.n
    first = height * centre + second @ across / radius + radius * area * offset
    return np.append(height / 3, first / 4)


def _integrated(face: TopoDS_Face, origin: Floats) -> Floats:
    """(4,) of any other face, by the kernel."""
    measured, domain = BRepGProp_Vinert(), BRepGProp_Domain(face)
    measured.SetLocation(gp_Pnt(*origin.tolist()))
    measured.Perform(BRepGProp_Face(face), domain)
    volume = measured.Mass()
    return np.append(volume, volume * (np.array(triple(measured.CentreOfMass())) - origin))

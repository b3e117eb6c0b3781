"""Moments of faces of spheres between arcs of circles, by integrals along the arcs.

With n the unit normal and p the middle of the outline, Stokes' theorem gives on the unit sphere
    area = integral of p.(n x dn) / (1 + p.n), up to whole spheres,
    integral of n over the face = 1/2 integral of n x dn,
    integral of n n^T over the face = (area + integral of n (n x dn)^T) / 3.
All are analytic along an arc: Gauss's rule is exact to rounding.
"""

from __future__ import annotations

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.GeomAbs import GeomAbs_Circle
from OCP.gp import gp_Circ
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD, TopAbs_WIRE
from OCP.TopoDS import TopoDS, TopoDS_Face

from tbcad_verify.step.kernel.topology import count, each, triple
from tbcad_verify.types import Floats

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
LONGEST = np.pi / 2 * 1.01  # of an arc that the rule integrates to rounding, rad
MIN_COSINE = 0.3  # of the outline's points to its middle: far from the pole of the integrals


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

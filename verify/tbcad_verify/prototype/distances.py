"""Distances of points from facets and from line segments."""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.vectors import dot, norm
from tbcad_verify.types import Floats, Ints


def distance_to_facets(point: Floats, mesh: Mesh, facets: Ints) -> float:
    """Minimum distance of a point (3,) from some facets of a mesh, mm; infinite without any.

    Facets without area are left out: their edges are their neighbours' too.
    """
    from trimesh.triangles import closest_point

    solid = facets[norm(mesh.area[:, facets]) > 0]
    triangles = mesh.points[mesh.faces[solid]]
    nearest = closest_point(triangles, np.broadcast_to(point, (len(triangles), 3)))
    return float(np.linalg.norm(nearest - point, axis=1).min(initial=np.inf))


def distances_to_segments(x: Floats, start: Floats, end: Floats) -> Floats:
    """(N,) distances of points from line segments, (3, N) each."""
    along = end - start
    t = dot(x - start, along) / np.maximum(dot(along, along), np.finfo(np.float64).tiny)
    return norm(x - start - np.clip(t, 0, 1) * along)

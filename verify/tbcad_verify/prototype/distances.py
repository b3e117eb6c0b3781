"""Distances of points from facets."""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.vectors import norm
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

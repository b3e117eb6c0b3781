"""Balls that touch a mesh from outside: how deep they cut into it elsewhere.

Distances are those from points to triangles. Candidates come from a k-d tree of corners: where the
nearest point of a triangle is d away, one of its corners is at most sqrt(d^2 + longest^2 / 3) away,
because no point of a triangle is farther than longest / sqrt(3) from its nearest corner.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from tbcad_verify.mesh.mesh import Mesh, longest_sides
from tbcad_verify.mesh.vectors import chunks, cross, dot, norm
from tbcad_verify.types import Bools, Floats, Ints

BALLS_AT_ONCE = 1 << 10
LARGE = 1.5  # times the median of the facets' longest sides: larger ones are halved
NOTHING_MM = 1e-4  # a ball that cuts in less deep than this stays out: float32 rounding


def cut_depths(mesh: Mesh, touched: Floats, normal: Floats, radius: float) -> Floats:
    """(N,) how deep each ball cuts into a mesh, mm; 0 for those that stay out.

    `touched`: (3, N) mm, where the balls touch the mesh.
    `normal`: (3, N) unit, from there to the balls' centres.
    """
    from trimesh.triangles import closest_point

    centre, depth = touched + radius * normal, np.zeros(touched.shape[1])
    longest = LARGE * float(np.median(longest_sides(mesh)))
    points, faces = _near(mesh, cKDTree(centre.T), radius, longest)
    tree, ends = cKDTree(points), np.arange(0, faces.size + 1, 3)
    corners = csr_array((np.ones(faces.size, np.bool_), faces.ravel(), ends)).T
    within = np.hypot(np.minimum(tree.query(centre.T)[0], radius), longest / np.sqrt(3))
    for part in chunks(depth.size, BALLS_AT_ONCE):
        found = tree.query_ball_point(centre[:, part].T, within[part], return_sorted=False)
        ends = np.cumsum([0, *map(len, found)])
        near = csr_array(
            (np.ones(ends[-1], np.bool_), np.concatenate(found), ends),
            shape=(len(found), len(points)),
        )
        ball, facet = (near @ corners).nonzero()
        ball = ball + part.start
        corner = points[faces[facet]]
        met = _in_the_way(corner - touched.T[ball, None], normal[:, ball], radius)
        ball, corner = ball[met], corner[met]
        nearest = closest_point(corner, centre.T[ball])
        np.maximum.at(depth, ball, radius - norm(nearest.T - centre[:, ball]))
    return np.where(depth < NOTHING_MM, 0.0, depth)


def _near(mesh: Mesh, centres: cKDTree, radius: float, longest: float) -> tuple[Floats, Ints]:
    """Points (V, 3), mm, and facets (F, 3) of the same surface, the large ones halved.

    Large facets that no ball comes near are left out. `longest`: of all sides, mm.
    """
    points, faces, small = mesh.points, mesh.faces, []
    while faces.size:
        corner = points[faces]
        side = np.linalg.norm(corner - np.roll(corner, -1, axis=1), axis=2)
        length, first = side.max(axis=1), side.argmax(axis=1)
        small.append(faces[length <= longest])
        turned = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
        middle = points[turned[:, :2]].mean(axis=1)
        large = np.flatnonzero(length > longest)
        large = large[centres.query(middle[large])[0] <= radius + length[large]]
        a, b, c = turned[large].T
        new = len(points) + np.arange(large.size)
        points = np.concatenate([points, middle[large]])
        faces = np.concatenate([np.stack([a, new, c], axis=1), np.stack([new, b, c], axis=1)])
    return points, np.concatenate(small)


def _in_the_way(corner: Floats, normal: Floats, radius: float) -> Bools:
    """(P,) triangles whose plane meets a ball, and that reach beyond its tangent plane.

    `corner`: (P, 3, 3) seen from where the ball touches, mm.
    """
    a, b, c = corner.transpose(1, 2, 0)
    area = cross(b - a, c - a)
    meets = np.abs(dot(area, radius * normal - a)) < (radius - NOTHING_MM) * norm(area)
    return np.asarray(meets & (np.max([dot(x, normal) for x in (a, b, c)], axis=0) > NOTHING_MM))

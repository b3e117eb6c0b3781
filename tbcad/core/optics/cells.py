"""Cells: the part of each mirror's sphere that no other covers, bounded by circular arcs."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tbcad.core.geometry.vectors import FLIP_X, dot, norm, unit
from tbcad.core.optics.power_diagram import PLANES, flip_until_regular, half_edges, radical_planes
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Bools, Floats, Ints

# Corners nearer to each other than this are one: far below any tolerance of manufacture, far above
# rounding.
MERGED_MM = 1e-4
ON_SEAM_MM = 1e-9  # of an apex from the seam, after a coat was taken off and put on again
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PARAMETER, STEP = (NODES + 1) / 2, WEIGHTS / 2  # from 0 to 1


@dataclass(frozen=True)
class Cells:
    """All cells of one camera's mirrors as one planar graph on shared corners (DESIGN.md 4).

    Faces are the m mirrors, then the seam and the foot plane. Three faces meet at every corner;
    where four cells meet in one point two corners coincide.
    """

    surfaces: Surfaces  # the m mirrors and the two planes
    triangles: Ints  # the three faces at each corner, counter-clockwise from outside, (t, 3)
    corners: Floats  # points, mm, (t, 3)
    coat: float = field(default=0.0, kw_only=True)  # mm, that the mirrors get; walls get none

    def __repr__(self) -> str:
        return f"<Cells: {self.mirrors} mirrors, {len(self.corners)} corners>"

    @property
    def mirrors(self) -> int:
        """Number of mirrors m."""
        return len(self.surfaces) - PLANES

    @property
    def seam(self) -> int:
        """Index of the seam's plane."""
        return self.mirrors

    @property
    def foot(self) -> int:
        """Index of the foot plane."""
        return self.mirrors + 1

    @property
    def mirror_surfaces(self) -> Surfaces:
        """The mirrors' surfaces without the two planes, over m of them."""
        return self.surfaces.subset(slice(self.mirrors))

    @property
    def halved(self) -> Bools:
        """Which mirrors (m,) the seam halves: those whose apices, on the coat, lie on it.

        Their other halves belong to the other camera and share their virtual cameras.
        """
        reflecting = self.mirror_surfaces.offset(self.coat)
        return np.asarray(np.abs(reflecting.apex[:, 0]) < ON_SEAM_MM)

    def mirrored(self) -> "Cells":
        """The other camera's cells: mirror image in the plane x = 0."""
        turned = self.triangles[:, ::-1]
        return Cells(self.surfaces.mirrored(), turned, self.corners * FLIP_X, coat=self.coat)

    @cached_property
    def arcs(self) -> "Arcs":
        """The arcs between cells, one for each pair of faces that touch."""
        return _arcs(self)

    @cached_property
    def rings(self) -> tuple[Ints, Ints]:
        """Sides of each mirror's cell, counter-clockwise from outside.

        Offsets (m + 1,) into the list of sides, and the sides: arc a as 2 a where the cell follows
        it from start to end, 2 a + 1 where it goes back along it.
        """
        return rings_of(self.triangles, self.mirrors, self.arcs.side_of_half_edge)


@dataclass(frozen=True)
class Arcs:
    """Circular arcs as rational quadratic curves, which hold straight lines too, over e arcs."""

    left: Ints  # face that has the arc counter-clockwise (from outside) from start to end, (e,)
    right: Ints  # the other face, (e,)
    start: Ints  # corner indices, (e,)
    end: Ints  # corner indices, (e,)
    points: Floats  # start, control and end points, mm, (e, 3, 3)
    weight: Floats  # weight of the control point, the cosine of half the arc's angle, (e,)
    # for each directed edge of the dual triangulation 2 a or 2 a + 1 for arc a forward or back; -1
    # between the two planes and where corners were merged
    side_of_half_edge: Ints

    def __len__(self) -> int:
        return len(self.left)

    @property
    def faces(self) -> Ints:
        """The two faces at each arc, (e, 2)."""
        return np.column_stack([self.left, self.right])

    @property
    def length(self) -> Floats:
        """Distance of each arc's ends, mm, (e,)."""
        return np.asarray(norm(self.points[:, 2] - self.points[:, 0]))

    def at(self, arc: Ints, t: Floats) -> Floats:
        """Points (..., 3) on arcs (...) at parameters t (...) in [0, 1]."""
        basis = np.stack([(1 - t) ** 2, 2 * t * (1 - t) * self.weight[arc], t**2], axis=-1)
        weighted = np.einsum("...k,...kx->...x", basis, self.points[arc])
        # Columns add up five times as fast as each row's three numbers.
        total = basis[..., 0] + basis[..., 1] + basis[..., 2]
        return np.asarray(weighted / total[..., None])


def rings_of(triangles: Ints, mirrors: int, side_of_half_edge: Ints) -> tuple[Ints, Ints]:
    """Sides round each of m mirrors' cells, as `Cells.rings` has them.

    Triangles (t, 3) are counter-clockwise from outside, the mirrors being the first faces; each
    directed edge of them has a side, -1 for none, (3 t,).
    """
    ends, twin = half_edges(triangles)
    _, first = np.unique(ends[:, 0], return_index=True)
    degree = np.bincount(ends[:, 0], minlength=mirrors)[:mirrors]
    around = [first[:mirrors]]
    for _ in range(int(degree.max()) - 1):
        before = around[-1] // 3 * 3 + (around[-1] + 2) % 3
        around.append(twin[before])
    table = np.stack(around, axis=1)
    sides = side_of_half_edge[table]
    listed = (np.arange(table.shape[1]) < degree[:, None]) & (sides >= 0)
    return np.concatenate([[0], np.cumsum(listed.sum(axis=1))]), sides[listed]


def _arcs(cells: Cells) -> Arcs:
    """Arcs in closed form from corners and gradients there; nearer than MERGED_MM are one."""
    ends, twin = half_edges(cells.triangles)
    edge = np.flatnonzero((np.arange(len(ends)) < twin) & (ends.min(axis=1) < cells.mirrors))
    between = np.column_stack([twin[edge] // 3, edge // 3])
    gap = norm(np.diff(cells.corners[between], axis=1)[:, 0])
    between = _merged(between, gap < MERGED_MM, len(cells.corners))
    edge, (start, end) = edge[gap >= MERGED_MM], between[gap >= MERGED_MM].T
    side = np.full(len(ends), -1)
    side[edge] = 2 * np.arange(len(edge))
    side[twin[edge]] = side[edge] + 1
    left, right = ends[edge].T
    points, weight = _curves(cells.surfaces, left, right, cells.corners[start], cells.corners[end])
    return Arcs(left, right, start, end, points, weight, side)


def _merged(between: Ints, short: Bools, corners: int) -> Ints:
    """Corner indices with those joined by short arcs replaced by the first of them."""
    if not short.any():
        return between
    graph = coo_array((np.ones(short.sum()), between[short].T), shape=(corners, corners))
    _, group = connected_components(graph, directed=False)
    _, first = np.unique(group, return_index=True)
    return np.asarray(first[group][between])


def _curves(
    surfaces: Surfaces, left: Ints, right: Ints, start: Floats, end: Floats
) -> tuple[Floats, Floats]:
    """Control polygon (e, 3, 3) and weight (e,) of the arc that the two faces have in common."""
    swap = surfaces.curvature[right] > surfaces.curvature[left]
    p, q = np.where(swap, right, left), np.where(swap, left, right)
    plane, _ = radical_planes(surfaces, p, q)
    return plane_sections(surfaces, p, unit(plane), start, end)


def plane_sections(
    surfaces: Surfaces, p: Ints, plane: Floats, start: Floats, end: Floats
) -> tuple[Floats, Floats]:
    """Control polygon (e, 3, 3) and weight (e,) of arcs in which planes cut surfaces p (e,).

    Planes have unit normals (e, 3); arcs start and end on both, mm, (e, 3).
    """
    chord = end - start
    half = norm(chord) / 2
    tilt = dot(surfaces.gradient(p, start), plane)
    sine = half * surfaces.curvature[p] / np.sqrt(1 - tilt**2)
    cosine = np.sqrt(1 - sine**2)
    middle = (start + end) / 2
    along = unit(chord)
    outward = np.cross(plane, along)
    outward *= np.sign(dot(outward, surfaces.gradient(p, middle)))[:, None]
    control = middle + (half * sine / cosine)[:, None] * outward
    return np.stack([start, control, end], axis=1), cosine


def cells_of(surfaces: Surfaces, triangles: Ints) -> Cells:
    """Cells of m mirrors between seam and foot; surfaces are the mirrors, then the two planes.

    The dual triangulation (t, 3) is right or nearly so; NotRegularError if there are no proper
    cells.
    """
    return Cells(surfaces, *flip_until_regular(surfaces, triangles))


def cell_areas(cells: Cells) -> Floats:
    """Areas of the cells in closed form, mm^2, (m,).

    A spherical polygon of small-circle arcs by Gauss and Bonnet: the area over r^2 is 2 pi less
    the exterior angles at the corners and the integrals of geodesic curvature along the arcs.
    Cells of planar mirrors are plane polygons, as all their neighbours are planar.
    """
    offsets, sides = cells.rings
    arc, back = sides // 2, sides % 2
    points = cells.arcs.points[arc]
    points[back == 1] = points[back == 1][:, ::-1]
    mirror = np.repeat(np.arange(cells.mirrors), np.diff(offsets))
    if np.all(cells.surfaces.curvature == 0):
        return np.add.reduceat(_plane_areas(cells, mirror, points), offsets[:-1])
    angles = np.add.reduceat(_turning_angles(cells, mirror, points, offsets), offsets[:-1])
    return (2 * np.pi - angles) / cells.surfaces.curvature[: cells.mirrors] ** 2


def _plane_areas(cells: Cells, mirror: Ints, points: Floats) -> Floats:
    """Signed area of the triangle of each side and the mirror's apex, mm^2."""
    from_apex = points - cells.surfaces.apex[mirror][:, None]
    outside = -cells.surfaces.normal[mirror]
    return dot(np.cross(from_apex[:, 0], from_apex[:, 2]), outside) / 2


def _turning_angles(cells: Cells, mirror: Ints, points: Floats, offsets: Ints) -> Floats:
    """Exterior angle after each side and geodesic curvature along it, seen from outside."""
    outside = -cells.surfaces.gradient(mirror, points[:, 2])
    tangents = unit(np.diff(points, axis=1))
    following = np.arange(len(points)) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    before, after = tangents[:, 1], tangents[following, 0]
    exterior = np.arctan2(dot(np.cross(before, after), outside), dot(before, after))
    # Geodesic curvature of a circle of angular radius b is cot b / r; its integral is the rotation
    # of the tangent along the arc times cos b.
    start, control, end = points[:, 0], points[:, 1], points[:, 2]
    rotation = 2 * np.arctan2(norm(control - (start + end) / 2), norm(end - start) / 2)
    axis = unit(np.cross(control - start, end - control))
    return exterior + rotation * dot(axis, outside)


@dataclass(frozen=True)
class FaceIntegrals:
    """Integrals over faces, by which they add up to those of a solid."""

    origin: Floats  # any point near the faces, mm, (3,): errors grow with its distance
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


def cell_integrals(cells: Cells, origin: Floats) -> FaceIntegrals:
    """Integrals over the cells of mirrors that are all spherical, with an origin (3,), mm.

    By those of 1, n and n n^T over each cell, with n the unit normal away from the sphere's centre:
    the volume is a third of the integral of x.n, its moment a quarter of that of x (x.n).
    """
    m = cells.mirrors
    mirrors, arcs = cells.mirror_surfaces, cells.arcs
    radius = mirrors.radius
    centre = mirrors.apex - radius[:, None] * mirrors.normal
    area, first, second = cell_areas(cells), np.zeros((m, 3)), np.zeros((m, 3, 3))
    # Arcs run counter-clockwise about the cell on their left seen from behind the mirrors.
    for face, sign in ((arcs.left, -1.0), (arcs.right, 1.0)):
        mine = np.flatnonzero(face < m)
        of = face[mine]
        n, turning = _along(arcs, mine, centre[of], radius[of])
        np.add.at(first, of, sign * turning.sum(axis=1) / 2)
        np.add.at(second, of, sign * np.einsum("eki,ekj->eij", n, turning))
    centre, square, size = centre - origin, radius[:, None] ** 2, radius[:, None]
    first, second = square * first, (area[:, None, None] * np.eye(3) + square[:, None] * second) / 3
    cones = np.einsum("mi,mi->m", centre, first) + radius * area
    around = np.einsum("mij,mj->mi", second, centre) + size * first
    moment = (cones[:, None] * centre + size * around).sum(axis=0) / 4
    return FaceIntegrals(origin, float(cones.sum()) / 3, moment, float(area.sum()))


def _along(arcs: Arcs, arc: Ints, centre: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Unit normals (e, k, 3) at the nodes of arcs, and n x dn there, by the weights."""
    x, dx = _places(arcs, arc)
    n = (x - centre[:, None]) / radius[:, None, None]
    return n, np.cross(n, dx / radius[:, None, None]) * STEP[:, None]


def arc_steps(arcs: Arcs, arc: Ints) -> tuple[Floats, Floats]:
    """Points (e, k, 3) on arcs (e,), mm, and the steps along the arcs that each stands for."""
    x, dx = _places(arcs, arc)
    return x, dx * STEP[:, None]


def _places(arcs: Arcs, arc: Ints) -> tuple[Floats, Floats]:
    """Points (e, k, 3) at the nodes of arcs (e,), and their derivatives by the parameter."""
    t, weight = PARAMETER, arcs.weight[arc][:, None]
    points = arcs.points[arc]
    basis = np.stack(np.broadcast_arrays((1 - t) ** 2, 2 * t * (1 - t) * weight, t**2), axis=-1)
    slope = np.stack(np.broadcast_arrays(2 * t - 2, (2 - 4 * t) * weight, 2 * t), axis=-1)
    above, below = basis @ points, basis.sum(axis=-1)[..., None]
    x = above / below
    return x, (slope @ points - slope.sum(axis=-1)[..., None] * x) / below

"""Meshes of solids by the kernel's mesher, and volumes by booleans of such meshes.

Primitives are meshed without the CAD kernel: a circle becomes a regular polygon of the same area,
so that round bodies keep their volume.
"""

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, Mesh64, OpType
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.solids import faces
from tbcad.core.geometry.primitives import Cylinder, Primitive, Prism, Revolved, Slot, slot_parts
from tbcad.core.geometry.vectors import perpendicular_axes, unit
from tbcad.types import Floats, Ints

SIDES = 48
ANGLE = 0.2  # facets of cylinders and cones: no coarser than a turn of this angle (radians)
# The kernel's mesher sometimes merges the ends of an edge shorter than this on one side only.
MERGE_MM = 2e-5


def growth(angle: float) -> float:
    """Radius of a polygon to that of a circle of the same area, by the angle of a side, radians."""
    return float(np.sqrt(angle / np.sin(angle)))


GROWTH = growth(2 * np.pi / SIDES)


def primitive_mesh(body: Primitive) -> Manifold:
    """The mesh of a primitive in its place."""
    if isinstance(body, Cylinder):
        rod = Manifold.cylinder(body.length, GROWTH * body.radius, circular_segments=SIDES)
        axes = np.vstack([perpendicular_axes(body.axis), body.axis])
        return moved_mesh(rod, axes, body.start)
    if isinstance(body, Revolved):
        z, r = body.profile.T
        ring = Manifold.revolve(_section(np.column_stack([GROWTH * r, z])), SIDES)
        return moved_mesh(ring, body.axes, body.start)
    if isinstance(body, Slot):
        parts = [primitive_mesh(part) for part in slot_parts(body)]
        return Manifold.batch_boolean(parts, OpType.Add)
    return _prism_mesh(body)


def moved_mesh(mesh: Manifold, axes: Floats, origin: Floats) -> Manifold:
    """A mesh moved: axes (3, 3) are what x, y and z become, as rows; origin what 0 becomes."""
    return mesh.transform(np.column_stack([axes.T, origin]))


def _prism_mesh(body: Prism) -> Manifold:
    """The section in the plane of its first three corners, extruded along the third axis."""
    first = unit(body.corners[1] - body.corners[0])
    normal = unit(np.cross(first, body.corners[2] - body.corners[0]))
    across = np.stack([first, np.cross(normal, first)])
    section = (body.corners - body.corners[0]) @ across.T
    unit_high = Manifold.extrude(_section(section), 1.0)
    return moved_mesh(unit_high, np.vstack([across, body.along]), body.corners[0])


def _section(outline: Floats) -> CrossSection:
    return CrossSection([outline], FillRule.NonZero)


def mesh_difference(bodies: Sequence[Manifold], tools: Sequence[Manifold]) -> Manifold:
    """A union without tools: another way to the same solid."""
    union = Manifold.batch_boolean(bodies, OpType.Add)
    return Manifold.batch_boolean([union, *tools], OpType.Subtract)


def mesh_of(body: Manifold) -> Mesh:
    """Vertices and triangles of the result of booleans."""
    net = body.to_mesh64()
    return Mesh(np.asarray(net.vert_properties)[:, :3], np.asarray(net.tri_verts, dtype=np.int64))


def volume_by_cut_mesh(
    shape: TopoDS_Shape, planes: Floats, tools: Sequence[TopoDS_Shape], tolerance: float
) -> float:
    """Volume of a shape below planes (h, 4), unit normal and level, and without tools."""
    net = as_manifold(shape, tolerance)
    for *normal, level in (-planes).tolist():
        net = net.trim_by_plane(normal, level)
    removed = [as_manifold(one, tolerance) for one in tools]
    return float(Manifold.batch_boolean([net, *removed], OpType.Subtract).volume())


def as_manifold(shape: TopoDS_Shape, tolerance: float) -> Manifold:
    """The mesh of a solid for booleans of meshes."""
    net = meshed(shape, tolerance)
    return Manifold(Mesh64(net.vertices, net.triangles.astype(np.uint64)))


def meshed(shape: TopoDS_Shape, tolerance: float, angle: float = ANGLE) -> Mesh:
    """Mesh by the kernel's mesher; corners that faces share are one, degenerate facets dropped.

    Facets are within a tolerance (mm) of the surface, and turn by at most an angle (radians) along
    an edge. A solid's own facets are left alone.
    """
    copy = BRepBuilderAPI_Copy(shape, True, False).Shape()
    BRepMesh_IncrementalMesh(copy, tolerance, False, angle, False)
    points, triangles, start = [], [], 0
    for face in faces(copy):
        corner, facet = _facets(face)
        points.append(corner)
        triangles.append(facet + start)
        start += len(corner)
    return _joined(np.concatenate(points), np.concatenate(triangles))


def _facets(face: TopoDS_Face) -> tuple[Floats, Ints]:
    place = TopLoc_Location()
    net = BRep_Tool.Triangulation_s(face, place)
    if net is None:
        raise InvalidSolidError("the kernel cannot mesh a face")
    nodes = (net.Node(i) for i in range(1, net.NbNodes() + 1))
    if not place.IsIdentity():
        move = place.Transformation()
        nodes = (node.Transformed(move) for node in nodes)
    corners = [node.Coord() for node in nodes]
    facets = [net.Triangle(i).Get() for i in range(1, net.NbTriangles() + 1)]
    triangle = np.array(facets, dtype=np.int64).reshape(-1, 3) - 1
    if face.Orientation() == TopAbs_REVERSED:
        triangle = triangle[:, ::-1]
    return np.array(corners), triangle


def _joined(points: Floats, triangles: Ints) -> Mesh:
    """Corners that agree to a nanometre become one; facets that lose a corner go."""
    _, first, of = np.unique(np.round(points, 6), axis=0, return_index=True, return_inverse=True)
    return without_degenerate(points[first], of.reshape(-1)[triangles])


def welded(mesh: Mesh) -> Mesh:
    """The mesh with corners that are the same to MERGE_MM made one, and lost facets dropped."""
    pairs = cKDTree(mesh.vertices).query_pairs(MERGE_MM, output_type="ndarray")
    size = len(mesh.vertices)
    near = coo_array((np.ones(len(pairs)), pairs.T), shape=(size, size))
    _, group = connected_components(near, directed=False)
    _, first = np.unique(group, return_index=True)
    return without_degenerate(mesh.vertices[first], group.astype(np.int64)[mesh.triangles])


def without_degenerate(vertices: Floats, triangles: Ints) -> Mesh:
    """A mesh without the facets of which two corners became one."""
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return Mesh(vertices, triangles[whole])

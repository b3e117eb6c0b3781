"""What a drawing gives sizes of: round holes, pins, and the levels of plane faces."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from OCP.Bnd import Bnd_Box
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools
from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane
from OCP.gp import gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape

from tbcad.cad.kernel.meshing import meshed
from tbcad.cad.kernel.solids import faces
from tbcad.types import Floats

SAME_MM, SAME_COS = 1e-3, 1e-6
HOLE_DEG, SLOT_DEG = 200.0, 150.0  # least angles of the wall of a hole, and of the end of a slot
PROBE_MM, MESH_MM = 0.2, 0.05  # beyond the end of a hole; of the mesh that tells inside
FULL_DEG = 360.0
PLANE_COS = 1 - 1e-9


@dataclass(frozen=True, eq=False)
class RoundFace:
    """Cylindrical faces on one axis, with one radius."""

    start: Floats  # of the axis within them, mm, (3,)
    end: Floats  # of it
    radius: float  # mm
    turn_deg: float  # angle of all faces together; 360 for a whole hole or pin
    hollow: bool  # a hole, not a pin
    open_start: bool = False  # whether there is no material beyond the start
    open_end: bool = False  # likewise

    @property
    def axis(self) -> Floats:
        """From start to end, a unit vector, (3,)."""
        return np.asarray((self.end - self.start) / self.length)

    @property
    def length(self) -> float:
        """Along the axis, mm."""
        return float(np.linalg.norm(self.end - self.start))


def bounds(shape: TopoDS_Shape) -> Floats:
    """Least and greatest coordinates of a shape, mm, (2, 3)."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    x, y, z, right, back, high = box.Get()
    return np.array([[x, y, z], [right, back, high]])


def distance(shape: TopoDS_Shape, point: Floats) -> float:
    """Least distance of a point (mm, (3,)) from a shape, mm."""
    vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*point.tolist())).Vertex()
    return float(BRepExtrema_DistShapeShape(vertex, shape).Value())


def round_faces(some: Iterable[TopoDS_Face]) -> list[RoundFace]:
    """Cylindrical faces among some, as of `cylinders`, whose ends are not looked at."""
    walls = [wall for face in some if (wall := _wall(face))]
    return [_joined(group) for group in _groups(walls)]


def cylinders(shape: TopoDS_Shape) -> list[RoundFace]:
    """All cylindrical faces, those with one axis and radius that meet as one."""
    found = round_faces(faces(shape))
    holes = [k for k, one in enumerate(found) if one.hollow]
    if holes:
        reach = np.array([PROBE_MM * found[k].axis for k in holes])
        ends = np.array([[found[k].start, found[k].end] for k in holes])
        beyond = ends + np.stack([-reach, reach], axis=1)
        mesh = meshed(shape, MESH_MM)
        whole = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        is_open = ~whole.contains(beyond.reshape(-1, 3)).reshape(-1, 2)
        for k, (start, end) in zip(holes, is_open.tolist(), strict=True):
            found[k] = replace(found[k], open_start=start, open_end=end)
    return found


def plane_levels(shape: TopoDS_Shape, direction: Floats) -> list[tuple[float, float]]:
    """Levels of plane faces across a direction, mm, and the faces' areas, mm2; by level."""
    areas: dict[float, float] = {}
    for face in faces(shape):
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() != GeomAbs_Plane:
            continue
        plane = surface.Plane()
        normal = np.array(plane.Axis().Direction().Coord())
        if abs(normal @ direction) < PLANE_COS:
            continue
        level = round(float(np.array(plane.Location().Coord()) @ direction), 2) + 0.0
        areas[level] = areas.get(level, 0.0) + _area(face)
    return sorted(areas.items())


def _area(face: TopoDS_Face) -> float:
    found = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, found)
    return float(found.Mass())


def _wall(face: TopoDS_Face) -> RoundFace | None:
    """A cylindrical face; its ends are not looked at."""
    surface = BRepAdaptor_Surface(face)
    if surface.GetType() != GeomAbs_Cylinder:
        return None
    cylinder = surface.Cylinder()
    u_low, u_high, *reach = BRepTools.UVBounds_s(face)
    point = np.array(cylinder.Location().Coord())
    direction = np.array(cylinder.Axis().Direction().Coord())
    start, end = (point + at * direction for at in reach)
    if tuple(np.round(direction, 6)) < (0, 0, 0):
        start, end = end, start
    # Outward of the surface is away from the axis where its axes are right-handed.
    outward = cylinder.Direct() == (face.Orientation() != TopAbs_REVERSED)
    turn = float(np.degrees(u_high - u_low))
    return RoundFace(start, end, cylinder.Radius(), turn, hollow=not outward)


def _groups(walls: Iterable[RoundFace]) -> list[list[RoundFace]]:
    """Walls on one axis with one radius whose reaches meet."""
    groups: list[list[RoundFace]] = []
    for wall in walls:
        near = [group for group in groups if any(_meet(wall, one) for one in group)]
        joined = [wall, *(one for group in near for one in group)]
        groups = [*(group for group in groups if group not in near), joined]
    return groups


def _meet(one: RoundFace, other: RoundFace) -> bool:
    if one.hollow != other.hollow or abs(one.radius - other.radius) > SAME_MM:
        return False
    if abs(one.axis @ other.axis) < 1 - SAME_COS:
        return False
    if np.linalg.norm(np.cross(other.start - one.start, one.axis)) > SAME_MM:
        return False
    low, high = _reach(other, one)
    return low <= one.length + SAME_MM and high >= -SAME_MM


def _reach(wall: RoundFace, first: RoundFace) -> tuple[float, float]:
    """Reach of a wall along the axis of another, from the start of that."""
    ends = sorted(float((end - first.start) @ first.axis) for end in (wall.start, wall.end))
    return ends[0], ends[1]


def _joined(group: Sequence[RoundFace]) -> RoundFace:
    first = group[0]
    reaches = [_reach(wall, first) for wall in group]
    low, high = min(one[0] for one in reaches), max(one[1] for one in reaches)
    turn = sum(wall.length * wall.turn_deg for wall in group) / (high - low)
    start, end = first.start + low * first.axis, first.start + high * first.axis
    return replace(first, start=start, end=end, turn_deg=min(turn, FULL_DEG))

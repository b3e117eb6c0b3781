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


@dataclass(frozen=True)
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


@dataclass(frozen=True, eq=False)
class _Wall:
    """A cylindrical face: its axis by a point and a direction, and its reach along and round it."""

    point: Floats
    direction: Floats
    radius: float
    reach: tuple[float, float]
    turn_deg: float
    hollow: bool


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


def _wall(face: TopoDS_Face) -> _Wall | None:
    surface = BRepAdaptor_Surface(face)
    if surface.GetType() != GeomAbs_Cylinder:
        return None
    cylinder = surface.Cylinder()
    u_low, u_high, low, high = BRepTools.UVBounds_s(face)
    direction = np.array(cylinder.Axis().Direction().Coord())
    # Outward of the surface is away from the axis where its axes are right-handed.
    outward = cylinder.Direct() == (face.Orientation() != TopAbs_REVERSED)
    return _Wall(
        point=np.array(cylinder.Location().Coord()),
        direction=direction,
        radius=cylinder.Radius(),
        reach=(low, high),
        turn_deg=float(np.degrees(u_high - u_low)),
        hollow=not outward,
    )


def _groups(walls: Iterable[_Wall]) -> list[list[_Wall]]:
    """Walls on one axis with one radius whose reaches meet."""
    groups: list[list[_Wall]] = []
    for wall in walls:
        near = [group for group in groups if any(_meet(wall, one) for one in group)]
        joined = [wall, *(one for group in near for one in group)]
        groups = [*(group for group in groups if group not in near), joined]
    return groups


def _meet(one: _Wall, other: _Wall) -> bool:
    if one.hollow != other.hollow or abs(one.radius - other.radius) > SAME_MM:
        return False
    if abs(one.direction @ other.direction) < 1 - SAME_COS:
        return False
    between = other.point - one.point
    if np.linalg.norm(np.cross(between, one.direction)) > SAME_MM:
        return False
    low, high = _reach(other, one.point, one.direction)
    return low <= one.reach[1] + SAME_MM and high >= one.reach[0] - SAME_MM


def _reach(wall: _Wall, point: Floats, direction: Floats) -> tuple[float, float]:
    """Reach of a wall along an axis that is its own, from a point of it."""
    ends = sorted(
        float((wall.point + at * wall.direction - point) @ direction) for at in wall.reach
    )
    return ends[0], ends[1]


def _joined(group: Sequence[_Wall]) -> RoundFace:
    first = group[0]
    direction = first.direction * (-1.0 if tuple(np.round(first.direction, 6)) < (0, 0, 0) else 1.0)
    reaches = [_reach(wall, first.point, direction) for wall in group]
    low, high = min(one[0] for one in reaches), max(one[1] for one in reaches)
    areas = sum((wall.reach[1] - wall.reach[0]) * wall.turn_deg for wall in group)
    start, end = first.point + low * direction, first.point + high * direction
    return RoundFace(start, end, first.radius, min(areas / (high - low), FULL_DEG), first.hollow)

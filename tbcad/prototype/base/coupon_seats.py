"""One seat of the coupon: a leg below each pad, round a core with the magnet's pocket, on a keel.

A leg has the carrier's wall for a wall's thickness beside its pad; what the carrier has between the
legs touches no ball and takes most of the time to print. In the seat's own frame, with the ball's
centre at the origin and the seat's axis along z, unless said otherwise.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid
from scipy.spatial import ConvexHull

from tbcad.cad.kernel.brep import Maker
from tbcad.cad.kernel.solids import (
    cut,
    cylinder,
    faces,
    fused,
    moved,
    polygon,
    prism,
    reversed_faces,
    revolved_polygon,
)
from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.seat_solids import seat_room, with_posts
from tbcad.prototype.base.seats import Seats
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.printed import opening_up
from tbcad.types import Floats

UPRIGHT = 1e-9  # of an axis's level part: a seat without a lean
DECIMALS = 6  # to which seats face up alike
SAME_POSE = np.sin(np.radians(1))  # between the axes of two poses that are taken for the same
KEEL_MM = 3.0  # thickness of the plate below a seat
INSIDE_MM = 0.3  # from the wall's faces to the upper edges of that plate
# Of the core beyond the foot: with the same radius, faces would lie on each other.
BEYOND_FOOT_MM = 0.5
RIM_MM = 1.3  # width of the core's upper end, round the cup
BEYOND_MM = 1.0  # of what is cut away beyond the seat
ROUNDING_MM = 1e-6
UP = np.eye(3)[2]


@dataclass(frozen=True)
class SeatPose:
    """A seat on the bed."""

    # rows of the seat's own frame along the bed's x, y and z; the axis leans toward y, (3, 3)
    axes: Floats
    pad_azimuth: float  # of its first pad about its axis, radians

    @property
    def lean(self) -> float:
        """Angle between the seat's axis and straight down, radians."""
        return float(np.arctan2(self.axes[2, 1], -self.axes[2, 2]))

    def is_like(self, other: "SeatPose") -> bool:
        """Whether pads and cup lie nearly alike."""
        apart = float(np.abs(self.axes - other.axes).max())
        return bool(max(apart, abs(self.pad_azimuth - other.pad_azimuth)) < SAME_POSE)


def expected_downs(base: BaseLayout, split: BaseSplit) -> list[Floats]:
    """For each piece the direction (3,) that is probably down when it is printed.

    In the frame of the shell, as all directions here. It is where the piece's pads face up, unless
    the bed is too small for that.
    """
    downs = []
    for seats in _seats_of_pieces(base, split):
        down = np.asarray(-base.frame[0])
        if seats:
            opening = opening_up(base.seats.pad_normals[seats].reshape(-1, 3))
            axes = base.seats.axis[seats]
            down = unit(axes.sum(axis=0)) if opening is None else opening
        downs.append(down)
    return downs


def worst_pose(base: BaseLayout, split: BaseSplit, downs: Sequence[Floats]) -> SeatPose:
    """Pose of the seat with the pad that is nearest to facing down; of several, that leans most.

    downs are the directions (3,) that are down when each piece is printed.
    """
    seats, pieces = base.seats, _seats_of_pieces(base, split)
    down = {k: way for way, in_piece in zip(downs, pieces, strict=True) for k in in_piece}

    def height_of_pads(k: int) -> tuple[float, float]:
        lowest = float((seats.pad_normals[k] @ -down[k]).min())
        return round(lowest, DECIMALS), float(seats.axis[k] @ down[k])

    worst = min(down, key=height_of_pads)
    return SeatPose(
        seats.axes[worst] @ _bed(seats.axis[worst], down[worst]), float(seats.pad_azimuth[worst])
    )


def _seats_of_pieces(base: BaseLayout, split: BaseSplit) -> list[list[int]]:
    seats = base.local_seats
    piece = [split.piece_of(end) for end in seats.at_depth(seats.back)]
    return [[k for k, at in enumerate(piece) if at == n] for n in range(len(split.pieces))]


def _bed(axis: Floats, down: Floats) -> Floats:
    """Columns x, y and z of a bed on which an axis leans toward y, (3, 3)."""
    level = axis - (axis @ down) * down
    if norm(level) < UPRIGHT:
        level = np.cross(down, np.eye(3)[int(np.abs(down).argmin())])
    y = unit(level)
    return np.column_stack([np.cross(y, -down), y, -down])


def seat_body(seats: Seats, spec: BaseSpec, k: int, pose: SeatPose, to_bar: float) -> TopoDS_Shape:
    """Seat k without its pads, with its keel to a bar at y = to_bar, mm.

    Along the bed's axes, with the ball's centre at 0; seats are those of `coupon_seats`.
    """
    wall = revolved_polygon(wall_section(seats, spec, k), 0.0, 2 * np.pi)
    legs = cut(wall, list(_between_legs(seats, spec, k)))
    keel = prism(polygon(keel_corners(seats, spec, k, pose, to_bar)), KEEL_MM * np.eye(3)[0])
    legs, room = (moved(one, pose.axes, np.zeros(3)) for one in (legs, seat_room(seats, k)))
    return cut(fused([legs, keel]), [room])


def with_pads(
    body: TopoDS_Shape, seats: Seats, k: int, offset: float, pose: SeatPose
) -> TopoDS_Solid:
    """A seat's body with its pads, moved off the ball by an offset, mm.

    Face by face: seats of one size are then cut out once for all offsets. The body's faces,
    reversed, bound the room in it.
    """
    room = with_posts(reversed_faces(faces(body)), seats, k, offset, pose.axes)
    return Maker(mirrored=False).solid(reversed_faces(room))


def _between_legs(seats: Seats, spec: BaseSpec, k: int) -> Iterator[TopoDS_Shape]:
    """Cuts between two legs each, outside the core."""
    core, boss = core_radius(seats, spec, k), float(seats.boss[k])
    if core >= boss:
        return
    apex = _between_mm(seats, spec, k)
    low, top = float(seats.front[k]) - BEYOND_MM, core_top(seats, spec, k)
    end = float(seats.back[k]) + BEYOND_MM
    length, inner = end - low, cylinder(top * UP, UP, core, end - top)
    for azimuth in _leg_azimuths(seats, k):
        ends = np.array([azimuth, azimuth + 2 * np.pi / 3])
        first = apex * unit_circle(ends.mean())
        corners = np.vstack([first, first + 2 * boss * unit_circle(ends)])
        plane = polygon(np.column_stack([corners, np.full(3, low)]))
        yield cut(prism(plane, length * UP), [inner])


def _leg_azimuths(seats: Seats, k: int) -> Floats:
    """Of the middles of the legs, radians, (3,)."""
    return np.asarray(float(seats.pad_azimuth[k]) + np.arange(3) * 2 * np.pi / 3)


def _half_leg(seats: Seats, spec: BaseSpec, k: int) -> float:
    """Half the width of a leg, mm."""
    return float(seats.pad[k]) + spec.cup_wall_mm


def _between_mm(seats: Seats, spec: BaseSpec, k: int) -> float:
    """Distance from the axis at which the sides of two legs meet, mm."""
    return _half_leg(seats, spec, k) / float(np.sin(np.pi / 3))


def core_radius(seats: Seats, spec: BaseSpec, k: int) -> float:
    """Radius of what stays whole round the pocket, mm; no less than the boss where no leg is.

    The cup is as wide as where two legs meet before the core begins: else a knife edge is between.
    """
    foot = float(wall_section(seats, spec, k)[-2, 1]) + BEYOND_FOOT_MM
    return max(foot, _between_mm(seats, spec, k) + RIM_MM)


def core_top(seats: Seats, spec: BaseSpec, k: int) -> float:
    """Where the core begins along the axis, mm: its rim round the cup is no knife edge."""
    core, front = core_radius(seats, spec, k), float(seats.front[k])
    inner = max(core - RIM_MM, float(seats.pocket[k]))
    whole = core >= seats.boss[k]
    return front if whole else float(np.sqrt(max(seats.cup[k] ** 2 - inner**2, front**2)))


def wall_section(seats: Seats, spec: BaseSpec, k: int) -> Floats:
    """Half section (z, r) of what legs and hollow are cut out of, (n, 2)."""
    front, back, boss = float(seats.front[k]), float(seats.back[k]), float(seats.boss[k])
    cone = _cone(seats, spec, k)
    foot = max(cone - back, float(seats.pocket[k]) + spec.cup_wall_mm)
    if foot >= boss:
        slope = [[back, boss]]
    else:
        slope = [[cone - boss, boss], [cone - foot, foot]]
        if cone - foot < back - ROUNDING_MM:
            slope.append([back, foot])
    return np.array([[front, 0.0], [front, boss], *slope, [back, 0.0]])


def _cone(seats: Seats, spec: BaseSpec, k: int) -> float:
    """Sum z + r on the cone of 45 degrees that is tangent to the sphere round the cup, mm."""
    return float(np.sqrt(2) * (seats.cup[k] + spec.cup_wall_mm))


def outline(seats: Seats, spec: BaseSpec, k: int, lean: float) -> Floats:
    """Corners (n, 2) of a seat's section in the plane in which it leans: y and z from the ball."""
    section = wall_section(seats, spec, k)
    return np.concatenate([section, section * [1, -1]]) @ leaning(lean)


def height(seats: Seats, spec: BaseSpec, k: int, pose: SeatPose) -> float:
    """Of the ball's centre above the bed, on which the lowest of legs and core lies, mm."""
    section, core = wall_section(seats, spec, k), core_radius(seats, spec, k)
    edges = [[core_top(seats, spec, k), core], [_cone(seats, spec, k) - core, core]]
    whole = section if core >= seats.boss[k] else np.array([*section[section[:, 1] < core], *edges])
    round_it = whole @ [[-np.cos(pose.lean)], [-np.sin(pose.lean)]]
    on_legs = section[section[:, 1] >= core]
    lowest = [float(round_it.min()), *_lowest_of_legs(seats, spec, k, pose, on_legs)]
    return -min(lowest)


def _lowest_of_legs(
    seats: Seats, spec: BaseSpec, k: int, pose: SeatPose, section: Floats
) -> Iterator[float]:
    """The lowest point of each leg on each circle (z, r), height from the ball, mm."""
    low = np.arctan2(-pose.axes[1, 2], -pose.axes[0, 2])
    for z, r in section.tolist():
        half = np.arcsin(min(_half_leg(seats, spec, k) / r, 1.0))
        for azimuth in _leg_azimuths(seats, k):
            off = (azimuth - low + np.pi) % (2 * np.pi) - np.pi
            off = max(abs(off) - half, 0.0)
            yield float(-z * np.cos(pose.lean) - r * np.sin(pose.lean) * np.cos(off))


def keel_corners(
    seats: Seats, spec: BaseSpec, k: int, pose: SeatPose, to_bar: float = 0.0
) -> Floats:
    """Corners (n, 3) of the plate's face below a seat, along the bed's axes from the ball's centre.

    From the core's lowest point to the foot, and down to the bed, where it reaches the bar. Its
    upper edges end within the wall: on the wall's circles they would touch these in one point,
    which the kernel fails at.
    """
    back, foot = wall_section(seats, spec, k)[-2]
    rim = min(core_radius(seats, spec, k), float(seats.boss[k]))
    first = core_top(seats, spec, k) + INSIDE_MM
    rim, end = (float(np.sqrt(r**2 - KEEL_MM**2 / 4)) - INSIDE_MM for r in (rim, foot))
    last = back - INSIDE_MM
    ends = np.array([[first, -rim], [last, -end], [last, end]]) @ leaning(pose.lean)
    bed = -height(seats, spec, k, pose)
    below = [*ends[:, 0].tolist(), to_bar]
    points = np.concatenate([ends, np.column_stack([below, np.full(len(below), bed)])])
    hull = points[ConvexHull(points).vertices]
    return np.column_stack([np.full(len(hull), -KEEL_MM / 2), hull])


def leaning(lean: float) -> Floats:
    """Rows y and z on the bed of a length along a seat's axis and of one across it, (2, 2)."""
    cosine, sine = np.cos(lean), np.sin(lean)
    return np.array([[sine, -cosine], [cosine, sine]])

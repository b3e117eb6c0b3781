"""Kinematic seats: three flat pads touch each ball, so that no hole decides its centre.

Lengths along a seat's axis count from the ball's centre, away from the light.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.geometry.vectors import dot, norm
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.holding import (
    PAD_AZIMUTHS,
    WEB_MM,
    first_ball,
    glue_wells,
    magnet_pockets,
    pad_normals,
    worst_force_needed,
)
from tbcad.types import Bools, Floats

LIP_MM = 0.5  # of the cup in front of the pads
OFF_PATH_MM = 0.6  # minimum between a pad and the insertion path of another ball
MIN_RIM_MM, RIM_POINTS = 1.4, 72  # of a cup beside the path of another ball
ENOUGH_ROOM_MM = OFF_PATH_MM + 1  # beyond which more room makes no path or rotation better
MAX_PAD = 2 / 3  # diameter of a pad in radii of its ball
MIN_PAD_MM = 1.21  # FDM prints posts of 1.2 mm, and facets cut in by 2 um; glue needs what is left
MIN_PAD_RELIEF = 0.8  # of the cup's clearance, by which pads stand out at their edges
# A ball may be inserted at a slant, as long as it touches no pad of its own before its place.
SLANTS = np.radians([0.0, 10.0, 20.0, 30.0])
SLANT_AZIMUTHS = np.radians(np.arange(0, 360, 30))


@dataclass(frozen=True)
class Seats:
    """Seats of k balls, in the frame of the shell with the base at angle zero."""

    centre: Floats  # of the bodies, mm, (k, 3)
    radius: Floats  # of the bodies, mm, (k,)
    # of each seat, (k, 3, 3): rows along the meridian toward the camera, along the circle against
    # the azimuth, and the seat's axis, away from the light
    axes: Floats
    cup: Floats  # radius of the cup, mm, (k,)
    pad: Floats  # radius of the pads, mm, (k,)
    tilt: float  # angle of the pads' normals to the seat's axis, radians
    pad_azimuth: Floats  # of the first pad about the seat's axis from the first row, radians, (k,)
    front: Floats  # length at which the boss begins, mm, (k,)
    back: Floats  # length at which it ends, mm, (k,)
    boss: Floats  # radius of the boss, mm, (k,)
    magnet: Floats  # diameter of the magnet, zero: glue, mm, (k,)
    magnet_height: Floats  # of the magnet, zero: glue, mm, (k,)
    pocket: Floats  # radius of its pocket, or of the well, mm, (k,)
    bottom: Floats  # length at which the pocket ends, mm, (k,)
    insertion: Floats  # from the centre to where the ball is free when it is taken out, mm, (k, 3)
    pad_offset: float  # by how much pads are printed off their places, away from the balls, mm

    def __len__(self) -> int:
        """Number of seats."""
        return len(self.radius)

    @property
    def axis(self) -> Floats:
        """Unit axes, away from the light, (k, 3)."""
        return self.axes[:, 2]

    def at_depth(self, depth: Floats) -> Floats:
        """Points on the axes at lengths (k,), mm, (k, 3)."""
        return self.centre + depth[:, None] * self.axis

    @property
    def local_normals(self) -> Floats:
        """Unit normals of the pads toward the ball's centre, along the rows of axes, (k, 3, 3)."""
        return pad_normals(self.tilt, self.pad_azimuth)

    @property
    def pad_normals(self) -> Floats:
        """Unit normals of the pads toward the ball's centre, (k, 3, 3)."""
        return self.local_normals @ self.axes

    @property
    def contacts(self) -> Floats:
        """The middles of the pads as they are printed, mm, (k, 3, 3)."""
        distance = self.radius[:, None, None] + self.pad_offset
        return self.centre[:, None] - distance * self.pad_normals


def seat_layout(spec: BaseSpec, prototype: PrototypeLayout) -> Seats:
    """One seat for each body of the prototype, which holds it as the base moves.

    SpecError when a pad, pocket or magnet does not fit, or does not hold a ball: what to change.
    """
    pad_angle = spec.pad_angles_deg[0]
    radius, tilt = prototype.balls.body_radius, float(np.radians(pad_angle))
    pad = np.clip(MAX_PAD * radius, MIN_PAD_MM, spec.pad_mm) / 2
    cup = radius + spec.clearance_mm
    front = radius * np.cos(tilt) - pad * np.sin(tilt) - LIP_MM
    _check_cups(spec, radius, pad, front, pad_angle)
    room = radius * np.sin(tilt) - pad * np.cos(tilt) - WEB_MM
    axes = _axes(prototype)
    needed = worst_force_needed(prototype, axes, tilt)
    magnet, height, pocket = (
        glue_wells(prototype, needed, room)
        if spec.holds[0] == "glue"
        else magnet_pockets(spec, prototype, needed, room)
    )
    bottom = radius + spec.magnet_gap_mm + height
    seats = Seats(
        centre=prototype.seated_centres(),
        radius=radius,
        axes=axes,
        cup=cup,
        pad=pad,
        tilt=tilt,
        pad_azimuth=np.zeros(len(radius)),
        front=front,
        back=bottom + spec.floor_mm,
        boss=np.sqrt(cup**2 - front**2) + spec.cup_wall_mm,
        magnet=magnet,
        magnet_height=height,
        pocket=pocket,
        bottom=bottom,
        insertion=(prototype.balls.body_depth + cup)[:, None] * prototype.normals(),
        pad_offset=spec.pad_offset_mm,
    )
    return _with_clear_pads(_with_clear_paths(seats))


def _axes(prototype: PrototypeLayout) -> Floats:
    frame, azimuth = prototype.array.ellipsoid.frame(), prototype.placement.azimuth
    against = np.stack([0 * azimuth, np.sin(azimuth), -np.cos(azimuth)], axis=1) @ frame
    back = -prototype.normals()
    return np.stack([np.cross(against, back), against, back], axis=1)


def _check_cups(
    spec: BaseSpec, radius: Floats, pad: Floats, front: Floats, pad_angle: float
) -> None:
    if (closed := front < 0).any():
        raise SpecError(
            f"the cup of ball {first_ball(closed)} would close round it: make "
            f"prototype.base.pad_angle_deg less than {pad_angle:g} or "
            f"prototype.base.pad_mm less than {spec.pad_mm:g}"
        )
    # The pads stand out of the cup up to their edges.
    edge = np.hypot(radius + spec.pad_offset_mm, pad) - radius
    sunk = edge >= MIN_PAD_RELIEF * spec.clearance_mm
    if sunk.any():
        minimum = float(edge.max()) / MIN_PAD_RELIEF
        raise SpecError(
            f"the pads of ball {first_ball(sunk)} do not stand out of its cup: make "
            f"prototype.base.clearance_mm more than {minimum:.2f} or prototype.base.pad_mm smaller"
        )


def _with_clear_paths(seats: Seats) -> Seats:
    """The seats with insertion paths clear of other seats: straight ones where those are clear."""
    slant, azimuth = (grid.ravel() for grid in np.meshgrid(SLANTS, SLANT_AZIMUTHS, indexing="ij"))
    directions = np.column_stack([np.sin(slant)[:, None] * unit_circle(azimuth), -np.cos(slant)])
    length = norm(seats.insertion)[:, None]
    tries = [replace(seats, insertion=length * (one @ seats.axes)) for one in directions]
    # Room that a path leaves to the pads of all other seats.
    room = np.stack([_room_at_pads(one).min(axis=(0, 1)) for one in tries])
    # A cup's rim that a path leaves thin is worse than a pad nearer to the path.
    thin = np.stack([thin_rims(one) for one in tries])
    steep = slant[:, None] > np.pi / 2 - np.arccos(seats.front / seats.cup)
    room = np.where(steep, -np.inf, np.where(thin, np.minimum(room, OFF_PATH_MM - 1), room))
    best = _first_with_enough(room)
    insertion = [tries[b].insertion[j] for j, b in enumerate(best.tolist())]
    return replace(seats, insertion=np.stack(insertion))


def thin_rims(seats: Seats) -> Bools:
    """Whether the path of each ball leaves less than a wall of another cup's rim, (k,)."""
    around = unit_circle(np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False))
    rim = np.sqrt(seats.cup**2 - seats.front**2)[:, None, None]
    points = seats.at_depth(seats.front)[:, None] + rim * (around @ seats.axes[:, :2])
    gap = np.stack([_from_paths(seats, one) for one in points]).min(axis=1)
    np.fill_diagonal(gap, np.inf)
    return np.asarray((np.abs(gap) < MIN_RIM_MM).any(axis=0))


def _with_clear_pads(seats: Seats) -> Seats:
    """The seats with their pads turned away from the insertion paths of the other balls."""
    tries = [replace(seats, pad_azimuth=np.full(len(seats), one)) for one in PAD_AZIMUTHS.tolist()]
    room = np.stack([insertion_clearance(one).min(axis=1) for one in tries])
    if (blocked := room.max(axis=0) < OFF_PATH_MM).any():
        raise SpecError(
            f"a pad of ball {first_ball(blocked)} is where another ball is inserted: make "
            "prototype.ball_wall_mm larger or prototype.base.pad_mm smaller"
        )
    return replace(seats, pad_azimuth=PAD_AZIMUTHS[_first_with_enough(room)])


def _first_with_enough(room: Floats) -> NDArray[np.int64]:
    """First row of (t, k) that has enough room in each column, else the one with most, (k,)."""
    enough = room >= ENOUGH_ROOM_MM
    return np.asarray(np.where(enough.any(axis=0), enough.argmax(axis=0), room.argmax(axis=0)))


def insertion_clearance(seats: Seats) -> Floats:
    """Room between each pad and the insertion paths of the other balls, mm, (k, 3)."""
    return np.asarray(_room_at_pads(seats).min(axis=2))


def _room_at_pads(seats: Seats) -> Floats:
    """Room between each pad and the path of each ball, mm, (k, 3, k); infinite for its own."""
    room = _from_paths(seats, seats.contacts) - seats.pad[:, None, None]
    ball = np.arange(len(seats))
    room[ball, :, ball] = np.inf
    return room


def _from_paths(seats: Seats, points: Floats) -> Floats:
    """Distance of points (..., 3) from the path of each ball, which is as wide as its cup."""
    length = norm(seats.insertion)
    toward = points[..., None, :] - seats.centre
    out = seats.insertion / length[:, None]
    along = np.clip(dot(toward, out), 0, length)
    return np.asarray(norm(toward - along[..., None] * out) - seats.cup)

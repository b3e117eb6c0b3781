"""Kinematic seats: three flat pads touch each ball, so that its centre does not hang on a hole.

Lengths along a seat's axis count from the ball's centre, away from the light.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tbcad.geometry.vectors import dot, norm
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import BaseSpec
from tbcad.types import Floats

LIP_MM = 0.5  # of the cup in front of the pads
WEB_MM = 0.8  # between pocket and pads
APART_MM = 0.6  # between a pad and the way of another ball
LARGEST_PAD = 2 / 3  # of the ball's radius, as a diameter
TURNS = np.radians(np.arange(0, 120, 5))
# A ball may be put in at a slant, as long as it touches no pad of its own before its place.
SLANTS = np.radians([0.0, 10.0, 20.0])
ROUND = np.radians(np.arange(0, 360, 30))


@dataclass(frozen=True)
class Seats:
    """Seats of k balls, in the frame of the shell with the base at angle zero.

    Attributes:
        centre: of the bodies, mm, (k, 3).
        radius: of the bodies, mm, (k,).
        axes: of each seat, (k, 3, 3): rows along the meridian toward the camera, along the circle
            against the azimuth, and the seat's axis, away from the light.
        cup: radius of the cup, mm, (k,).
        pad: radius of the pads, mm, (k,).
        tilt: angle of the pads' normals to the seat's axis, radians.
        turn: azimuth of the first pad about the seat's axis from the first row, radians, (k,).
        front: length at which the boss begins, mm, (k,).
        back: length at which it ends, mm, (k,).
        boss: radius of the boss, mm, (k,).
        magnet: diameter of the magnet, zero: glue, mm, (k,).
        pocket: radius of its pocket, or of the well, mm, (k,).
        bottom: length at which the pocket ends, mm, (k,).
        way: from the centre to where the ball is free when it is taken out, mm, (k, 3).
    """

    centre: Floats
    radius: Floats
    axes: Floats
    cup: Floats
    pad: Floats
    tilt: float
    turn: Floats
    front: Floats
    back: Floats
    boss: Floats
    magnet: Floats
    pocket: Floats
    bottom: Floats
    way: Floats

    def __len__(self) -> int:
        """Number of seats."""
        return len(self.radius)

    @property
    def axis(self) -> Floats:
        """Unit axes, away from the light, (k, 3)."""
        return self.axes[:, 2]

    @property
    def local_normals(self) -> Floats:
        """Unit normals of the pads toward the ball's centre, along the rows of axes, (k, 3, 3)."""
        turn = self.turn[:, None] + np.arange(3) * 2 * np.pi / 3
        side, along = np.sin(self.tilt), np.full(turn.shape, np.cos(self.tilt))
        return -np.stack([side * np.cos(turn), side * np.sin(turn), along], axis=-1)

    @property
    def pad_normals(self) -> Floats:
        """Unit normals of the pads toward the ball's centre, (k, 3, 3)."""
        return self.local_normals @ self.axes

    @property
    def contacts(self) -> Floats:
        """Points where the pads touch the ball, the middles of the pads, mm, (k, 3, 3)."""
        return self.centre[:, None] - self.radius[:, None, None] * self.pad_normals


def seat_layout(keys: BaseSpec, made: PrototypeLayout) -> Seats:
    """One seat for each body of the prototype.

    Raises:
        SpecError: when a pad, pocket or magnet does not fit; it says what to change.
    """
    radius, tilt = made.balls.body_radius, float(np.radians(keys.pad_angle_deg))
    pad = np.minimum(keys.pad_mm, LARGEST_PAD * radius) / 2
    cup, front = radius + keys.clearance_mm, _front(radius, pad, tilt)
    _check_cups(keys, radius, pad, front)
    magnet, pocket = _pockets(keys, radius, pad, tilt)
    held = keys.magnet_height_mm if keys.hold == "magnet" else 0.0
    bottom = radius + keys.magnet_gap_mm + held
    found = Seats(
        centre=made.body_centres(),
        radius=radius,
        axes=_axes(made),
        cup=cup,
        pad=pad,
        tilt=tilt,
        turn=np.zeros(len(radius)),
        front=front,
        back=bottom + keys.floor_mm,
        boss=np.sqrt(cup**2 - front**2) + keys.cup_wall_mm,
        magnet=magnet,
        pocket=pocket,
        bottom=bottom,
        way=(made.balls.body_depth + cup)[:, None] * made.normals(),
    )
    return _turned(_slanted(found))


def shifted_contacts(seat: Seats, offsets: Floats) -> Floats:
    """Contacts (k, o, 3, 3) along the rows of axes with pads moved by offsets (o,) off the ball."""
    away = seat.radius[:, None] + offsets
    return -away[..., None, None] * seat.local_normals[:, None]


def _axes(made: PrototypeLayout) -> Floats:
    frame, azimuth = made.half.ellipsoid.frame(), made.placement.azimuth
    against = np.stack([0 * azimuth, np.sin(azimuth), -np.cos(azimuth)], axis=1) @ frame
    back = -made.normals()
    return np.stack([np.cross(against, back), against, back], axis=1)


def _front(radius: Floats, pad: Floats, tilt: float) -> Floats:
    result: Floats = radius * np.cos(tilt) - pad * np.sin(tilt) - LIP_MM
    return result


def _check_cups(keys: BaseSpec, radius: Floats, pad: Floats, front: Floats) -> None:
    if (shut := front < 0).any():
        raise SpecError(
            f"the cup of ball {_first(shut)} would close round it: make "
            f"prototype.base.pad_angle_deg less than {keys.pad_angle_deg:g} or "
            f"prototype.base.pad_mm less than {keys.pad_mm:g}"
        )
    # The pads stand out of the cup everywhere.
    if (sunk := radius**2 + pad**2 >= (radius + 0.8 * keys.clearance_mm) ** 2).any():
        least = float((np.sqrt(radius**2 + pad**2) - radius).max()) / 0.8
        raise SpecError(
            f"the pads of ball {_first(sunk)} do not stand out of its cup: make "
            f"prototype.base.clearance_mm more than {least:.2f} or prototype.base.pad_mm smaller"
        )


def _pockets(keys: BaseSpec, radius: Floats, pad: Floats, tilt: float) -> tuple[Floats, Floats]:
    """Magnets and radii of pockets, both (k,)."""
    room = radius * np.sin(tilt) - pad * np.cos(tilt) - WEB_MM
    if keys.hold == "glue":
        return np.zeros_like(radius), room / 2
    sizes = np.array(sorted(keys.magnets_mm))
    fitting = (sizes + keys.magnet_play_mm) / 2 <= room[:, None]
    if (none := ~fitting.any(axis=1)).any():
        ball = _first(none)
        most = float(2 * room[ball - 1] - keys.magnet_play_mm)
        raise SpecError(
            f"no magnet fits between the pads of ball {ball}: add one of {max(most, 0):.1f} mm or "
            "less to prototype.base.magnets_mm, or set prototype.base.hold to glue"
        )
    magnet = np.where(fitting, sizes, 0).max(axis=1)
    return magnet, (magnet + keys.magnet_play_mm) / 2


def _slanted(seat: Seats) -> Seats:
    """The seats with ways out that are clear of other seats: straight ones where those are."""
    slant, turn = (grid.ravel() for grid in np.meshgrid(SLANTS, ROUND, indexing="ij"))
    side = np.sin(slant)
    local = np.stack([side * np.cos(turn), side * np.sin(turn), -np.cos(slant)], axis=1)
    tries = [replace(seat, way=norm(seat.way)[:, None] * (one @ seat.axes)) for one in local]
    # Room that a way leaves to the pads of all others.
    room = np.stack([_free(one).min(axis=(0, 1)) for one in tries])
    best = _first_with(room, APART_MM + 1)
    return replace(seat, way=np.stack([tries[b].way[j] for j, b in enumerate(best.tolist())]))


def _turned(seat: Seats) -> Seats:
    """The seats with their pads turned away from the ways of the other balls.

    Raises:
        SpecError: when a pad stands in the way of another ball however it is turned.
    """
    tries = [replace(seat, turn=np.full(len(seat), turn)) for turn in TURNS.tolist()]
    room = np.stack([insertion_clearance(one).min(axis=1) for one in tries])
    if (blocked := room.max(axis=0) < APART_MM).any():
        raise SpecError(
            f"a pad of ball {_first(blocked)} stands where another ball is put in: make "
            "prototype.ball_wall_mm larger or prototype.base.pad_mm smaller"
        )
    return replace(seat, turn=TURNS[_first_with(room, APART_MM + 1)])


def _first_with(room: Floats, enough: float) -> NDArray[np.int64]:
    """First row of (t, k) that has enough in each column, else the one with most, (k,)."""
    good = room >= enough
    first: NDArray[np.int64] = np.where(good.any(axis=0), good.argmax(axis=0), room.argmax(axis=0))
    return first


def insertion_clearance(seat: Seats) -> Floats:
    """Room between each pad and the ways on which the other balls are put in, mm, (k, 3)."""
    result: Floats = _free(seat).min(axis=2)
    return result


def _free(seat: Seats) -> Floats:
    """Room between each pad and the way of each ball, mm, (k, 3, k); infinite for its own."""
    length = norm(seat.way)
    toward = seat.contacts[:, :, None] - seat.centre
    out = seat.way / length[:, None]
    along = np.clip(dot(toward, out), 0, length)
    away = norm(toward - along[..., None] * out) - seat.cup - seat.pad[:, None, None]
    own = np.arange(len(seat))
    away[own, :, own] = np.inf
    return away


def _first(which: NDArray[np.bool_]) -> int:
    """Number of the first ball of which it is so, from 1."""
    return int(which.argmax()) + 1

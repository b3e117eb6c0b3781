"""The base in numbers: a ribbed carrier about the axis with a seat for each ball, and its hub.

Its cross-section is a convex line behind all light and behind what each seat needs, so small balls
and caps do not hang in a wall that large ones push far out; the wall is that line turned about the
axis over the sector of the balls. Ribs stand outside, highest at the hub where the load is.
"""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.geometry.vectors import norm, unit
from tbcad.optics.ball_light import light_hulls
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.hub import Hub, hub_layout
from tbcad.prototype.base.profile import (
    LightSpheroid,
    distance_outside,
    hull,
    offset,
    outward,
    shortened,
    thinned,
    trimmed,
)
from tbcad.prototype.base.seats import Seats, seat_layout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import BaseSpec
from tbcad.types import Floats

EDGE_MM = 2.0  # wall beyond the outermost bosses
SHORTEST_MM = 8.0  # parts of the cross-section
ROOTED_MM = 6.0  # how far the wall goes into the hub's disc
OUT_MM = 0.8  # least that a boss stands out of the wall, for its number
WIDEST = np.radians(330)
# Ribs between the edges may be moved by this share of their distance to miss the bosses.
FREE = 0.35
CORNER_MM = 3.0  # by which ribs stay back from the hub's outer edge
CORNERS = 24
APART_MM = 0.4  # of the wall from a boss's front edge, which must not just touch it
# Ribs end this far before the wall, rings half as far: faces that nearly coincide do not join well.
BACK_MM = 1.0
LOWER_MM = 0.6  # rings than ribs, whose tops would touch their cones along a line


@dataclass(frozen=True)
class BaseLayout:
    """What the carrier is made of, in the ellipsoid's frame unless said otherwise.

    Attributes:
        keys: of the spec.
        frame: rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3).
        light: what the carrier stays out of.
        inner: the wall's inner line from the hub toward the camera, (z, r) in mm, (p, 2).
        sector: least and largest azimuth of the wall, radians.
        ribs: azimuth of the meridian ribs, the first and the last at the edges, radians.
        outline: outer line of the ribs, (z, r), mm, (q, 2).
        rings: cross-sections of the ring ribs, (z, r), mm, each (4, 2).
        hub: disc, boss and holes.
        seats: one for each ball, in the frame of the shell.
    """

    keys: BaseSpec
    frame: Floats
    light: LightSpheroid
    inner: Floats
    sector: tuple[float, float]
    ribs: Floats
    outline: Floats
    rings: tuple[Floats, ...]
    hub: Hub
    seats: Seats

    @property
    def hub_face(self) -> float:
        """Z of the hub's outer face along the axis, mm."""
        return self.hub.face

    @property
    def outer(self) -> Floats:
        """The wall's outer line, (z, r), mm, (p, 2)."""
        return offset(self.inner, self.keys.thickness_mm)

    @property
    def middle(self) -> Floats:
        """The line half way through the wall as far as the ribs go, (z, r), mm, (p, 2)."""
        return shortened(offset(self.inner, self.keys.thickness_mm / 2), BACK_MM)

    @property
    def axes(self) -> Floats:
        """What x, y and z of the carrier's own frame are in the frame of the shell, as rows.

        Its z is the axis toward the camera, its x azimuth zero.
        """
        return self.frame[[1, 2, 0]]

    @property
    def own_seats(self) -> Seats:
        """The seats in the carrier's own frame."""
        turn, found = self.axes.T, self.seats
        centre, way = found.centre @ turn, found.way @ turn
        return replace(found, centre=centre, axes=found.axes @ turn, way=way)

    def outermost(self, swing: float) -> float:
        """Largest azimuth, to either side, that the wall reaches over a swing, radians."""
        return float(np.abs(self.sector).max() + swing / 2)


def base_layout(keys: BaseSpec, made: PrototypeLayout) -> BaseLayout:
    """The base for a prototype's balls.

    Raises:
        SpecError: when something does not fit; it says what to change.
    """
    frame, seat = made.half.ellipsoid.frame(), seat_layout(keys, made)
    behind = _light(keys, made)
    _check_front(seat, behind, frame)
    nose = float(behind.pinhole / 2 - behind.level / 2)
    held = hub_layout(keys, nose - keys.light_clearance_mm)
    inner, sector = _inner(keys, seat, frame, behind, held), _sector(keys, seat, made)
    return BaseLayout(
        keys=keys,
        frame=frame,
        light=behind,
        inner=inner,
        sector=sector,
        ribs=_ribs(keys, seat, made, sector),
        outline=_outline(keys, inner, held),
        rings=_rings(keys, inner),
        hub=held,
        seats=_standing_out(keys, seat, frame, offset(inner, keys.thickness_mm)),
    )


def _light(keys: BaseSpec, made: PrototypeLayout) -> LightSpheroid:
    """The level of all light with its margins.

    On a sphere about a point the sum of distances is at most that at the point plus the diameter.
    The capture sphere lies inside the mirrors' ellipsoid and so far below the level of any ball.
    """
    pinhole = 2 * made.half.ellipsoid.linear_eccentricity
    free, cones = LightSpheroid(pinhole, 0.0), light_hulls(made.balls.outline, pinhole, 0.0)[0]
    level = (free.beyond(cones.end) + 2 * cones.end_radius).max()
    return LightSpheroid(pinhole, float(level) + 2 * keys.light_clearance_mm)


def _check_front(seat: Seats, behind: LightSpheroid, frame: Floats) -> None:
    """Refuse seats that reach into the light.

    Raises:
        SpecError: as said.
    """
    beyond = behind.least_beyond(_front_corners(seat) @ frame.T)
    worst = int(beyond.argmin())
    if beyond[worst] < 0:
        raise SpecError(
            f"the seat of ball {worst + 1} reaches {-beyond[worst] / 2:.1f} mm into the light: "
            "make prototype.base.pad_angle_deg, pad_mm, cup_wall_mm or light_clearance_mm smaller"
        )


def _front_corners(seat: Seats) -> Floats:
    """Corners of a polygon round the front of each boss, mm, (k, CORNERS, 3)."""
    turn = 2 * np.pi * np.arange(CORNERS) / CORNERS
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1) / np.cos(np.pi / CORNERS)
    middle = seat.centre + seat.front[:, None] * seat.axis
    corners: Floats = middle[:, None] + seat.boss[:, None, None] * (circle @ seat.axes[:, :2])
    return corners


def _plane(points: Floats) -> Floats:
    """Points of the ellipsoid's frame (..., 3) as (z, r), (..., 2)."""
    return np.stack([points[..., 0], norm(points[..., 1:])], axis=-1)


def _inner(keys: BaseSpec, seat: Seats, frame: Floats, behind: LightSpheroid, held: Hub) -> Floats:
    """The wall's inner line: round the light, from the hub's rim to beyond the last boss.

    It lies behind the fronts of all bosses, and so deep at each that the ribs end where it does.
    """
    depth = np.maximum(seat.back - keys.rib_height_mm - keys.thickness_mm, seat.front)
    axis, side = seat.axis @ frame.T, seat.boss[:, None] * (seat.axes[:, 0] @ frame.T)
    lengths = (depth, seat.front + APART_MM)
    deep, front = (seat.centre @ frame.T + at[:, None] * axis for at in lengths)
    points = np.vstack([_plane(deep), _plane(front - side), _plane(front + side)])
    points = np.vstack([points, behind.outline()])
    rim = np.array([[held.front, held.disc]])
    end = _end(seat, frame)
    line = trimmed(hull(np.vstack([rim, points[points[:, 0] > held.front]])), end)
    if norm(line[-1] - line[-2]) < SHORTEST_MM and len(line) > 2:
        line = trimmed(line[:-1], end)
    root = line[0] - ROOTED_MM * unit(line[1] - line[0])
    return thinned(np.vstack([root, line[1:]]), SHORTEST_MM)


def _end(seat: Seats, frame: Floats) -> float:
    """Z beyond all bosses, toward the camera."""
    tops = (seat.centre + seat.back[:, None] * seat.axis) @ frame[0]
    fronts = (seat.centre + seat.front[:, None] * seat.axis) @ frame[0]
    wide = seat.boss * (seat.axes[:, 0] @ frame[0])
    return float((np.maximum(tops, fronts) + wide).max() + EDGE_MM)


def _sector(keys: BaseSpec, seat: Seats, made: PrototypeLayout) -> tuple[float, float]:
    """Azimuths between which the wall carries all bosses and has room for the edges' ribs."""
    azimuth = made.placement.azimuth
    out = _plane((seat.centre + seat.front[:, None] * seat.axis) @ made.half.ellipsoid.frame().T)
    room = seat.boss + keys.rib_mm + EDGE_MM
    if (near := out[:, 1] <= room).any():
        raise SpecError(
            f"ball {int(near.argmax()) + 1} stands too near to the axis for its seat: make "
            "prototype.base.rib_mm or prototype.base.cup_wall_mm smaller"
        )
    half = np.arcsin(room / out[:, 1])
    low, high = float((azimuth - half).min()), float((azimuth + half).max())
    if high - low > WIDEST:
        raise SpecError(
            f"the base would go {np.degrees(high - low):.0f} degrees round its axis: make "
            "prototype.k or prototype.ball_wall_mm smaller"
        )
    return low, high


def _ribs(
    keys: BaseSpec, seat: Seats, made: PrototypeLayout, sector: tuple[float, float]
) -> Floats:
    """Azimuths of the ribs: both edges, and between them where they meet bosses least."""
    even = np.linspace(*sector, keys.ribs)
    step = even[1] - even[0]
    tried = np.linspace(-FREE, FREE, 29) * step
    out = made.balls.body_centre[:, 1]
    inner = []
    for middle in even[1:-1].tolist():
        away = out * np.abs(np.sin(made.placement.azimuth - (middle + tried)[:, None]))
        cost = np.maximum(seat.boss + keys.rib_mm / 2 - away, 0).sum(axis=1)
        inner.append(middle + tried[np.lexsort((np.abs(tried), np.round(cost, 6)))[0]])
    return np.array([sector[0], *inner, sector[1]])


def _outline(keys: BaseSpec, inner: Floats, held: Hub) -> Floats:
    """Outer line of the ribs, from the hub's outer end, so that they are its gussets."""
    line = offset(inner, keys.thickness_mm + keys.rib_height_mm)
    radius = held.boss or held.disc
    corner = [held.face + CORNER_MM, radius - CORNER_MM]
    return shortened(hull(np.vstack([[corner], line[line[:, 0] > corner[0]]])), BACK_MM)


def _rings(keys: BaseSpec, inner: Floats) -> tuple[Floats, ...]:
    """Cross-sections of the ring ribs at even distances along the wall, the last at its end."""
    length = np.concatenate([[0.0], np.cumsum(norm(np.diff(inner, axis=0)))])
    at = (length[-1] - BACK_MM / 2) * np.arange(1, keys.rings + 1) / keys.rings
    part = np.clip(np.searchsorted(length, at) - 1, 0, len(inner) - 2)
    along = unit(np.diff(inner, axis=0))[part]
    place = inner[part] + (at - length[part])[:, None] * along
    place[:-1] += along[:-1] * keys.rib_mm / 2
    low, high = 0.3 * keys.thickness_mm, keys.thickness_mm + keys.rib_height_mm - LOWER_MM
    return tuple(
        np.array(
            [
                p + low * n,
                p - keys.rib_mm * a + low * n,
                p - keys.rib_mm * a + high * n,
                p + high * n,
            ]
        )
        for p, a, n in zip(place, along, outward(inner)[part], strict=True)
    )


def _standing_out(keys: BaseSpec, seat: Seats, frame: Floats, outer: Floats) -> Seats:
    """The seats with bosses so long that their ends stand out of the wall.

    Beside its meridian a boss is only farther from the axis, so the ends' points on it decide.
    """
    share = np.linspace(-1, 1, 9)[:, None]
    side = share[None] * (seat.boss[:, None] * (seat.axes[:, 0] @ frame.T))[:, None]
    back = seat.back.copy()
    for _ in range(60):
        end = seat.centre @ frame.T + back[:, None] * (seat.axis @ frame.T)
        lack = (
            OUT_MM
            + keys.relief_mm
            - distance_outside(outer, _plane(end[:, None] + side)).min(axis=1)
        )
        if lack.max() <= 1e-9:
            break
        back += np.maximum(lack, 0)
    return replace(seat, back=back)

"""The base in numbers: a ribbed carrier about the axis with a seat for each ball, and its hub.

Its cross-section is a convex line behind all light and as deep as each seat needs, so small balls
and caps are not in a wall that large ones push far out. The wall has plane facets round that line
turned about the axis, over the sector of the balls. Ribs are outside, highest at the hub where the
load is.
"""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.core.geometry.primitives import Cylinder, cylinder_between
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.ball_light import light_hulls
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.hub import Hub, deepened, hub_layout
from tbcad.prototype.base.profile import (
    LightSpheroid,
    at_azimuths,
    distance_outside,
    hull,
    offset,
    outward,
    shortened,
    thinned,
    trimmed,
)
from tbcad.prototype.base.seats import Seats, seat_layout
from tbcad.prototype.drive.balance import PointMasses
from tbcad.types import Floats

EDGE_MM = 2.0  # wall beyond the outermost bosses
MIN_PART_MM = 8.0  # length of the parts of the cross-section
ROOTED_MM = 6.0  # how far the wall reaches into the hub's disc
FACETS_OUT_MM = 0.1  # of the edges of the wall's facets from the cones that their middles are on
MIN_PROTRUSION_MM = 0.8  # of a boss beyond the wall, for its number
MAX_SECTOR = np.radians(330)
# Ribs between the edges may be moved by this share of their distance to miss the bosses.
MAX_RIB_SHIFT = 0.35
RIB_SHIFTS = 29  # tried
HUB_CORNER_MM = 3.0  # by which ribs stay back from the hub's outer edge
FRONT_CORNERS = 24  # of a polygon round the front of a boss
OFF_RIM_MM = 0.5  # of the wall from the hub's rim, which its facets must not just touch
OFF_FRONT_MM = 0.4  # of the wall from a boss's front edge, which must not just touch it
# Ribs end this far before the wall, rings half as far: faces that nearly coincide do not join well.
RIB_END_MM = 1.0
# Rings are lower than ribs by this, whose tops would touch their cones along a line.
RING_LOWER_MM = 0.6
RING_FOOT = 0.3  # of the wall's thickness, where a ring's section begins
BEHIND_MM = 1.0  # of the hub's outer face from bosses and rings: the zero disc lies on it
END_POINTS = 9  # across the end of a boss, where its height over the wall is measured
MAX_ROUNDS = 60  # of lengthening bosses
HUB_BEHIND_MM = 1.0  # of the hub's front from the wall at the boss that is farthest back
ROUNDING_MM = 1e-9


@dataclass(frozen=True)
class BaseLayout:
    """Dimensions of the carrier, in the ellipsoid's frame unless said otherwise."""

    spec: BaseSpec  # of the base
    frame: Floats  # rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3)
    light: LightSpheroid  # what the carrier stays out of
    inner: Floats  # the wall's inner line from the hub toward the camera, (z, r) in mm, (p, 2)
    sector: tuple[float, float]  # minimum and maximum azimuth of the wall, radians
    ribs: Floats  # azimuths of the meridian ribs, the first and the last at the edges, radians
    outline: Floats  # outer line of the ribs, (z, r), mm, (q, 2)
    rings: tuple[Floats, ...]  # cross-sections of the ring ribs, (z, r), mm, each (4, 2)
    hub: Hub  # disc, boss and holes
    seats: Seats  # one for each ball, in the frame of the shell

    @property
    def outer(self) -> Floats:
        """The wall's outer line, (z, r), mm, (p, 2)."""
        return offset(self.inner, self.spec.thickness_mm)

    @property
    def middle(self) -> Floats:
        """The line half way through the wall as far as the ribs go, (z, r), mm, (p, 2)."""
        return shortened(offset(self.inner, self.spec.thickness_mm / 2), RIB_END_MM)

    @property
    def rearmost(self) -> float:
        """Z of the end of bosses and rings that is farthest behind, mm."""
        return _rearmost(self.spec, self.seats, self.rings, self.frame)

    @property
    def axes(self) -> Floats:
        """Axes x, y and z of the carrier's own frame, in the frame of the shell, as rows.

        Its z is the axis toward the camera, its x azimuth zero.
        """
        return self.frame[[1, 2, 0]]

    @property
    def local_seats(self) -> Seats:
        """The seats in the carrier's own frame."""
        rotation, seats = self.axes.T, self.seats
        return replace(
            seats,
            centre=seats.centre @ rotation,
            axes=seats.axes @ rotation,
            insertion=seats.insertion @ rotation,
        )

    def point(self, along: float, out: float = 0.0, side: float = 0.0) -> Floats:
        """A point along the axis, out from it at azimuth zero, and across, in the shell's frame."""
        return np.asarray(np.array([along, out, side]) @ self.frame)

    def cylinder(
        self, start: float, end: float, radius: float, out: float = 0.0, side: float = 0.0
    ) -> Cylinder:
        """A cylinder between two places along the axis, or beside it, mm."""
        first, last = (self.point(along, out, side) for along in (start, end))
        return cylinder_between(first, last, radius)


def base_layout(spec: BaseSpec, prototype: PrototypeLayout) -> BaseLayout:
    """The base for a prototype's balls in motion; SpecError names what to change to fit."""
    frame, seats = prototype.array.ellipsoid.frame(), seat_layout(spec, prototype)
    light = _light(spec, prototype)
    _check_fronts(seats, light, frame)
    hub = hub_layout(spec, _hub_front(spec, seats, frame, light))
    inner = _inner(spec, seats, frame, light, hub)
    sector, rings = _sector(spec, seats, prototype), _rings(spec, inner)
    protruding = _protruding(spec, seats, frame, offset(inner, spec.thickness_mm))
    hub = deepened(hub, _rearmost(spec, protruding, rings, frame) - BEHIND_MM)
    # The ribs begin at the hub's outer end, so that they are its gussets.
    line = offset(inner, spec.thickness_mm + spec.rib_height_mm)
    corner = [hub.face + HUB_CORNER_MM, (hub.boss or hub.disc) - HUB_CORNER_MM]
    outline = shortened(hull(np.vstack([[corner], line[line[:, 0] > corner[0]]])), RIB_END_MM)
    return BaseLayout(
        spec=spec,
        frame=frame,
        light=light,
        inner=inner,
        sector=sector,
        ribs=_ribs(spec, seats, prototype, sector),
        outline=outline,
        rings=rings,
        hub=hub,
        seats=protruding,
    )


def _light(spec: BaseSpec, prototype: PrototypeLayout) -> LightSpheroid:
    """The spheroid of all light with its margins.

    On a sphere about a point the sum of distances is at most that at the point plus the diameter.
    The capture sphere is inside the mirrors' ellipsoid and so far below the level of any ball.
    """
    pinhole = 2 * prototype.array.ellipsoid.linear_eccentricity
    foci = LightSpheroid(pinhole, 0.0)
    cones = light_hulls(prototype.balls.outline, pinhole, 0.0)[0]
    level = (foci.excess(cones.end) + 2 * cones.end_radius).max()
    return LightSpheroid(pinhole, float(level) + 2 * spec.light_clearance_mm)


def _check_fronts(seats: Seats, light: LightSpheroid, frame: Floats) -> None:
    """Refuse seats that reach into the light, by corners of a polygon round each boss's front."""
    circle = unit_circle(even_angles(FRONT_CORNERS)) / np.cos(np.pi / FRONT_CORNERS)
    corners = seats.boss[:, None, None] * (circle @ seats.axes[:, :2])
    excess = light.min_excess((seats.at_depth(seats.front)[:, None] + corners) @ frame.T)
    worst = int(excess.argmin())
    if excess[worst] < 0:
        raise SpecError(
            f"the seat of ball {worst + 1} reaches {-excess[worst] / 2:.1f} mm into the light: "
            "make prototype.base.pad_angle_deg, pad_mm, cup_wall_mm or light_clearance_mm smaller"
        )


def _half_plane(points: Floats) -> Floats:
    """Points of the ellipsoid's frame (..., 3) as (z, r), (..., 2)."""
    return np.stack([points[..., 0], norm(points[..., 1:])], axis=-1)


def _hub_front(spec: BaseSpec, seats: Seats, frame: Floats, light: LightSpheroid) -> float:
    """Z where the hub's disc begins: behind all light and behind the wall at each boss.

    A large ball near the axis lies farther back than the light: a wall that began before it would
    leave its boss standing free.
    """
    behind_light = float(light.pinhole / 2 - light.level / 2) - spec.light_clearance_mm
    behind_bosses = float(_wall_points(spec, seats, frame)[:, 0].min()) - HUB_BEHIND_MM
    return min(behind_light, behind_bosses)


def _wall_points(spec: BaseSpec, seats: Seats, frame: Floats) -> Floats:
    """Points (z, r) that the wall's inner line may not lie before, three for each boss, (3 k, 2).

    It is behind the fronts of all bosses, and so deep at each that the ribs end where the boss
    does.
    """
    depth = np.maximum(seats.back - spec.rib_height_mm - spec.thickness_mm, seats.front)
    axis, side = seats.axis @ frame.T, seats.boss[:, None] * (seats.axes[:, 0] @ frame.T)
    lengths = (depth, seats.front + OFF_FRONT_MM)
    deep, front = (seats.centre @ frame.T + length[:, None] * axis for length in lengths)
    return np.vstack([_half_plane(one) for one in (deep, front - side, front + side)])


def _inner(spec: BaseSpec, seats: Seats, frame: Floats, light: LightSpheroid, hub: Hub) -> Floats:
    """The wall's inner line: round the light, from the hub's rim to beyond the last boss."""
    behind = np.vstack([_wall_points(spec, seats, frame), light.outline()])
    rim = np.array([[hub.front, hub.disc + OFF_RIM_MM]])
    # Beyond all bosses, toward the camera.
    ends, fronts = (seats.at_depth(depth) @ frame[0] for depth in (seats.back, seats.front))
    side = seats.boss * (seats.axes[:, 0] @ frame[0])
    end = float((np.maximum(ends, fronts) + side).max() + EDGE_MM)
    line = trimmed(hull(np.vstack([rim, behind[behind[:, 0] > hub.front]])), end)
    if norm(line[-1] - line[-2]) < MIN_PART_MM and len(line) > 2:
        line = trimmed(line[:-1], end)
    root = line[0] - ROOTED_MM * unit(line[1] - line[0])
    return thinned(np.vstack([root, line[1:]]), MIN_PART_MM)


def _rearmost(spec: BaseSpec, seats: Seats, rings: tuple[Floats, ...], frame: Floats) -> float:
    """Z of the end of bosses, with their numbers, and rings that is farthest from the camera."""
    ends = seats.at_depth(seats.back + spec.relief_mm) @ frame[0]
    side = np.abs(seats.boss * (seats.axes[:, 0] @ frame[0]))
    return float(min((ends - side).min(), *(ring[:, 0].min() for ring in rings)))


def _sector(spec: BaseSpec, seats: Seats, prototype: PrototypeLayout) -> tuple[float, float]:
    """Azimuths between which the wall carries all bosses and has room for the edges' ribs."""
    azimuth, frame = prototype.placement.azimuth, prototype.array.ellipsoid.frame()
    radius = _half_plane(seats.at_depth(seats.front) @ frame.T)[:, 1]
    room = seats.boss + spec.rib_mm + EDGE_MM
    if (near := radius <= room).any():
        raise SpecError(
            f"ball {int(near.argmax()) + 1} is too near to the axis for its seat: make "
            "prototype.base.rib_mm or prototype.base.cup_wall_mm smaller"
        )
    half = np.arcsin(room / radius)
    low, high = float((azimuth - half).min()), float((azimuth + half).max())
    if high - low > MAX_SECTOR:
        raise SpecError(
            f"the base would go {np.degrees(high - low):.0f} degrees round its axis: make "
            "prototype.k or prototype.ball_wall_mm smaller"
        )
    return low, high


def _ribs(
    spec: BaseSpec, seats: Seats, prototype: PrototypeLayout, sector: tuple[float, float]
) -> Floats:
    """Azimuths of the ribs: both edges, and between them where they overlap bosses least."""
    even = np.linspace(*sector, spec.ribs)
    shifts = np.linspace(-MAX_RIB_SHIFT, MAX_RIB_SHIFT, RIB_SHIFTS) * (even[1] - even[0])
    radius, azimuth = prototype.balls.body_centre[:, 1], prototype.placement.azimuth
    between = []
    for middle in even[1:-1].tolist():
        distance = radius * np.abs(np.sin(azimuth - (middle + shifts)[:, None]))
        overlap = np.maximum(seats.boss + spec.rib_mm / 2 - distance, 0).sum(axis=1)
        best = np.lexsort((np.abs(shifts), np.round(overlap, 6)))[0]
        between.append(middle + shifts[best])
    return np.array([sector[0], *between, sector[1]])


def _rings(spec: BaseSpec, inner: Floats) -> tuple[Floats, ...]:
    """Cross-sections of the ring ribs at even distances along the wall, the last at its end."""
    length = np.concatenate([[0.0], np.cumsum(norm(np.diff(inner, axis=0)))])
    at = (length[-1] - RIB_END_MM / 2) * np.arange(1, spec.rings + 1) / spec.rings
    part = np.clip(np.searchsorted(length, at) - 1, 0, len(inner) - 2)
    along = unit(np.diff(inner, axis=0))[part]
    place = inner[part] + (at - length[part])[:, None] * along
    place[:-1] += along[:-1] * spec.rib_mm / 2
    foot = RING_FOOT * spec.thickness_mm
    top = spec.thickness_mm + spec.rib_height_mm - RING_LOWER_MM
    lengths = np.array([[0.0, -spec.rib_mm, -spec.rib_mm, 0.0]]).T
    heights = np.array([[foot, foot, top, top]]).T
    return tuple(
        end + lengths * forward + heights * out
        for end, forward, out in zip(place, along, outward(inner)[part], strict=True)
    )


def _protruding(spec: BaseSpec, seats: Seats, frame: Floats, outer: Floats) -> Seats:
    """The seats with bosses so long that their ends protrude from the wall.

    Beside its meridian a boss is only farther from the axis, so the points of its end on the
    meridian decide.
    """
    share = np.linspace(-1, 1, END_POINTS)[:, None]
    side = share[None] * (seats.boss[:, None] * (seats.axes[:, 0] @ frame.T))[:, None]
    back = seats.back.copy()
    for _ in range(MAX_ROUNDS):
        end = seats.centre @ frame.T + back[:, None] * (seats.axis @ frame.T)
        height = distance_outside(outer, _half_plane(end[:, None] + side)).min(axis=1)
        missing = MIN_PROTRUSION_MM + spec.relief_mm - height
        if missing.max() <= ROUNDING_MM:
            break
        back += np.maximum(missing, 0)
    return replace(seats, back=back)


def carrier_masses(base: BaseLayout, density: float) -> PointMasses:
    """An estimate of the carrier's pieces as point masses, by a density in g/cm^3.

    Wall and rings are solids of revolution (Pappus), ribs are plates, bosses and hub are cylinders;
    flanges of joints, numbers and screw holes are left out. It chooses a drive early and serves
    overviews; the solids decide.
    """
    inner, outer = base.inner, base.outer
    wall = np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], axis=1)
    revolved = _revolved(base, np.concatenate([wall, np.stack(base.rings)]))
    pieces = [revolved, _rib_masses(base), _boss_masses(base), _hub_masses(base)]
    volume, centre = (np.concatenate(each) for each in zip(*pieces, strict=True))
    return PointMasses(volume / 1000 * density, centre)


def _revolved(base: BaseLayout, quads: Floats) -> tuple[Floats, Floats]:
    """Volumes (n,) and centres (n, 3) of quadrilaterals (n, 4, 2) of (z, r) over the sector."""
    middle, (low, high) = quads.mean(axis=1), base.sector
    angle = high - low
    # The centre of gravity of an arc is nearer to the axis by the chord over the arc.
    arc = np.column_stack([middle[:, 0], middle[:, 1] * np.sin(angle / 2) / (angle / 2)])
    centre = at_azimuths(arc, np.array([(low + high) / 2]))[0] @ base.axes
    return _area(quads) * middle[:, 1] * angle, centre


def _rib_masses(base: BaseLayout) -> tuple[Floats, Floats]:
    """Each rib as one plate between the wall and the ribs' outline."""
    section = np.vstack([base.outline, base.outer[::-1]])
    volume = np.full(len(base.ribs), float(_area(section[None])[0]) * base.spec.rib_mm)
    return volume, at_azimuths(section.mean(axis=0)[None], base.ribs)[:, 0] @ base.axes


def _boss_masses(base: BaseLayout) -> tuple[Floats, Floats]:
    """Bosses outside of the wall, without their cups and pockets."""
    seats = base.seats
    length = np.maximum(seats.back - seats.front - base.spec.thickness_mm, 0.0)
    depth = seats.cup - seats.front
    cup = np.pi * depth**2 * (3 * seats.cup - depth) / 3
    pocket = np.pi * seats.pocket**2 * np.maximum(seats.bottom - seats.radius, 0.0)
    volume = np.maximum(np.pi * seats.boss**2 * length - cup - pocket, 0.0)
    return volume, seats.at_depth((seats.front + seats.back) / 2)


def _hub_masses(base: BaseLayout) -> tuple[Floats, Floats]:
    hub = base.hub
    disc = np.pi * (hub.disc**2 - hub.bore**2) * (hub.front - hub.back)
    boss = np.pi * max(hub.boss**2 - hub.bore**2, 0.0) * (hub.back - hub.face)
    along = np.array([(hub.front + hub.back) / 2, (hub.back + hub.face) / 2])
    return np.array([disc, boss]), along[:, None] * base.frame[0]


def _area(polygons: Floats) -> Floats:
    """Areas (n,) of polygons (n, p, 2), by the shoelace formula."""
    x, y = np.moveaxis(polygons, -1, 0)
    return np.asarray(
        np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)) / 2
    )

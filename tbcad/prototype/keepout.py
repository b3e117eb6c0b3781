"""The keep-out volume of all static parts: the light in use, and what the base sweeps.

Distances to both are in closed form. A round cone of light, a ball or a cross-section that turns
about the axis between two azimuths is nearest to a point at the azimuth nearest to the point's.
"""

from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass

import numpy as np
from scipy.spatial import ConvexHull

from tbcad.core.geometry.primitives import Primitive, enclosing_triangles, rectangle
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.round_cones import RoundCones
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.ball_light import light_hulls
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import FACETS_OUT_MM, BaseLayout
from tbcad.prototype.base.profile import offset, shortened
from tbcad.prototype.keepout_distances import (
    azimuth_ranges,
    cone_table,
    distances_to_balls,
    distances_to_cones,
    lower_to_section,
)
from tbcad.types import Floats

# Smallest distances are exact to this, or to this share of them, and never too large: where two
# faces are parallel, a closer search would not end.
EXACT_MM = 0.05
EXACT = 0.1
CIRCLE_SIDES = 48
MAX_SPLITS = 60


@dataclass(frozen=True)
class SweptSection:
    """A cross-section that is turned about the axis."""

    polygon: Floats  # (z along the axis, r), mm, (p, 2)
    low: float  # smallest azimuth it reaches, radians
    high: float  # largest one

    @property
    def azimuths(self) -> tuple[float, float]:
        """The range that it reaches."""
        return self.low, self.high


@dataclass(frozen=True)
class KeepOut:
    """The volume that static parts must keep out of; azimuths in radians."""

    frame: Floats  # rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3)
    capture: float  # radius of the capture sphere, mm
    cones: RoundCones  # all light, first capture sphere to ball, then ball to pinhole, (2 k,)
    used: Floats  # smallest and largest azimuth at which each cone is in use, (2 k, 2)
    centre: Floats  # of the balls, (z, r), mm, (k, 2)
    radius: Floats  # of the balls, mm, (k,)
    swung: Floats  # smallest and largest azimuth of each ball, (k, 2)
    # wall, ribs and bosses over the whole swing, and the hub all round
    sections: tuple[SweptSection, ...]
    # the same while the base is at its stops or between them; None: this is that
    at_stops: "KeepOut | None" = None

    def to_light(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light in use, mm, (n,); negative in it."""
        cones, ranges = cone_table(self.cones), azimuth_ranges(self.used)
        return distances_to_cones(_cylindrical(self.frame, points), cones, ranges)

    def to_light_outside_sphere(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to the light outside the capture sphere, mm, (n,).

        What is inside the sphere is part of the scene. The distance is never too large; negative
        in the light.
        """
        return np.maximum(self.to_light(points), self.capture - norm(points))

    def to_swept(self, points: Floats) -> Floats:
        """Distance of points (n, 3) to what the base sweeps over its swing, mm, (n,)."""
        local, swung = _cylindrical(self.frame, points), azimuth_ranges(self.swung)
        nearest = distances_to_balls(local, self.centre, self.radius, swung)
        for section in self.sections:
            (turned,) = azimuth_ranges(np.array([section.azimuths]))
            lower_to_section(local, section.polygon, turned, nearest)
        return nearest


def keep_out_volume(
    prototype: PrototypeLayout, base: BaseLayout, capture: float, approach: float
) -> KeepOut:
    """The keep-out volume of a prototype.

    Args:
        prototype: balls, their places and stops.
        base: that carries them.
        capture: radius of the capture sphere, mm.
        approach: angle by which the base starts below its first stop, radians.
    """
    stops, azimuth = prototype.stops, prototype.placement.azimuth
    angle = stops.angle[stops.stop]
    of_ball = [angle[prototype.fit.ball == k] for k in range(len(prototype))]
    used = np.array([(angles.min(), angles.max()) for angles in of_ball]) + azimuth[:, None]
    to_object, to_camera = light_hulls(prototype.balls.outline, base.light.pinhole, capture)
    swing = np.array([min(float(angle.min()), 0.0) - approach, max(float(angle.max()), 0.0)])
    return KeepOut(
        at_stops=keep_out_volume(prototype, base, capture, 0.0) if approach else None,
        frame=base.frame,
        capture=capture,
        cones=RoundCones(
            *map(np.concatenate, zip(astuple(to_object), astuple(to_camera), strict=True))
        ),
        used=np.concatenate([used, used]),
        centre=prototype.balls.body_centre[:, :2],
        radius=prototype.balls.body_radius,
        swung=azimuth[:, None] + swing,
        sections=_sections(base, swing),
    )


def min_distance(
    distance: Callable[[Floats], Floats], bodies: Iterable[Primitive], enough: float = 0.0
) -> float:
    """Smallest distance of the surfaces of bodies by a function of points (n, 3), mm.

    Never too large, and too small by at most EXACT_MM or a share EXACT: a distance changes by no
    more than the point moves, so each triangle bounds it, and those that may hold the smallest are
    split. A distance below `enough` ends the search: a body that collides is refused anyway.
    """
    triangles = np.concatenate([enclosing_triangles(body) for body in bodies])
    best = np.inf
    for _ in range(MAX_SPLITS):
        centre = triangles.mean(axis=1)
        reach, at_centre = norm(triangles - centre[:, None]).max(axis=1), distance(centre)
        best = min(best, float(at_centre.min()))
        triangles = _split(triangles[at_centre - reach < best - _uncertainty(best)])
        if not len(triangles) or best < enough + EXACT_MM:
            break
    return best - _uncertainty(best)


def _uncertainty(distance: float) -> float:
    return max(EXACT_MM, EXACT * distance)


def _split(triangles: Floats) -> Floats:
    """Each triangle as four, by the middles of its sides."""
    middle = (triangles + np.roll(triangles, -1, axis=1)) / 2
    tips = np.stack([triangles, middle, np.roll(middle, 1, axis=1)], axis=2).reshape(-1, 3, 3)
    return np.concatenate([tips, middle])


def _sections(base: BaseLayout, swing: Floats) -> tuple[SweptSection, ...]:
    low, high = base.sector[0] + float(swing[0]), base.sector[1] + float(swing[1])
    wall = _wall(base)
    ribs = np.vstack([base.outline, base.inner[::-1]])
    bosses = [_boss(base, k) for k in range(len(base.seats))]
    hub = base.hub
    discs = [rectangle((hub.back, 0.0), (hub.front, hub.disc))]
    discs += [rectangle((hub.face, 0.0), (hub.back, hub.boss))] if hub.boss else []
    turning = [SweptSection(polygon, low, high) for polygon in (wall, ribs, *base.rings, *bosses)]
    return (*turning, *(SweptSection(polygon, -np.pi, np.pi) for polygon in discs))


def _wall(base: BaseLayout) -> Floats:
    """Section of the wall with the edges of its facets, which are off its cones, (z, r), (p, 2)."""
    line = shortened(base.inner, -FACETS_OUT_MM)
    return np.vstack([line, offset(line, base.spec.thickness_mm + FACETS_OUT_MM)[::-1]])


def _boss(base: BaseLayout, k: int) -> Floats:
    """Hull of a boss and its number in (z, r), (p, 2)."""
    seats = base.seats
    radius = float(seats.boss[k]) / np.cos(np.pi / CIRCLE_SIDES)
    circle = radius * unit_circle(even_angles(CIRCLE_SIDES)) @ seats.axes[k, :2]
    lengths = (seats.front[k], seats.back[k] + base.spec.relief_mm)
    ends = [seats.centre[k] + length * seats.axes[k, 2] + circle for length in lengths]
    section = _cylindrical(base.frame, np.vstack(ends))[:, :2]
    return np.asarray(section[ConvexHull(section).vertices])


def _cylindrical(frame: Floats, points: Floats) -> Floats:
    """Points (n, 3) as z, r and azimuth about the first row of a frame, (n, 3)."""
    z, out, third = (points @ frame.T).T
    return np.stack([z, np.hypot(out, third), np.arctan2(third, out)], axis=1)

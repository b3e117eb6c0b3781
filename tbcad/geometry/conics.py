"""Ellipses in space: plane sections of an ellipsoid of revolution, exact."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tbcad.geometry.ellipsoid import Ellipsoid
from tbcad.geometry.vectors import dot, norm, perpendicular_axes
from tbcad.types import Floats


@dataclass(frozen=True)
class Ellipse:
    """The points centre + cos(t) major + sin(t) minor.

    Attributes:
        centre: mm, (3,).
        major: semi-major axis vector, mm, (3,).
        minor: semi-minor axis vector, mm, (3,), perpendicular to it.
    """

    centre: Floats
    major: Floats
    minor: Floats

    def at(self, t: ArrayLike) -> Floats:
        """Points (..., 3) at parameters t (...), radians."""
        turn: Floats = np.asarray(t, dtype=float)[..., None]
        return self.centre + np.cos(turn) * self.major + np.sin(turn) * self.minor

    def parameter(self, point: Floats) -> float:
        """Parameter t of a point (3,) on the ellipse, radians."""
        away = point - self.centre
        cosine = away @ self.major / (self.major @ self.major)
        sine = away @ self.minor / (self.minor @ self.minor)
        return float(np.arctan2(sine, cosine))

    def moved(self, shift: Floats) -> "Ellipse":
        """The ellipse moved by a vector (3,), mm."""
        return Ellipse(self.centre + shift, self.major, self.minor)

    def arc(self, start: Floats, end: Floats, through: Floats) -> "EllipseArc":
        """The arc from start to end on the side of the ellipse toward a third point."""
        first, last, middle = (self.parameter(point) for point in (start, end, through))
        forward = (last - first) % (2 * np.pi)
        if (middle - first) % (2 * np.pi) > forward:
            forward -= 2 * np.pi
        return EllipseArc(self, first, first + forward)


@dataclass(frozen=True)
class EllipseArc:
    """Part of an ellipse from parameter first to last, which may run backward."""

    ellipse: Ellipse
    first: float
    last: float

    def at(self, share: ArrayLike) -> Floats:
        """Points (..., 3) at shares (...) of the way in the parameter."""
        return self.ellipse.at(self.first + np.asarray(share) * (self.last - self.first))

    def moved(self, shift: Floats) -> "EllipseArc":
        """The arc moved by a vector (3,), mm."""
        return EllipseArc(self.ellipse.moved(shift), self.first, self.last)

    def reversed(self) -> "EllipseArc":
        """The same arc from end to start."""
        return EllipseArc(self.ellipse, self.last, self.first)

    def by_length(self, share: ArrayLike) -> Floats:
        """Points (..., 3) at shares (...) of the arc's length, to a part in 10^4."""
        dense = np.linspace(0, 1, 2001)
        steps = norm(np.diff(self.at(dense), axis=0))
        length = np.concatenate([[0], np.cumsum(steps)])
        return self.at(np.interp(np.asarray(share) * length[-1], length, dense))

    @property
    def length(self) -> float:
        """Length of the arc, mm."""
        return float(norm(np.diff(self.at(np.linspace(0, 1, 2001)), axis=0)).sum())


@dataclass(frozen=True)
class Spheroid:
    """An ellipsoid's outward neighbour with the same centre and axis, each semi-axis longer.

    Attributes:
        ellipsoid: the optical ellipsoid.
        offset: added to both semi-axes, mm.
    """

    ellipsoid: Ellipsoid
    offset: float

    @property
    def centre(self) -> Floats:
        """Centre, half way between the foci, mm, (3,)."""
        return self.ellipsoid.pinhole / 2

    @property
    def semi_axes(self) -> tuple[float, float]:
        """Semi-axis along w and across it, mm."""
        return self.ellipsoid.semi_major + self.offset, self.ellipsoid.semi_minor + self.offset

    @property
    def from_sphere(self) -> Floats:
        """Matrix (3, 3) that maps the unit sphere to the spheroid about its centre."""
        along = np.outer(self.ellipsoid.axis, self.ellipsoid.axis)
        major, minor = self.semi_axes
        return major * along + minor * (np.eye(3) - along)

    def section(self, normal: Floats, height: float) -> Ellipse:
        """Ellipse in the plane normal . x = height.

        Raises:
            ValueError: when the plane misses the spheroid.
        """
        matrix = self.from_sphere
        across = matrix @ normal
        size = float(np.linalg.norm(across))
        offset = (height - normal @ self.centre) / size
        if abs(offset) >= 1:
            raise ValueError("the plane does not meet the ellipsoid")
        across = across / size
        first, second = -perpendicular_axes(across)
        radius = np.sqrt(1 - offset**2)
        p, q = radius * matrix @ first, radius * matrix @ second
        # Conjugate half-diameters p, q to principal ones.
        turn = np.arctan2(2 * p @ q, p @ p - q @ q) / 2
        major = np.cos(turn) * p + np.sin(turn) * q
        minor = -np.sin(turn) * p + np.cos(turn) * q
        return Ellipse(self.centre + offset * matrix @ across, major, minor)

    def crossing(self, x: float, z: float) -> Floats:
        """The two points (2, 3) with given x and z, lower y first.

        Raises:
            ValueError: when there are none.
        """
        to_sphere = np.linalg.inv(self.from_sphere)
        base = to_sphere @ (np.array([x, 0.0, z]) - self.centre)
        step = to_sphere @ np.array([0.0, 1.0, 0.0])
        a, b, c = step @ step, base @ step, base @ base - 1
        if b * b <= a * c:
            raise ValueError("the line does not meet the ellipsoid")
        y = (-b + np.array([-1.0, 1.0]) * np.sqrt(b * b - a * c)) / a
        return np.column_stack([np.full(2, x), y, np.full(2, z)])


def enclosing_offset(ellipsoid: Ellipsoid, points: Floats) -> float:
    """Least offset of a spheroid that holds all points (k, 3), mm."""
    away = points - ellipsoid.pinhole / 2
    along = away @ ellipsoid.axis
    across = np.sqrt(np.maximum(dot(away, away) - along**2, 0))
    offset = np.zeros(len(points))
    for _ in range(50):
        major, minor = ellipsoid.semi_major + offset, ellipsoid.semi_minor + offset
        value = (along / major) ** 2 + (across / minor) ** 2 - 1
        slope = -2 * (along**2 / major**3 + across**2 / minor**3)
        step = value / slope
        offset = offset - step
        if np.abs(step).max() < 1e-12:
            break
    return float(offset.max())


def wall_offset(ellipsoid: Ellipsoid, inner: float, wall: float) -> float:
    """Least offset of a spheroid that keeps a wall (mm) everywhere from the spheroid at inner.

    Both are convex: their least distance is the least difference of their support functions.
    """
    angle = np.linspace(0, np.pi / 2, 1001)
    cosine, sine = np.cos(angle), np.sin(angle)

    def support(offset: float) -> Floats:
        major, minor = ellipsoid.semi_major + offset, ellipsoid.semi_minor + offset
        return np.hypot(major * cosine, minor * sine)

    outer = inner + wall
    for _ in range(50):
        short = wall - float(np.min(support(outer) - support(inner)))
        outer += short
        if abs(short) < 1e-12:
            break
    return outer

"""The ellipsoid of one camera, and ellipses in space: its plane sections, exact."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.types import Floats

MAX_ITERATIONS = 50
CONVERGED_MM = 1e-12
# Chords along an arc whose length is measured, and angles of a quarter of a spheroid's meridian.
LENGTH_SAMPLES = 2001
SUPPORT_SAMPLES = 1001


@dataclass(frozen=True)
class Ellipsoid:
    """Prolate ellipsoid of revolution with one focus at the origin (DESIGN.md section 2)."""

    pinhole: Floats  # second focus, the camera's pinhole, mm, shape (3,)
    semi_minor: float  # b, mm

    @property
    def linear_eccentricity(self) -> float:
        """Linear eccentricity c, half the distance of the foci, mm."""
        return float(np.linalg.norm(self.pinhole)) / 2

    @property
    def semi_major(self) -> float:
        """Semi-major axis a = sqrt(b^2 + c^2), mm."""
        return float(np.hypot(self.semi_minor, self.linear_eccentricity))

    @property
    def axis(self) -> Floats:
        """Unit vector w from the origin to the pinhole, shape (3,)."""
        return unit(self.pinhole)

    @property
    def camera_distance(self) -> float:
        """Distance d = 2a of every virtual camera from the origin, mm."""
        return 2 * self.semi_major

    def radial_distance(self, u: Floats) -> Floats:
        """Distance rho of the ellipsoid from the origin along u (m, 3), mm, shape (m,)."""
        along = u @ self.axis
        return np.asarray(self.semi_minor**2 / (self.semi_major - self.linear_eccentricity * along))

    def apices(self, u: Floats) -> Floats:
        """Apex P = rho u of each mirror, mm, shape (m, 3)."""
        return self.radial_distance(u)[:, None] * u

    def normals(self, u: Floats) -> Floats:
        """Unit normals (m, 3) at the apices, inward: they bisect -u and the ray to the pinhole."""
        to_pinhole = self.pinhole - self.apices(u)
        return unit(unit(to_pinhole) - u)

    def frame(self) -> Floats:
        """Right-handed frame, rows (3, 3): axis w, direction of azimuth zero, azimuth 90 degrees.

        Azimuth is counted about w from the side of the mirrors (the zenith has azimuth zero).
        """
        w = self.axis
        up = unit(np.array([0.0, 0.0, 1.0]) - w[2] * w)
        return np.stack([w, up, np.cross(w, up)])

    def polar_azimuth(self, u: Floats) -> tuple[Floats, Floats]:
        """Polar angle and azimuth of u (m, 3) about w, radians, each (m,)."""
        along, zero, quarter = (u @ self.frame().T).T
        return np.arccos(np.clip(along, -1, 1)), np.arctan2(quarter, zero)


@dataclass(frozen=True)
class Ellipse:
    """The points centre + cos(t) major + sin(t) minor."""

    centre: Floats  # mm, (3,)
    major: Floats  # semi-major axis vector, mm, (3,)
    minor: Floats  # semi-minor axis vector, mm, (3,), perpendicular to it

    def at(self, t: ArrayLike) -> Floats:
        """Points (..., 3) at parameters t (...), radians."""
        angle: Floats = np.asarray(t, dtype=float)[..., None]
        return self.centre + np.cos(angle) * self.major + np.sin(angle) * self.minor

    def parameter(self, point: Floats) -> float:
        """Parameter t of a point (3,) on the ellipse, radians."""
        from_centre = point - self.centre
        cosine = from_centre @ self.major / (self.major @ self.major)
        sine = from_centre @ self.minor / (self.minor @ self.minor)
        return float(np.arctan2(sine, cosine))

    def moved(self, shift: Floats) -> "Ellipse":
        """The ellipse moved by a vector (3,), mm."""
        return Ellipse(self.centre + shift, self.major, self.minor)

    def arc(self, start: Floats, end: Floats, through: Floats) -> "EllipseArc":
        """The arc between two points (3,) on the side of the ellipse toward a third point."""
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
        """Points (..., 3) at shares (...) of the parameter's range."""
        return self.ellipse.at(self.first + np.asarray(share) * (self.last - self.first))

    def moved(self, shift: Floats) -> "EllipseArc":
        """The arc moved by a vector (3,), mm."""
        return EllipseArc(self.ellipse.moved(shift), self.first, self.last)

    def by_length(self, share: ArrayLike) -> Floats:
        """Points (..., 3) at shares (...) of the arc's length, to a part in 10^4."""
        dense = np.linspace(0, 1, LENGTH_SAMPLES)
        length = np.concatenate([[0], np.cumsum(self._chords())])
        return self.at(np.interp(np.asarray(share) * length[-1], length, dense))

    @property
    def length(self) -> float:
        """Length of the arc, mm."""
        return float(self._chords().sum())

    def _chords(self) -> Floats:
        return norm(np.diff(self.at(np.linspace(0, 1, LENGTH_SAMPLES)), axis=0))


@dataclass(frozen=True)
class Spheroid:
    """The spheroid outside an ellipsoid with the same centre and axis, both semi-axes longer."""

    ellipsoid: Ellipsoid  # the optical ellipsoid
    offset: float  # added to both semi-axes, mm

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

    def widened(self, offset: float) -> "Spheroid":
        """The spheroid with both semi-axes longer by an offset, mm."""
        return Spheroid(self.ellipsoid, self.offset + offset)

    def section(self, normal: Floats, height: float) -> Ellipse:
        """Ellipse in the plane normal . x = height; ValueError where that misses the spheroid."""
        matrix = self.from_sphere
        # The plane in the space where the spheroid is the unit sphere.
        scaled = matrix @ normal
        length = float(np.linalg.norm(scaled))
        distance = (height - normal @ self.centre) / length
        if abs(distance) >= 1:
            raise ValueError("the plane does not meet the ellipsoid")
        axis = scaled / length
        first, second = -perpendicular_axes(axis)
        radius = np.sqrt(1 - distance**2)
        p, q = radius * matrix @ first, radius * matrix @ second
        # Conjugate half-diameters p, q to principal ones.
        angle = np.arctan2(2 * p @ q, p @ p - q @ q) / 2
        major = np.cos(angle) * p + np.sin(angle) * q
        minor = -np.sin(angle) * p + np.cos(angle) * q
        return Ellipse(self.centre + distance * matrix @ axis, major, minor)

    def crossing(self, x: float, z: float) -> Floats:
        """The two points (2, 3) at given x and z, mm, lower y first; ValueError if none."""
        to_sphere = np.linalg.inv(self.from_sphere)
        base = to_sphere @ (np.array([x, 0.0, z]) - self.centre)
        step = to_sphere @ np.array([0.0, 1.0, 0.0])
        a, b, c = step @ step, base @ step, base @ base - 1
        if b * b <= a * c:
            raise ValueError("the line does not meet the ellipsoid")
        y = (-b + np.array([-1.0, 1.0]) * np.sqrt(b * b - a * c)) / a
        return np.column_stack([np.full(2, x), y, np.full(2, z)])


def enclosing_offset(ellipsoid: Ellipsoid, points: Floats) -> float:
    """Smallest offset of a spheroid that encloses all points (k, 3), mm, by Newton's method."""
    from_centre = points - ellipsoid.pinhole / 2
    along = from_centre @ ellipsoid.axis
    across = np.sqrt(np.maximum(dot(from_centre, from_centre) - along**2, 0))
    offset = np.zeros(len(points))
    for _ in range(MAX_ITERATIONS):
        major, minor = ellipsoid.semi_major + offset, ellipsoid.semi_minor + offset
        value = (along / major) ** 2 + (across / minor) ** 2 - 1
        slope = -2 * (along**2 / major**3 + across**2 / minor**3)
        step = value / slope
        offset = offset - step
        if np.abs(step).max() < CONVERGED_MM:
            break
    return float(offset.max())


def wall_offset(ellipsoid: Ellipsoid, inner: float, wall: float) -> float:
    """Smallest offset of a spheroid that leaves a wall (mm) to the spheroid at an inner offset.

    Both are convex: their smallest distance is the smallest difference of their support functions.
    """
    angle = np.linspace(0, np.pi / 2, SUPPORT_SAMPLES)

    def support(offset: float) -> Floats:
        major, minor = Spheroid(ellipsoid, offset).semi_axes
        return np.hypot(major * np.cos(angle), minor * np.sin(angle))

    outer = inner + wall
    for _ in range(MAX_ITERATIONS):
        shortfall = wall - float(np.min(support(outer) - support(inner)))
        outer += shortfall
        if abs(shortfall) < CONVERGED_MM:
            break
    return outer

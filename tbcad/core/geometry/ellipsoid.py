"""The ellipsoid of one camera: foci at the origin and at the pinhole."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import unit
from tbcad.types import Floats


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

"""Fronts of caps that are no spheres: rays off them, from the terms that a calibration found.

A term is its Zernike polynomial times its root mean square over the disc of the part in use (Noll
1976), written out in x and y across the apex's normal over the disc's radius. The front is farther
from the sphere's centre than its radius by their sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from tbcad_verify.mesh.surfaces import ReflectedRays, reflect_directions
from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.types import Floats, Ints

ROUNDS = 4  # in which the radius where a ray meets the front is found
TERMS = 7


@dataclass(frozen=True)
class Fronts:
    """Fronts of m balls in their places."""

    centre: Floats  # (3, m) mm
    radius: Floats  # (m,) mm
    across: Floats  # (2, 3, m) unit directions of x and y
    half: Floats  # (m,) mm, radius of the disc; 1 where there are no terms
    terms: Floats  # (7, m) mm

    def rays(
        self, pinhole: Floats, which: Ints, d: Floats, spheres: ReflectedRays
    ) -> ReflectedRays:
        """Rays d (3, N) from the pinhole off fronts (N,), from those off their spheres."""
        made = np.flatnonzero(self.terms[:, which].any(axis=0) & np.isfinite(spheres.reach))
        point, toward, reach = spheres.point.copy(), spheres.toward.copy(), spheres.reach.copy()
        k, ray = which[made], d[:, made]
        away = pinhole[:, None] - self.centre[:, k]
        length = norm(ray)
        along, beside = dot(away, ray) / length, dot(away, away)
        offset = point[:, made] - self.centre[:, k]
        with np.errstate(invalid="ignore"):
            for _ in range(ROUNDS):
                larger = self.radius[k] + self.height(k, offset)
                step = -along - np.sqrt(larger**2 - beside + along**2)
                offset = away + step / length * ray
        reach[made], point[:, made] = step / length, offset + self.centre[:, k]
        toward[:, made] = reflect_directions(ray, unit(unit(offset) - self.gradient(k, offset)))
        return ReflectedRays(point, toward, reach)

    def height(self, k: Ints, offset: Floats) -> Floats:
        """(N,) mm of fronts (N,) at offsets (3, N) from their centres."""
        x, y = self._place(k, offset)
        r2 = x * x + y * y
        one, two, three, four, five, six, last = self.terms[:, k]
        return np.asarray(
            sqrt(6) * (2 * one * x * y + two * (x * x - y * y))
            + sqrt(8) * (3 * r2 - 2) * (three * y + four * x)
            + sqrt(8) * (five * (3 * x * x - y * y) * y + six * (x * x - 3 * y * y) * x)
            + sqrt(5) * last * ((6 * r2 - 6) * r2 + 1)
        )

    def gradient(self, k: Ints, offset: Floats) -> Floats:
        """(3, N) of the heights in space."""
        x, y = self._place(k, offset)
        r2 = x * x + y * y
        one, two, three, four, five, six, last = self.terms[:, k]
        tilt = three * y + four * x
        ring = sqrt(5) * last * (24 * r2 - 12)
        along = sqrt(6) * 2 * (one * y + two * x) + ring * x
        along += sqrt(8) * (6 * x * tilt + (3 * r2 - 2) * four)
        along += sqrt(8) * (five * 6 * x * y + six * 3 * (x * x - y * y))
        across = sqrt(6) * 2 * (one * x - two * y) + ring * y
        across += sqrt(8) * (6 * y * tilt + (3 * r2 - 2) * three)
        across += sqrt(8) * (five * 3 * (x * x - y * y) - six * 6 * x * y)
        first, second = self.across[:, :, k]
        return np.asarray((along * first + across * second) / self.half[k])

    def _place(self, k: Ints, offset: Floats) -> Floats:
        return np.asarray(np.einsum("ain,in->an", self.across[:, :, k], offset) / self.half[k])

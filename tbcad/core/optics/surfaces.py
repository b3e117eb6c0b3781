"""Mirror surfaces in one implicit form for spheres and planes.

A point x is on the light's side of mirror i where f_i(x) > 0 with

    f(x) = N . (x - P) + (k / 2) |x - P|^2

for apex P, inward unit normal N and curvature k = 1 / r. A plane is k = 0, so no radius is ever
infinite. For k > 0, 2 r f is the power of x with respect to the sphere.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import FLIP_X, dot, norm
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class Surfaces:
    """Mirror surfaces (and bounding planes) as arrays over m of them."""

    apex: Floats  # points P on the surfaces, mm, (m, 3)
    normal: Floats  # unit normals N at the apices toward the light, (m, 3)
    curvature: Floats  # k = 1 / r >= 0, 1/mm, (m,)

    def __len__(self) -> int:
        return len(self.curvature)

    def __repr__(self) -> str:
        return f"<Surfaces: {len(self)}, {np.count_nonzero(self.curvature)} of them spherical>"

    @property
    def gradient_at_origin(self) -> Floats:
        """Gradient g of f(x) = (k/2) |x|^2 + g . x + h, (m, 3)."""
        return self.normal - self.curvature[:, None] * self.apex

    @property
    def value_at_origin(self) -> Floats:
        """Constant h of f(x) = (k/2) |x|^2 + g . x + h, (m,)."""
        squared = dot(self.apex, self.apex)
        value: Floats = self.curvature / 2 * squared
        return value - dot(self.normal, self.apex)

    @property
    def radius(self) -> Floats:
        """Radii, mm, (m,); NaN for planes."""
        radius = np.full(len(self), np.nan)
        np.divide(1, self.curvature, out=radius, where=self.curvature > 0)
        return radius

    @property
    def centre(self) -> Floats:
        """Sphere centres C = P - r N, mm, (m, 3); NaN for planes."""
        return self.apex - self.radius[:, None] * self.normal

    def value(self, i: Ints, x: Floats) -> Floats:
        """f_i at the points x (..., 3), for indices i (...)."""
        from_apex = x - self.apex[i]
        squared = dot(from_apex, from_apex)
        height: Floats = dot(self.normal[i], from_apex)
        return height + self.curvature[i] / 2 * squared

    def gradient(self, i: Ints, x: Floats) -> Floats:
        """Gradient of f_i at x (..., 3); on the surface itself the unit normal toward the light."""
        return self.normal[i] + self.curvature[i][..., None] * (x - self.apex[i])

    def first_reach(self, i: Ints, origin: Floats, ray: Floats) -> Floats:
        """How many lengths of rays (..., 3) from an origin (3,) lie before surfaces i (...).

        The origin is on their light's side. The root of f(origin + s ray) = 0 is written so that it
        holds for planes too; it is NaN for rays that miss.
        """
        k, squared = self.curvature[i], dot(ray, ray)
        value = self.value(i, np.broadcast_to(origin, ray.shape))
        slope = dot(ray, self.gradient(i, np.broadcast_to(origin, ray.shape)))
        return np.asarray(2 * value / (np.sqrt(slope**2 - 2 * k * squared * value) - slope))

    def projected(self, i: Ints, x: Floats) -> Floats:
        """Points x (k, 3) moved onto the spheres i (k,) along their radii."""
        centre = self.centre[i]
        from_centre = x - centre
        from_centre *= (self.radius[i] / norm(from_centre))[:, None]
        return centre + from_centre

    def subset(self, which: slice | Ints) -> "Surfaces":
        """Some of the surfaces, by a slice or by indices."""
        return Surfaces(*(array[which] for array in self._arrays()))

    def with_curvature(self, curvature: Floats) -> "Surfaces":
        """The same apices and normals with other curvatures (m,), 1/mm."""
        return Surfaces(self.apex, self.normal, curvature)

    def offset(self, distance: float) -> "Surfaces":
        """Parallel surfaces, moved by distance (mm) along the normals: centres stay, radii grow."""
        apex = self.apex + distance * self.normal
        curvature = self.curvature / (1 + distance * self.curvature)
        return Surfaces(apex, self.normal, curvature)

    def mirrored(self) -> "Surfaces":
        """Camera b's surfaces for camera a's: the mirror image in the plane x = 0."""
        return Surfaces(self.apex * FLIP_X, self.normal * FLIP_X, self.curvature)

    def joined(self, other: "Surfaces") -> "Surfaces":
        """These surfaces followed by the other ones."""
        pairs = zip(self._arrays(), other._arrays(), strict=True)
        return Surfaces(*(np.concatenate(pair) for pair in pairs))

    def _arrays(self) -> tuple[Floats, Floats, Floats]:
        return self.apex, self.normal, self.curvature


def planes(points: Floats, normals: Floats) -> Surfaces:
    """Planes through points (k, 3) with unit normals (k, 3)."""
    return Surfaces(np.asarray(points, float), np.asarray(normals, float), np.zeros(len(points)))

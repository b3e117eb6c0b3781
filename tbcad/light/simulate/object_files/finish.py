"""Roughness, metal and reflectance of an object's facets, as its materials say.

Of glTF 2.0 (ISO/IEC 12113, appendix B): alpha is the square of the roughness; a dielectric reflects
F0 = 0.04 at normal incidence, ((n - 1) / (n + 1))^2 for an index n, metals their base colour. Of
MTL, whose highlight is Ks (H N)^Ns for matt white of 1 (Wavefront, Advanced Visualizer, appendix
B): alpha^2 = 2 / (Ns + 2) (B. Walter and others, EGSR 2007, section 5.2), and an F0 that gives a
highlight of the same height, F0 / (4 alpha^2) = Ks. Colours are shares as they are shown.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from tbcad.core.optics.microfacets import NO_DIELECTRIC
from tbcad.types import Floats, Ints

F0 = 0.04  # of a dielectric of index 1.5
MOST_DIELECTRIC = 0.2  # that diamond nearly has
LEAST_ROUGHNESS = 0.05  # as that of --gloss: highlights of smoother ones are finer than pixels


@dataclass(frozen=True)
class Finish:
    """How facets shine."""

    roughness: Floats  # its square is GGX's alpha; NaN: matt, (f,)
    metal: Floats  # share that is metal, whose colour is that of its highlights, (f,)
    f0: Floats  # share reflected at normal incidence where it is no metal, (f, 3)

    @classmethod
    def even(
        cls,
        facets: int,
        roughness: Floats | float = np.nan,
        metal: Floats | float = 0.0,
        f0: Floats | Sequence[float] | float = F0,
    ) -> "Finish":
        """One for all facets, or with one number (f,) for each; as it is given, matt."""
        rough = np.clip(np.broadcast_to(roughness, facets), LEAST_ROUGHNESS, 1)
        share = np.clip(np.broadcast_to(metal, facets), 0, 1)
        return cls(rough, share, np.clip(np.broadcast_to(f0, (facets, 3)), 0, 1))

    @property
    def index(self) -> Floats:
        """Indices of refraction (f,); of metals, and of what reflects as much, NO_DIELECTRIC."""
        root = np.sqrt(np.minimum(self.f0.max(axis=1), MOST_DIELECTRIC))
        metal = (self.metal > 0.5) | (self.f0.max(axis=1) > MOST_DIELECTRIC)
        return np.where(metal, NO_DIELECTRIC, (1 + root) / (1 - root))

    def of(self, facets: Ints) -> "Finish":
        """That of some facets (k,)."""
        return Finish(self.roughness[facets], self.metal[facets], self.f0[facets])

    def text(self) -> str:
        """Words for the user."""
        shines = np.isfinite(self.roughness)
        low, high = np.quantile(self.roughness[shines], (0, 1))
        range_of = f"{low:.2g}" if high - low < 5e-3 else f"{low:.2g} to {high:.2g}"
        told = [f"roughness {range_of}"]
        told += [f"{self.metal.mean():.0%} metal"] if self.metal.any() else []
        told += [f"{1 - shines.mean():.0%} matt"] if not shines.all() else []
        return ", ".join(told)


def joined(every: Sequence[Finish]) -> Finish:
    """That of facets one after the other."""
    names = [one.name for one in fields(Finish)]
    return Finish(*(np.concatenate([getattr(one, name) for one in every]) for name in names))


def dielectric_f0(index: float) -> float:
    """Share that a dielectric reflects at normal incidence, by its index of refraction."""
    return ((index - 1) / (index + 1)) ** 2


def phong_finish(facets: int, exponent: float, specular: Sequence[float]) -> Finish:
    """A finish by MTL's Ns and Ks (3,)."""
    alpha2 = 2 / (max(exponent, 0.0) + 2)
    return Finish.even(facets, alpha2**0.25, 0.0, np.minimum(4 * alpha2 * np.array(specular), 1))

"""Highlights of lamps on a glossy object: each lamp as it is seen, by GGX's microfacets."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.loop_vectors import dot, vector
from tbcad.core.optics.microfacets import axes_about, reflected_face
from tbcad.light.simulate.object_files.finish import Finish
from tbcad.light.simulate.scene.cast_light import CastLight
from tbcad.light.simulate.scene.mirror_glow import MirrorGlow, glow
from tbcad.types import Bools, Floats, Ints


@dataclass(frozen=True)
class Gloss:
    """How a glossy object reflects its lamps: microfacets after GGX, by Smith's shadowing.

    Source: B. Walter and others, Microfacet Models for Refraction, EGSR 2007; alpha is the square
    of the roughness, as in glTF. Dielectrics reflect by Fresnel's equations, metals by C. Schlick.
    """

    light: CastLight
    finish: Finish  # of the object's facets
    mirrors: MirrorGlow | None = None  # in which lamps are seen too

    def highlights(
        self,
        facet: Ints,
        corners: Ints,
        behind: Bools,
        spots: tuple[Floats, Floats, Floats, Floats],
        f0: Floats,
    ) -> Floats:
        """Light (k, 3) that goes back along rays from spots on facets (k,) with corners (k, 3).

        `behind` as of SurfaceHits; spots: barycentric weights, places, unit normals, and directions
        of the rays, (k, 3) each; `f0`: shares (k, 3) reflected at normal incidence. 1 is that of a
        matt white surface in full light.
        """
        own = self.finish.of(facet)
        surface = corners, behind.astype(np.int64), own.roughness**4, own.index
        part = _highlights(spots, surface, self.light.shown, self.light.face)
        if (one := self.mirrors) is not None:
            shown = one.distance, one.rough, one.light, one.even
            part += _glows(spots, surface, one.share, shown)
        return np.asarray(part[:, :1] * f0 + part[:, 1:] * (1 - f0))


@compiled_loop
def _highlights(
    spots: tuple[Floats, Floats, Floats, Floats],
    surface: tuple[Ints, Ints, Floats, Floats],
    shown: NDArray[np.float32],
    face: Floats,
) -> Floats:
    """What is to be multiplied by F0, and by 1 - F0, (k, 2)."""
    weight, place, normal, ray = spots
    corners, behind, alpha2, index = surface
    total = np.zeros((len(place), 2))
    for k in range(len(place)):
        point, axes, back = vector(place[k]), axes_about(vector(normal[k])), vector(ray[k])
        if dot(back, axes[2]) >= 0 or not alpha2[k] >= 0:  # NaN: matt
            continue
        for j in range(len(face)):
            own = 0.0
            for i in range(3):
                own += weight[k, i] * shown[corners[k, i], behind[k, i], j]
            if own <= 0:
                continue
            lamp = vector(face[j]), vector(face[j], 3), vector(face[j], 6)
            even, rise = reflected_face(lamp, axes, point, back, alpha2[k], index[k])
            total[k, 0] += own * even
            total[k, 1] += own * rise
    return total


@compiled_loop
def _glows(
    spots: tuple[Floats, Floats, Floats, Floats],
    surface: tuple[Ints, Ints, Floats, Floats],
    share: Floats,
    shown: tuple[float, Floats, NDArray[np.float32], Floats],
) -> Floats:
    """The same of the light by mirrors."""
    weight, place, normal, ray = spots
    corners, behind, alpha2, _ = surface
    total = np.zeros((len(place), 2))
    for k in range(len(place)):
        axes = vector(normal[k]), vector(ray[k])
        if dot(*axes) >= 0 or not alpha2[k] >= 0:
            continue
        own = 0.0
        for i in range(3):
            own += weight[k, i] * share[corners[k, i], behind[k, i]]
        even, rise = glow(vector(place[k]), axes, alpha2[k] ** 0.25, shown)
        total[k, 0] += own * even
        total[k, 1] += own * rise
    return total

"""Points that shine on an object, with cast shadows: the light of lamps, direct only."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad.core.geometry.vectors import dot, norm
from tbcad.types import Floats

# Rays toward a lamp begin so far above the facet that they do not meet it again by rounding, mm.
ABOVE_FACET_MM = 1e-3


@dataclass(frozen=True)
class PointLights:
    """Lamps that are small and shine alike in all directions."""

    place: Floats  # mm, (l, 3)
    # light that falls on a surface at the origin that faces the lamp, red, green and blue, (l, 3);
    # a matt white one that gets 1 is shown as 255
    colour: Floats


@dataclass(frozen=True)
class Spots:
    """Points of a surface."""

    place: Floats  # mm, (k, 3)
    normal: Floats  # unit normals for shading, (k, 3)
    facet_normal: Floats  # unit normals of the facets, on the same side, (k, 3)

    def part(self, some: slice) -> "Spots":
        """Some of them."""
        return Spots(self.place[some], self.normal[some], self.facet_normal[some])


def received_light(embree: Any, spots: Spots, lamp: Floats) -> Floats:
    """Light on spots (k,) of a lamp (3,) that gives 1 to a surface at the origin that faces it.

    After Lambert's cosine law and the inverse square of the distance; 0 in shadow. Light that
    other parts of the object reflect is left out.
    """
    toward = lamp - spots.place
    distance = norm(toward)
    cosine = lit_cosine(embree, spots, toward / distance[:, None])
    return np.asarray(cosine * (lamp @ lamp) / distance**2)


def lit_cosine(embree: Any, spots: Spots, direction: Floats) -> Floats:
    """Cosine (k,) of the angle between normals and unit directions (k, 3) to light; 0 in shadow."""
    cosine = dot(direction, spots.normal)
    faces = np.flatnonzero((cosine > 0) & (dot(direction, spots.facet_normal) > 0))
    start = spots.place[faces] + ABOVE_FACET_MM * spots.facet_normal[faces]
    lit = faces[_free(embree, start, direction[faces])]
    result = np.zeros(len(cosine))
    result[lit] = cosine[lit]
    return result


def _free(embree: Any, start: Floats, direction: Floats) -> Any:
    """Which rays (k, 3) meet nothing; lamps are beyond the whole object."""
    if len(start) == 0:
        return np.zeros(0, dtype=bool)
    hidden = embree.run(start.astype(np.float32), direction.astype(np.float32), query="OCCLUDED")
    return np.asarray(hidden) < 0


def lamp_light(embree: Any, spots: Spots, lights: PointLights) -> Floats:
    """Light on spots (k, 3) of all lamps together."""
    total = np.zeros((len(spots.place), 3))
    for place, colour in zip(lights.place, lights.colour, strict=True):
        total += received_light(embree, spots, place)[:, None] * colour
    return total

"""The light of lamps on an object, direct only: of points with cast shadows, and of rectangles.

The rectangular lamps of a prototype are fixed to the object: they stand so that a half turn about z
leaves the light as it was. They cast no shadows, as the built-in light.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import dot, norm
from tbcad.core.optics.lamp_light import RectangularLamps, irradiance
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.records.prototype import NAME, Prototype
from tbcad.types import Bools, Floats

# Rays toward a lamp begin so far above the facet that they do not meet it again by rounding, mm.
ABOVE_FACET_MM = 1e-3
EXPOSED = 99.0  # percentile of the light on the object that a photograph shows as white


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
    lit = faces[free_rays(embree, start, direction[faces])]
    result = np.zeros(len(cosine))
    result[lit] = cosine[lit]
    return result


def free_rays(embree: Any, start: NDArray[np.floating], direction: NDArray[np.floating]) -> Bools:
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


def read_lamps(folder: Path) -> RectangularLamps | None:
    """The lamps of a build's prototype; None where it has none.

    InputError: the record cannot be read.
    """
    found = Prototype.read(folder / NAME).lamps
    if found is None:
        return None
    places = np.array([place.position_mm for place in found.places])
    inward = np.array([place.direction for place in found.places])
    sides = found.width_mm, found.length_mm
    upper = found.upper
    return RectangularLamps(
        places,
        inward,
        *(sides[::-1] if found.level else sides),
        found.lumen_each,
        np.array([led.position_mm for led in upper.leds] if upper else []).reshape(-1, 3),
        upper.candela_each if upper else 0.0,
    )


def lit_by(lamps: RectangularLamps, subject: SceneObject) -> SceneObject:
    """An object with the light of lamps at its corners, as bright as a good exposure shows it."""
    both = [irradiance(lamps, subject.points, side * subject.normals) for side in (1, -1)]
    return replace(subject, light=exposed(np.column_stack(both)))


def exposed(both: Floats) -> Floats:
    """Light (v, 2) on surfaces and on their backs, lux, as shares of what is shown as white.

    The exposure is that of the outside, or of an open surface whose normals are away from the lamps
    that of its back.
    """
    front, back = np.percentile(both, EXPOSED, axis=0)
    white = float(front or back)
    return np.minimum(both / white, 1.0) if white > 0 else both

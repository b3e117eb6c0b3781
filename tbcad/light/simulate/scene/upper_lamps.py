"""What the LEDs above a prototype's object hide: their boards and rods, as rays meet them.

They are each other's images by the half turn about z, so both runs have them in the same places in
the frame of the object.
"""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.core.geometry.primitives import cylinder_between, enclosing_triangles
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.light.simulate.scene.ray_casting import distances_to, embree_scene
from tbcad.records.prototype import NAME, Prototype
from tbcad.types import Bools, Floats


def upper_facets(folder: Path, wider: bool = False) -> Floats:
    """Facets (f, 3, 3) round boards and rods of a build, mm; without any, or prototype: none.

    wider: by the tolerance of their places, to all sides.

    InputError: the record cannot be read.
    """
    lamps = Prototype.read(folder / NAME).lamps if (folder / NAME).is_file() else None
    if lamps is None or lamps.upper is None:
        return np.zeros((0, 3, 3))
    upper = lamps.upper
    more = upper.tolerance_mm if wider else 0.0
    facets = []
    for led in upper.leds:
        bodies = [(led.head_mm, upper.head_diameter_mm)]
        bodies += [(ends, upper.rod_diameter_mm) for ends in pairwise(led.rod_mm)]
        for ends, diameter in bodies:
            start, end = (np.array(one) for one in ends)
            longer = more * unit(end - start)
            body = cylinder_between(start - longer, end + longer, diameter / 2 + more)
            facets.append(enclosing_triangles(body))
    return np.concatenate(facets)


def upper_screen(folder: Path, wider: bool = False) -> Any | None:
    """The same as a scene; None without any."""
    facets = upper_facets(folder, wider)
    return embree_scene(facets) if len(facets) else None


def hidden_rays(screen: Any | None, pinhole: Floats, point: Floats, direction: Floats) -> Bools:
    """Which of n rays something hides before they are nearest to the origin.

    From a pinhole (3,) to points (n, 3) on balls, and on along unit directions (n, 3).
    """
    if screen is None or len(point) == 0:
        return np.zeros(len(point), dtype=bool)
    to_ball = point - pinhole
    length = np.maximum(norm(to_ball), 1e-9)
    before = distances_to(screen, np.broadcast_to(pinhole, point.shape), to_ball / length[:, None])
    after = distances_to(screen, point, direction)
    return np.asarray((before < length) | (after < np.maximum(-dot(point, direction), 0)))

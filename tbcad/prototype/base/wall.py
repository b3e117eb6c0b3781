"""The carrier's wall: plane facets round cones about the axis.

A plane meets bosses, cups and paths in circles and ellipses; where a cone meets them the kernel
fits splines, which took half of the time of the carrier.
"""

import numpy as np

from tbcad.geometry.rotations import unit_circle
from tbcad.prototype.base.layout import FACETS_OUT_MM, BaseLayout
from tbcad.types import Floats


def wall_facets(base: BaseLayout) -> list[Floats]:
    """All facets (n, 3) of the wall about z, azimuth zero along x, between its sector's azimuths.

    Their middles are on the cones of the meridian section, their edges outside by FACETS_OUT_MM at
    most.
    """
    low, high = base.sector
    z, r = wall_section(base).T
    count = facet_count(float(r.max()), high - low)
    out = unit_circle(np.linspace(low, high, count + 1)) / np.cos((high - low) / (2 * count))
    corners = np.stack(np.broadcast_arrays(*(r * out[:, :1], r * out[:, 1:], z)), axis=-1)
    after = np.roll(corners, -1, axis=1)
    facets = np.stack([corners[:-1], corners[1:], after[1:], after[:-1]], axis=2)
    return [*facets.reshape(-1, 4, 3), corners[0], corners[-1]]


def wall_section(base: BaseLayout) -> Floats:
    """The meridian section of the cones (z, r), mm, (n, 2)."""
    return np.vstack([base.inner, base.outer[::-1]])


def facet_count(radius: float, angle: float) -> int:
    """How many facets about a circle (mm) over an angle (radians) leave it by FACETS_OUT_MM."""
    return int(np.ceil(angle / (2 * np.arccos(radius / (radius + FACETS_OUT_MM)))))

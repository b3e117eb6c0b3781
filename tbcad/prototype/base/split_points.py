"""Points of the base by which its pieces are measured, and the bodies that no cut may touch.

All is in the carrier's own frame: z the axis, x azimuth zero.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tbcad.core.geometry.rotations import even_angles
from tbcad.core.geometry.vectors import norm, perpendicular_axes
from tbcad.prototype.base.joints import flange_top
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import at_azimuths
from tbcad.types import Floats

AZIMUTH_STEP = np.radians(1.5)
STEP_MM = 4.0  # maximum distance of points along a line
RIM_CORNERS = 24


@dataclass(frozen=True)
class RoundBodies:
    """Cylinders that no plane may cut: ends (m, 3) of their axes, radii (m,), mm."""

    start: Floats
    end: Floats
    radius: Floats

    @property
    def axis(self) -> Floats:
        """Unit vectors from start to end, (m, 3)."""
        return np.asarray((self.end - self.start) / norm(self.end - self.start)[:, None])

    def levels(self, normals: Floats) -> tuple[Floats, Floats]:
        """Minimum and maximum level of each along unit normals (n, 3), both (n, m)."""
        across = self.radius * np.sqrt(np.maximum(1 - (normals @ self.axis.T) ** 2, 0))
        ends = np.stack([normals @ self.start.T, normals @ self.end.T])
        return ends.min(axis=0) - across, ends.max(axis=0) + across

    def rims(self) -> Floats:
        """Corners of polygons round both ends of each, (m, 2, RIM_CORNERS, 3)."""
        first, second = np.moveaxis(-perpendicular_axes(self.axis), 1, 0)
        angle = even_angles(RIM_CORNERS)
        circle = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
        circle *= (self.radius / np.cos(np.pi / RIM_CORNERS))[:, None, None]
        ends = np.stack([self.start, self.end], axis=1)
        return np.asarray(ends[:, :, None] + circle[:, None])


def bosses_and_hub(base: BaseLayout) -> RoundBodies:
    """Bosses with their numbers, and last the hub."""
    seats, hub = base.local_seats, base.hub
    up = np.array([0.0, 0.0, 1.0])
    return RoundBodies(
        np.vstack([seats.at_depth(seats.front), hub.face * up]),
        np.vstack([seats.at_depth(seats.back + base.spec.relief_mm), hub.front * up]),
        np.append(seats.boss, max(hub.disc, hub.boss)),
    )


def base_points(base: BaseLayout, bodies: RoundBodies) -> tuple[Floats, Floats, Floats]:
    """Points of a base with its bosses and hub, mm.

    Returns:
        Points in the middle of the wall, a grid over azimuth and meridian, (a, p, 3), points round
        all of the base, (c, 3), and points on the outer faces that flanges could have, (t, 3).
    """
    low, high = base.sector
    azimuth = np.linspace(low, high, int(np.ceil((high - low) / AZIMUTH_STEP)) + 1)
    parts = [
        *(at_azimuths(_dense(line), azimuth) for line in (base.inner, base.outer)),
        at_azimuths(_dense(base.outline), base.ribs),
        *(at_azimuths(ring, azimuth) for ring in base.rings),
        bodies.rims(),
    ]
    return (
        at_azimuths(_dense(base.middle), azimuth),
        np.vstack([part.reshape(-1, 3) for part in parts]),
        at_azimuths(_dense(flange_top(base)), azimuth).reshape(-1, 3),
    )


def _dense(line: Floats) -> Floats:
    """A line (n, 2) with points no farther apart than a step."""
    parts = [
        np.linspace(a, b, int(np.ceil(norm(b - a) / STEP_MM)), endpoint=False)
        for a, b in pairwise(line)
    ]
    return np.vstack([*parts, line[-1:]])

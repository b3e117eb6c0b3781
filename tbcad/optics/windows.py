"""Cells as windows of the camera's picture, and what a ball shows within them."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import dot, unit
from tbcad.optics.ball_light import ball_miss_distances
from tbcad.optics.cells import Cells
from tbcad.optics.trace import limiting_sides
from tbcad.types import Bools, Floats, Ints

# Samples of each side, first over all of it, then about the least: after four rounds they are a
# 512th of the side apart, and the least miss is right to a micrometre.
SAMPLES = 9
ROUNDS = 4


@dataclass(frozen=True)
class SubstituteBalls:
    """A ball for each of m mirrors, and the turn of the mirror's window about the pinhole.

    Attributes:
        centre: centre of the ball, mm, (m, 3).
        radius: mm, (m,).
        axis: unit vectors that the windows turn about, (m, 3).
        turn: radians, (m,).
    """

    centre: Floats
    radius: Floats
    axis: Floats
    turn: Floats


@dataclass(frozen=True)
class Windows:
    """Sides of the cells of all mirrors as the camera sees them, over e of them.

    A cell halved by the seam has no side there: the other half belongs to the other camera and
    shows what this one does not.

    Attributes:
        cells: of m mirrors.
        pinhole: mm, (3,).
        mirror: mirror of each side, (e,).
        arc: arc that it is, (e,).
    """

    cells: Cells
    pinhole: Floats
    mirror: Ints
    arc: Ints

    def only(self, mirrors: Bools) -> "Windows":
        """The sides of some mirrors (m,)."""
        kept = mirrors[self.mirror]
        return Windows(self.cells, self.pinhole, self.mirror[kept], self.arc[kept])

    def rays(self, t: Floats, axis: Floats, turn: Floats) -> Floats:
        """Unit rays (e, s, 3) from the camera through the turned sides at parameters t (e, s)."""
        point = self.cells.arcs.at(np.broadcast_to(self.arc[:, None], t.shape), t)
        ray = unit(point - self.pinhole)
        return rotated(ray, axis[self.mirror][:, None], turn[self.mirror][:, None])

    def coverage(self, pieces: SubstituteBalls) -> Floats:
        """Coverage diameter (m,), mm: twice the least miss of the rays through the windows' edge.

        Whether the ball shows the origin inside the window is asked of `surround`. Infinite for
        mirrors without sides.
        """
        low, high = np.zeros(len(self.arc)), np.ones(len(self.arc))
        centre, radius = pieces.centre[self.mirror][:, None], pieces.radius[self.mirror][:, None]
        row = np.arange(len(self.arc))
        for _ in range(ROUNDS):
            t = np.linspace(low, high, SAMPLES, axis=1)
            miss = ball_miss_distances(
                self.pinhole, self.rays(t, pieces.axis, pieces.turn), centre, radius
            )
            best = np.argmin(miss, axis=1)
            low, high = t[row, np.maximum(best - 1, 0)], t[row, np.minimum(best + 1, SAMPLES - 1)]
        least = np.full(self.cells.mirrors, np.inf)
        np.minimum.at(least, self.mirror, miss.min(axis=1))
        return 2 * least

    def surround(self, direction: Floats, axis: Floats, turn: Floats) -> Bools:
        """Whether each turned window holds a direction (m, 3) as seen from the pinhole, (m,).

        The window's sides turn once about a direction inside and not at all about one outside;
        those of a halved one turn half about the middle of the cut.
        """
        t = np.broadcast_to(np.linspace(0, 1, SAMPLES), (len(self.arc), SAMPLES))
        ray, about = self.rays(t, axis, turn), direction[self.mirror][:, None]
        flat = ray - dot(ray, np.broadcast_to(about, ray.shape))[..., None] * about
        before, after = flat[:, :-1], flat[:, 1:]
        about = np.broadcast_to(about, before.shape)
        angle = np.arctan2(dot(np.cross(before, after), about), dot(before, after)).sum(axis=1)
        forward = self.cells.arcs.left[self.arc] == self.mirror
        total = np.zeros(self.cells.mirrors)
        np.add.at(total, self.mirror, np.where(forward, angle, -angle))
        halved = self.cells.surfaces.apex[: self.cells.mirrors, 0] == 0
        inside: Bools = np.abs(total) > np.where(halved, np.pi / 2, np.pi)
        return inside


def cell_windows(cells: Cells, pinhole: Floats) -> Windows:
    """The windows of all mirrors."""
    return Windows(cells, pinhole, *limiting_sides(cells))


def rotated(vector: Floats, axis: Floats, turn: Floats) -> Floats:
    """Vectors (..., 3) turned about unit axes by angles (...), radians (Rodrigues)."""
    axis = np.broadcast_to(axis, vector.shape)
    cosine, sine = np.cos(turn)[..., None], np.sin(turn)[..., None]
    along = dot(axis, vector)[..., None] * axis
    result: Floats = cosine * vector + sine * np.cross(axis, vector) + (1 - cosine) * along
    return result

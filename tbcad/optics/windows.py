"""Cells as windows of the camera's picture, and what a ball shows within them."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.rotations import rotated
from tbcad.geometry.vectors import dot, unit
from tbcad.optics.cells import Cells
from tbcad.optics.side_rays import misses_of_balls
from tbcad.optics.trace import SAMPLES, limiting_sides, minima_by_mirror, samples_about_minima
from tbcad.types import Bools, Floats, Ints

# After four rounds the samples are a 512th of the side apart, and the smallest miss distance is
# right to a micrometre.
ROUNDS = 4


@dataclass(frozen=True)
class Windows:
    """Sides of the cells of m mirrors as the camera sees them, over e of them.

    A cell halved by the seam has no side there: the other half belongs to the other camera and
    shows what this one does not. Windows can be rotated about axes through the pinhole, each by
    an axis (m, 3) of unit length and an angle (m,) in radians.

    Attributes:
        cells: of the m mirrors.
        pinhole: mm, (3,).
        mirror: mirror of each side, (e,).
        arc: arc of each side, (e,).
    """

    cells: Cells
    pinhole: Floats
    mirror: Ints
    arc: Ints

    def only(self, mirrors: Bools) -> "Windows":
        """The sides of some mirrors (m,)."""
        kept = mirrors[self.mirror]
        return Windows(self.cells, self.pinhole, self.mirror[kept], self.arc[kept])

    def rays(self, t: Floats, axis: Floats, angle: Floats) -> Floats:
        """Unit rays (e, s, 3) from the camera through the rotated sides at parameters t (e, s)."""
        point = self.cells.arcs.at(np.broadcast_to(self.arc[:, None], t.shape), t)
        ray = unit(point - self.pinhole)
        return rotated(ray, axis[self.mirror][:, None], angle[self.mirror][:, None])

    def coverage(
        self,
        centre: Floats,
        radius: Floats,
        axis: Floats,
        angle: Floats,
        pinhole: Floats | None = None,
    ) -> Floats:
        """Coverage diameter (m,) of one ball for each mirror within its rotated window, mm.

        It is twice the smallest distance from the origin of all rays through the window's edge
        after the ball. Whether the ball shows the origin inside the window is a question to
        `contains`.

        Args:
            centre: centres of the balls, mm, (m, 3).
            radius: of the balls, mm, (m,).
            axis: unit vectors that the windows are rotated about, (m, 3).
            angle: radians, (m,).
            pinhole: of the camera that sees the balls, mm, (3,); by default the windows' own.

        Returns:
            Infinite for mirrors without sides.
        """
        pinholes = np.stack([self.pinhole, self.pinhole if pinhole is None else pinhole])
        balls = np.column_stack([centre, radius, axis, np.cos(angle), np.sin(angle)])
        points, weight = self.cells.arcs.points[self.arc], self.cells.arcs.weight[self.arc]

        def miss(t: Floats) -> Floats:
            return misses_of_balls(points, weight, self.mirror, balls, pinholes, t)

        smallest = samples_about_minima(miss, len(self.arc), ROUNDS).min(axis=1)
        return 2 * minima_by_mirror(self.mirror, smallest, self.cells.mirrors)

    def contains(self, direction: Floats, axis: Floats, angle: Floats) -> Bools:
        """Whether each rotated window contains a direction (m, 3) from the pinhole, (m,).

        The window's sides wind once about a direction inside and not at all about one outside;
        those of a halved window wind half about the middle of the cut.
        """
        t = np.broadcast_to(np.linspace(0, 1, SAMPLES), (len(self.arc), SAMPLES))
        ray, about = self.rays(t, axis, angle), direction[self.mirror][:, None]
        flat = ray - dot(ray, np.broadcast_to(about, ray.shape))[..., None] * about
        before, after = flat[:, :-1], flat[:, 1:]
        about = np.broadcast_to(about, before.shape)
        winding = np.arctan2(dot(np.cross(before, after), about), dot(before, after)).sum(axis=1)
        forward = self.cells.arcs.left[self.arc] == self.mirror
        total = np.zeros(self.cells.mirrors)
        np.add.at(total, self.mirror, np.where(forward, winding, -winding))
        return np.asarray(np.abs(total) > np.where(self.cells.halved, np.pi / 2, np.pi))


def cell_windows(cells: Cells, pinhole: Floats) -> Windows:
    """The windows of all mirrors as a camera with this pinhole (3,) sees them."""
    return Windows(cells, pinhole, *limiting_sides(cells))

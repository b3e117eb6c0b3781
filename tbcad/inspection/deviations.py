"""Kinds of deviation of one mirror that can be measured, and what they are in the fast model.

A small patch of a sphere tells little of its centre, but where it is, how it is tilted, and how it
is curved: so limits are of these.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import unit
from tbcad.tolerance.montecarlo.draws import ShellDraws
from tbcad.tolerance.montecarlo.edge_model import CURVATURE, EdgeModel
from tbcad.tolerance.montecarlo.form import TERMS
from tbcad.types import Floats, Ints

MM_PER_UM = 1e-3
RAD_PER_MRAD = 1e-3


@dataclass(frozen=True)
class Deviation:
    """Deviations of all mirrors of one half, the apex being the point that stays in its place.

    Attributes:
        offset: of the apex along the normal, toward the light, micrometres, (..., m).
        tilt: of the normal about two axes across it, mrad, (..., m, 2).
        radius: by which the sphere is too large, its apex in place, mm, (..., m).
        wall: of all walls of the mirror's pedestal out of it, micrometres, (..., m).
    """

    offset: Floats
    tilt: Floats
    radius: Floats
    wall: Floats

    @classmethod
    def none(cls, builds: int, mirrors: int) -> "Deviation":
        """No deviation in some builds."""
        shape = (builds, mirrors)
        return cls(np.zeros(shape), np.zeros((*shape, 2)), np.zeros(shape), np.zeros(shape))

    def __neg__(self) -> "Deviation":
        """Return the opposite of each."""
        return Deviation(-self.offset, -self.tilt, -self.radius, -self.wall)

    def draws(self, model: EdgeModel) -> ShellDraws:
        """The deviations as errors of simulated builds, everything else being as designed."""
        count = len(self.offset)
        still, one = np.zeros((count, 3)), np.ones((count, 3))
        return ShellDraws(
            centre=self._centre(model),
            radius=self.radius,
            scale=one,
            shell_shift=still,
            shell_tilt=still,
            camera_shift=still,
            camera_tilt=still,
            focal=one[:, 0],
            facets=still[:, 0],
            foot=np.zeros(self.offset.shape),
            wall=-MM_PER_UM * self.wall[..., model.walls.mirror],
            form=np.zeros((*self.offset.shape, len(TERMS))),
        )

    def _centre(self, model: EdgeModel) -> Floats:
        """How far the spheres' centres are off, mm, (s, m, 3)."""
        radius = 1 / model.table[: len(model), CURVATURE]
        along = self.offset * MM_PER_UM - self.radius
        across = np.einsum("smk,mkd->smd", self.tilt * RAD_PER_MRAD, tilt_axes(model.normal))
        moved: Floats = along[..., None] * model.normal - radius[:, None] * across
        return moved


def tilt_axes(normal: Floats) -> Floats:
    """Two unit vectors across each normal (m, 3) toward which it tilts, (m, 2, 3)."""
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = unit(np.cross(normal, least))
    return np.stack([first, np.cross(normal, first)], axis=1)


def independent_classes(neighbours: list[Ints]) -> Ints:
    """Class of each mirror, (m,): no two of a class touch, or touch the same third mirror.

    Args:
        neighbours: numbers of the mirrors that touch each.
    """
    colour = np.full(len(neighbours), -1)
    for mirror, near in enumerate(neighbours):
        reach = np.concatenate([near, *(neighbours[one] for one in near)])
        taken = set(colour[reach].tolist())
        colour[mirror] = next(c for c in range(len(neighbours)) if c not in taken)
    return colour

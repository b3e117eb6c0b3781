"""A closed triangle mesh."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import FLIP_X, dot
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class Mesh:
    """A closed triangle mesh."""

    vertices: Floats  # mm, (v, 3)
    triangles: Ints  # counter-clockwise seen from outside the solid, (t, 3)

    @property
    def volume(self) -> float:
        """Signed volume, mm^3."""
        corner = self.vertices[self.triangles]
        return float(dot(corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum()) / 6

    def mirrored(self) -> "Mesh":
        """Mirror image in the plane x = 0."""
        return Mesh(self.vertices * FLIP_X, self.triangles[:, ::-1])

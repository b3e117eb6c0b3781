"""One camera with its mirrors: all that light needs to know of a design."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import GrooveWalls, PedestalCells, groove_walls
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Floats, Ints

# Boxes around cells in the picture are widened by this: an arc may bulge beyond its samples.
MARGIN_PX = 2
ARC_SAMPLES = np.linspace(0, 1, 9)


@dataclass(frozen=True)
class Reflector:
    """One camera and its m mirrors, in the order of their ids."""

    camera_id: str  # "a" or "b"
    camera: Camera  # its pinhole, axes and sensor
    u: Floats  # directions of the virtual cameras, (m, 3)
    cells: Cells  # of the reflecting surfaces

    def __len__(self) -> int:
        return len(self.u)

    @property
    def mirrors(self) -> Surfaces:
        """The reflecting surfaces without the seam and the foot plane."""
        return self.cells.mirror_surfaces

    @property
    def walls(self) -> GrooveWalls:
        """What ends mirrors on pedestals, besides seam and foot."""
        return groove_walls(self.cells)

    @property
    def foot(self) -> float:
        """Height z of the foot plane, mm."""
        return float(self.cells.surfaces.apex[self.cells.foot, 2])

    @property
    def side(self) -> float:
        """Sign of x on the side of the seam where the mirrors are."""
        return 1.0 if self.camera_id == "a" else -1.0

    def boxes(self) -> Ints:
        """Columns and rows that hold each cell's picture: x0, x1, y0, y1, ends excluded, (m, 4)."""
        arcs, m = self.cells.arcs, len(self)
        which = np.broadcast_to(np.arange(len(arcs))[:, None], (len(arcs), len(ARC_SAMPLES)))
        samples = arcs.at(which, np.broadcast_to(ARC_SAMPLES, which.shape))
        pixels = self.camera.project(samples)
        low, high = np.full((m, 2), np.inf), np.full((m, 2), -np.inf)
        for faces in (arcs.left, arcs.right):
            mine = faces < m
            np.minimum.at(low, faces[mine], pixels[mine].min(axis=1))
            np.maximum.at(high, faces[mine], pixels[mine].max(axis=1))
        size = np.array([self.camera.width_px, self.camera.height_px])
        first = np.clip(np.floor(low) - MARGIN_PX, 0, size)
        last = np.clip(np.ceil(high) + 1 + MARGIN_PX, 0, size)
        return np.stack([first, last], axis=2).reshape(m, 4).astype(np.int64)

    def neighbours_at_edge(self) -> Ints:
        """For each mirror the neighbours that the seam or the foot cuts, -1 where no more, (m, k).

        A ray may enter the sphere of such a neighbour beyond the edge, where there is no mirror;
        what it would meet inside that sphere lies in the wall. Mirrors on pedestals end at planes
        of their own: they have no such neighbours.
        """
        faces, m = self.cells.arcs.faces, len(self)
        if isinstance(self.cells, PedestalCells):
            return np.full((m, 0), -1)
        cut = np.zeros(m + 2, dtype=bool)
        cut[faces[(faces >= m).any(axis=1)].min(axis=1)] = True
        pairs = np.concatenate([faces, faces[:, ::-1]])
        pairs = pairs[(pairs < m).all(axis=1) & cut[pairs[:, 1]]]
        pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
        count = np.bincount(pairs[:, 0], minlength=m)
        place = np.arange(len(pairs)) - np.repeat(np.cumsum(count) - count, count)
        table = np.full((m, int(count.max(initial=0))), -1)
        table[pairs[:, 0], place] = pairs[:, 1]
        return table


@dataclass(frozen=True)
class SubstitutedReflector(Reflector):
    """A camera with other surfaces in place of its mirrors."""

    surfaces: Surfaces  # in place of the mirrors, (m,)

    @property
    def mirrors(self) -> Surfaces:
        """The reflecting surfaces."""
        return self.surfaces


def reflectors(design: MirrorDesign) -> tuple[Reflector, Reflector]:
    """Both cameras of a design with their mirrors."""
    a, b = (
        Reflector(array.camera_id, array.camera, array.u, array.cells) for array in design.arrays
    )
    return a, b

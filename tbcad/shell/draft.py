"""In which direction a shell is drawn off its negative, and what holds it back."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from tbcad.geometry.vectors import unit
from tbcad.optics.cells import Cells
from tbcad.optics.pedestals.cells import PedestalCells
from tbcad.optics.power_diagram import PLANES
from tbcad.types import Floats

# Points on each arc: between two of them a normal turns by so little that draft changes by less
# than 0.01 degrees.
ARC_SAMPLES = 9
# Below any length of the shortest vector among averages of unit vectors that have a direction.
NO_DIRECTION = 1e-9
PULL_DIGITS = 9


@dataclass(frozen=True)
class Draft:
    """How a shell comes off its negative.

    Attributes:
        pull: unit vector along which the shell is drawn, (3,).
        angle: least angle between the negative's surface and the pull, rad; below 0 it catches.
    """

    pull: Floats
    angle: float


def draft_of(cells: Cells) -> Draft:
    """The pull with the largest draft; where walls catch whatever it is, the mirrors' best pull.

    Args:
        cells: of the modelled surfaces.
    """
    mirrors = _mirror_normals(cells)
    every = np.concatenate([mirrors, _wall_normals(cells)])
    pull = best_pull(every)
    if pull is None:
        pull = best_pull(mirrors)
    if pull is None:
        pull = unit(every.sum(axis=0))
    # Rounded so that the last bits of a search do not reach a file.
    pull = unit(np.round(pull, PULL_DIGITS) + 0.0)
    return Draft(pull, float(np.arcsin(np.clip((every @ pull).min(), -1, 1))))


def best_pull(normals: Floats) -> Floats | None:
    """Unit vector (3,) whose least product with unit normals (k, 3) is largest; None if below 0.

    The shortest x with n.x >= 1 for all normals points there. It is the solution of a least-squares
    problem without negative unknowns (Lawson and Hanson, Solving Least Squares Problems, chapter
    23, algorithm LDP).
    """
    table = np.vstack([normals.T, np.ones(len(normals))])
    target = np.array([0.0, 0.0, 0.0, 1.0])
    weights, length = nnls(table, target)
    if length < NO_DIRECTION:
        return None
    rest = table @ weights - target
    return unit(-rest[:3] / rest[3])


def _mirror_normals(cells: Cells) -> Floats:
    """The negative's outward normals along the mirrors' outlines, (k, 3).

    On a sphere the normal farthest from the pull is on the outline, but for cells that hold the
    sphere's point opposite to the pull, which no outline of theirs would let go either.
    """
    arcs = cells.arcs
    arc, t = np.broadcast_arrays(np.arange(len(arcs))[:, None], np.linspace(0, 1, ARC_SAMPLES))
    points = arcs.at(arc, t)
    normals = []
    for side in arcs.faces.T:
        mirror = np.flatnonzero(side < cells.mirrors)
        face = np.broadcast_to(side[mirror, None], (len(mirror), ARC_SAMPLES)).ravel()
        normals.append(-unit(cells.surfaces.gradient(face, points[mirror].reshape(-1, 3))))
    return np.concatenate(normals)


def _wall_normals(cells: Cells) -> Floats:
    """The negative's outward normals on the walls of grooves, (w, 3)."""
    if not isinstance(cells, PedestalCells):
        return np.zeros((0, 3))
    return np.asarray(-cells.surfaces.normal[cells.mirrors + PLANES :])

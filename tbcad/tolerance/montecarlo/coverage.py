"""What every virtual camera of made machines sees: exact, without cells of known topology."""

from dataclasses import dataclass

import numpy as np

from tbcad.simulate.scene.reflector import pixel_pitch
from tbcad.tolerance.montecarlo.cell_edges import trace_cell_edges
from tbcad.tolerance.montecarlo.draws import Draws
from tbcad.tolerance.montecarlo.edge_model import EdgeModel, places, tables
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class Seen:
    """What m mirrors of one half of s machines see.

    Attributes:
        diameter: twice the least distance from the object's middle of all rays camera -> edge of
            the cell -> reflected (DESIGN.md section 2), mm; inf where there is no edge, (s, m).
        passes: how often the image of the cell's outline passes a line out of the object's
            middle: an odd number where it surrounds the middle, (s, m).
        pixels: size of the cell's picture, (s, m).
    """

    diameter: Floats
    passes: Ints
    pixels: Floats


def seen(half: EdgeModel, draws: Draws) -> Seen:
    """What each mirror of one half sees, for s machines."""
    found = np.empty((len(draws), len(half), 3))
    near = half.near
    pairs = zip(tables(half, draws), places(half, draws), strict=True)
    for machine, (table, place) in enumerate(pairs):
        found[machine] = trace_cell_edges(
            table, near.pair, near.offset, near.face, near.reach, half.halved, place, half.screen
        )
    area = np.abs(found[..., 2]) * (draws.focal[:, None] / pixel_pitch(half.view)) ** 2
    return Seen(2 * np.sqrt(found[..., 0]), found[..., 1].astype(np.int64), area)


def virtual(halves: tuple[EdgeModel, EdgeModel]) -> Ints:
    """Number of each mirror's virtual camera, a's mirrors, then b's, (2 m,).

    The two halves of a mirror on the seam are one virtual camera's; mirror i of camera b is
    mirror i of camera a in the plane x = 0.
    """
    a, b = halves
    own = len(a) + np.cumsum(~b.halved) - 1
    return np.concatenate([np.arange(len(a)), np.where(b.halved, np.arange(len(b)), own)])


def coverage(
    halves: tuple[EdgeModel, EdgeModel], draws: tuple[Draws, Draws]
) -> tuple[Floats, Floats]:
    """Exact coverage diameter (mm) and pixels of v virtual cameras of s machines, two of (s, v).

    The halves of a mirror on the seam count together: the lesser diameter, all pixels. A mirror
    that is gone, or whose image does not surround the object's middle, covers nothing.
    """
    both = [seen(half, drawn) for half, drawn in zip(halves, draws, strict=True)]
    which = virtual(halves)
    shape = (len(draws[0]), int(which.max()) + 1)
    diameter, passes, pixels = np.full(shape, np.inf), np.zeros(shape, int), np.zeros(shape)
    lost = [drawn.facets[:, None] for drawn in draws]
    each = np.concatenate([one.diameter - d for one, d in zip(both, lost, strict=True)], axis=1)
    rows = np.arange(shape[0])[:, None]
    np.minimum.at(diameter, (rows, which), each)
    np.add.at(passes, (rows, which), np.concatenate([one.passes for one in both], axis=1))
    np.add.at(pixels, (rows, which), np.concatenate([one.pixels for one in both], axis=1))
    sees = (passes % 2 == 1) & np.isfinite(diameter)
    return np.where(sees, np.maximum(diameter, 0.0), 0.0), pixels

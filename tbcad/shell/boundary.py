"""The chains of arcs along the seam and along the foot."""

import numpy as np

from tbcad.optics.cells import Cells
from tbcad.types import Bools, Ints

Chain = list[tuple[int, bool]]
"""Arcs that follow each other, and whether each runs forward."""


def boundary_chain(cells: Cells, plane: int) -> Chain:
    """Arcs on the seam or the foot plane, from low to high y."""
    arcs = cells.arcs
    on_plane = np.flatnonzero((arcs.faces == plane).any(axis=1))
    # Followed with the plane on their left all arcs go round alike.
    forward = arcs.left[on_plane] == plane
    chain = _linked(on_plane, forward, *_tails_and_heads(cells, on_plane, forward))
    first, last = chain_ends(cells, chain)
    if cells.corners[first, 1] > cells.corners[last, 1]:
        return [(arc, not along) for arc, along in reversed(chain)]
    return chain


def chain_ends(cells: Cells, chain: Chain) -> tuple[int, int]:
    """Corners at which a chain starts and ends."""
    arc, forward = np.array(chain, dtype=np.int64)[[0, -1]].T
    tails, heads = _tails_and_heads(cells, arc, forward == 1)
    return int(tails[0]), int(heads[1])


def _tails_and_heads(cells: Cells, arc: Ints, forward: Bools) -> tuple[Ints, Ints]:
    """Corners at which arcs start and end when they are followed forward or back."""
    start, end = cells.arcs.start[arc], cells.arcs.end[arc]
    return np.where(forward, start, end), np.where(forward, end, start)


def _linked(arc: Ints, forward: Bools, tails: Ints, heads: Ints) -> Chain:
    following = {int(tail): k for k, tail in enumerate(tails)}
    corner = int(np.setdiff1d(tails, heads)[0])
    chain: Chain = []
    while corner in following:
        k = following[corner]
        chain.append((int(arc[k]), bool(forward[k])))
        corner = int(heads[k])
    return chain

"""The line of arcs along the seam and along the foot."""

import numpy as np

from tbcad.optics.cells import Cells

Chain = list[tuple[int, bool]]


def boundary_chain(cells: Cells, plane: int) -> Chain:
    """Arcs on the seam or the foot plane and whether each runs forward, from low to high y."""
    arcs = cells.arcs
    own = np.flatnonzero((arcs.faces == plane).any(axis=1))
    # Followed with the plane on their left all arcs go round alike.
    forward = arcs.left[own] == plane
    tails = np.where(forward, arcs.start[own], arcs.end[own])
    heads = np.where(forward, arcs.end[own], arcs.start[own])
    following = {int(tail): k for k, tail in enumerate(tails)}
    corner = int(np.setdiff1d(tails, heads)[0])
    chain: Chain = []
    while corner in following:
        k = following[corner]
        chain.append((int(own[k]), bool(forward[k])))
        corner = int(heads[k])
    first, last = chain_ends(cells, chain)
    if cells.corners[first, 1] > cells.corners[last, 1]:
        return [(arc, not along) for arc, along in reversed(chain)]
    return chain


def chain_ends(cells: Cells, chain: Chain) -> tuple[int, int]:
    """Corners at which a chain starts and ends."""
    (first, along), (last, onward) = chain[0], chain[-1]
    arcs = cells.arcs
    start = arcs.start[first] if along else arcs.end[first]
    end = arcs.end[last] if onward else arcs.start[last]
    return int(start), int(end)

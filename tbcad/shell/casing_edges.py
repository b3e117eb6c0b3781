"""Edges of the casing and outlines of its planar faces: one description for mesh and solid.

Edges run between these points, each with a low (y < 0) and a high end:

    front     where the mirrors end, on x = 0 and z = foot
    back      where back, seam flange and foot flange meet
    seam      outer corner of the seam flange on x = 0; seam_back: on its other face
    foot      outer corner of the foot flange on z = foot; foot_top: on its other face
"""

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from tbcad.core.geometry.conics import EllipseArc
from tbcad.core.optics.cells import Cells
from tbcad.shell.envelope import Envelope
from tbcad.types import Bools, Ints

Chain = list[tuple[int, bool]]
"""Arcs that follow each other, and whether each runs forward."""
Edge = TypeVar("Edge")
ARC_ENDS = {
    "seam_back": "back",
    "foot_back": "back",
    "seam_rim": "seam",
    "seam_rim_back": "seam_back",
    "foot_rim": "foot",
    "foot_rim_top": "foot_top",
}
"""Edges along arcs, from low to high y, and the point at their ends."""
LINE_ENDS = {
    "seam_end": ("seam", "seam_back"),
    "foot_end": ("foot", "foot_top"),
    "seam_step": ("seam_back", "back"),
    "foot_step": ("seam", "foot_top"),
    "wall": ("foot", "front"),
}
"""Straight edges, each at the low and the high end: their first and last points."""
OUTLINES = {
    "seam": "wall_low seam_front -wall_high foot_end_high -foot_step_high -seam_rim foot_step_low"
    " -foot_end_low",
    "foot": "foot_rim wall_high -foot_front -wall_low",
    "seam_flange": "seam_step_low seam_back -seam_step_high -seam_rim_back",
    "foot_flange": "foot_rim_top -foot_step_high seam_end_high seam_step_high -foot_back"
    " -seam_step_low -seam_end_low foot_step_low",
}
"""Edges round the planar faces, counter-clockwise from +x or +z; "-": followed backward.

seam_front and foot_front are the chains of the mirrors' arcs.
"""


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


def casing_arcs(envelope: Envelope) -> dict[str, EllipseArc]:
    """The arcs of the casing by the names of their edges."""
    return {
        "seam_back": envelope.seam_back,
        "foot_back": envelope.foot_back,
        "seam_rim": envelope.seam_rim,
        "seam_rim_back": envelope.seam_rim.moved(envelope.seam_thickness),
        "foot_rim": envelope.foot_rim,
        "foot_rim_top": envelope.foot_rim.moved(envelope.foot_thickness),
    }


def casing_lines(line: Callable[[str, str, int], Edge]) -> dict[str, Edge]:
    """Straight edges by name, made by a function of first point, last point and end (0: low)."""
    return {
        f"{name}_{end}": line(first, last, k)
        for name, (first, last) in LINE_ENDS.items()
        for k, end in enumerate(("low", "high"))
    }


def outline(face: str, edges: Mapping[str, Edge], backward: Callable[[Edge], Edge]) -> list[Edge]:
    """Edges round a planar face, each as it is followed."""
    return [
        backward(edges[name[1:]]) if name.startswith("-") else edges[name]
        for name in OUTLINES[face].split()
    ]

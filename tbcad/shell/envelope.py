"""What closes the mirrors to a solid: back, flanges and holes, as points and exact curves.

Every edge is a straight line, a circle, or a plane section of a spheroid, so that the solid and
the mesh are both built from the same closed forms and no boolean operation is needed. Edges of the
casing run between these points, each with a low (y < 0) and a high end:

    front     where the mirrors end, on x = 0 and z = foot
    back      where back, seam flange and foot flange meet
    seam      outer corner of the seam flange on x = 0; seam_back: on its other face
    foot      outer corner of the foot flange on z = foot; foot_top: on its other face
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from tbcad.core.geometry.conics import (
    EllipseArc,
    Ellipsoid,
    Spheroid,
    enclosing_offset,
    wall_offset,
)
from tbcad.core.optics.cells import Cells
from tbcad.core.spec.design import FlangeSpec, ShellSpec
from tbcad.core.spec.errors import SpecError
from tbcad.types import Bools, Floats, Ints

X, _, Z = np.eye(3)
STEP_MM = 1.0  # that the foot flange reaches past the ends of the seam flange on it
VALLEY_SAMPLES = 5  # points on each arc that are looked at for the deepest valley
FAR_MM = 1e6  # distance of a point that only says on which side an arc lies
MAX_WIDENINGS = 100
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


@dataclass(frozen=True)
class Holes:
    """Round through holes in a flange."""

    centre: Floats  # on the joining face, mm, (k, 3)
    direction: Floats  # into the flange, length its thickness, mm, (3,)
    radius: Floats  # mm, (k,)

    @property
    def sizes(self) -> tuple[Floats, Floats, Floats]:
        """Centres, direction and radii."""
        return self.centre, self.direction, self.radius


@dataclass(frozen=True)
class Envelope:
    """What closes camera a's cells to a solid; all arcs run from lower to higher y.

    The joining faces are x = 0 (seam) and z = foot; the seam flange stands on the foot flange.
    """

    back: Spheroid  # the spheroid of the smooth back
    foot: float  # height of the foot plane, mm
    seam_back: EllipseArc  # edge of back and seam flange, in x = seam thickness
    foot_back: EllipseArc  # edge of back and foot flange, in z = foot + thickness
    seam_rim: EllipseArc  # outer edge of the seam flange at x = 0; at x = thickness it is moved
    foot_rim: EllipseArc  # outer edge of the foot flange at z = foot; on top it is moved
    seam_holes: Holes  # holes along x
    foot_holes: Holes  # holes along z

    @property
    def seam_thickness(self) -> Floats:
        """Vector through the seam flange, mm, (3,)."""
        return self.seam_holes.direction

    @property
    def foot_thickness(self) -> Floats:
        """Vector through the foot flange, mm, (3,)."""
        return self.foot_holes.direction


def closing_envelope(shell: ShellSpec, cells: Cells, ellipsoid: Ellipsoid) -> Envelope:
    """Back, flanges and holes round camera a's cells; SpecError where they do not fit."""
    foot = float(cells.surfaces.apex[cells.foot, 2])
    deepest = enclosing_offset(ellipsoid, _arc_points(cells))
    back = Spheroid(ellipsoid, wall_offset(ellipsoid, deepest, shell.wall_mm))
    try:
        return _flanged(shell, back, foot)
    except ValueError as error:
        raise SpecError(
            f"the flanges miss the shell ({error}): make shell.seam_flange.thickness_mm and "
            "shell.foot_flange.thickness_mm smaller"
        ) from None


def _arc_points(cells: Cells) -> Floats:
    arcs = cells.arcs
    t = np.linspace(0, 1, VALLEY_SAMPLES)
    arc, t = np.broadcast_arrays(np.arange(len(arcs))[:, None], t)
    return arcs.at(arc, t).reshape(-1, 3)


def _flanged(shell: ShellSpec, back: Spheroid, foot: float) -> Envelope:
    """The envelope; ValueError if the flanges' far faces, at x and z, miss the back."""
    seam_flange, foot_flange = shell.seam_flange, shell.foot_flange
    x, z = seam_flange.thickness_mm, foot + foot_flange.thickness_mm

    def over(width: float) -> EllipseArc:
        return arc_over_top(back.widened(width), x, z).moved(-x * X)

    def around(width: float, start_x: float) -> EllipseArc:
        return arc_around(back.widened(width), start_x, foot, foot)

    foot_width = _foot_width(foot_flange, back, seam_flange.width_mm, foot, x, z)
    foot_holes = around(foot_flange.width_mm / 2, x + seam_flange.width_mm / 2)
    return Envelope(
        back=back,
        foot=foot,
        seam_back=arc_over_top(back, x, z),
        foot_back=arc_around(back, x, z, z),
        seam_rim=over(seam_flange.width_mm),
        foot_rim=around(foot_width, 0.0),
        seam_holes=flange_holes(
            seam_flange, over(seam_flange.width_mm / 2), x * X, seam_flange.width_mm
        ),
        foot_holes=flange_holes(foot_flange, foot_holes, (z - foot) * Z, foot_flange.width_mm / 2),
    )


def arc_over_top(spheroid: Spheroid, x: float, z: float) -> EllipseArc:
    """Arc over the top in the plane x, between the points at height z."""
    low, high = spheroid.crossing(x, z)
    return spheroid.section(X, x).arc(low, high, spheroid.centre + FAR_MM * Z)


def arc_around(spheroid: Spheroid, x: float, z: float, plane: float) -> EllipseArc:
    """Arc round the mirrors in the plane z = plane, between the points at x."""
    low, high = spheroid.crossing(x, z)
    return spheroid.section(Z, plane).arc(low, high, spheroid.centre + FAR_MM * X)


def _foot_width(
    flange: FlangeSpec, back: Spheroid, seam_width: float, foot: float, x: float, z: float
) -> float:
    """Width of the foot flange, at least so much that the seam flange stands on it."""
    low, high = back.widened(seam_width).crossing(x, z)[:, 1]
    width = flange.width_mm
    for _ in range(MAX_WIDENINGS):
        ends = back.widened(width).crossing(0.0, foot)[:, 1]
        shortfall = max(high - ends[1], ends[0] - low) + STEP_MM
        if shortfall <= 0:
            return width
        width += shortfall
    raise SpecError(
        "the seam flange does not stand on the foot flange: make shell.seam_flange.width_mm "
        "smaller or shell.foot_flange.width_mm larger"
    )


def flange_holes(flange: FlangeSpec, line: EllipseArc, direction: Floats, margin: float) -> Holes:
    """Bolts and dowels at even distances along a line, dowels near its ends and between."""
    count = flange.bolts + flange.dowels
    pitch = (line.length - 2 * margin) / (count - 1)
    largest = max(flange.bolt_hole_mm, flange.dowel_hole_mm if flange.dowels else 0.0)
    if pitch < 2 * largest:
        raise SpecError(
            f"{count} holes of up to {largest:g} mm do not fit along a flange of "
            f"{line.length:.0f} mm: lower bolts or dowels under shell.seam_flange or "
            "shell.foot_flange"
        )
    share = (margin + pitch * np.arange(count)) / line.length
    dowel = np.zeros(count, dtype=bool)
    dowel[np.round(np.linspace(1, count - 2, flange.dowels)).astype(int)] = True
    radius = np.where(dowel, flange.dowel_hole_mm, flange.bolt_hole_mm) / 2
    return Holes(line.by_length(share), direction, radius)


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

"""Where pedestals stand, and which of their borders are too short to be kept.

A mirror whose border with a bounding plane is too short for the grooves at its ends cannot end in
one corner on that plane: walls lean with the light, so its tip would stick out beyond the plane. It
ends before the plane instead, and its two neighbours have a groove from there to the plane.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.pedestals.borders import (
    CellPairs,
    PedestalLayout,
    cell_pairs,
    outline_sides,
    pedestal_layout,
)
from tbcad.core.optics.power_diagram import (
    PLANES,
    NotRegularError,
    flip_edges,
    half_edges,
    opposite,
)
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Bools, Floats, Ints

MAX_ROUNDS = 100  # each round joins some corners or moves some away from a plane
MIN_SIDES = 3
# Sides of planar mirrors that are shorter than so many grooves vanish. At bounding planes, where
# sides change with a mirror's height, the limit is higher by this share of the mirrors' pitch.
PLANAR_WIDTHS = 1.2
PLANAR_SHARE = 0.05
# With radii only much shorter sides vanish, so that what vanishes seldom depends on radii: where a
# side is too short with some radii and not with those that follow from it, none are ever found.
WIDTHS = 0.25
# A corner that is too near to a plane moves from it in steps of this share of the shortest side
# there.
RISE_SHARE = 0.25


def without_crowded_rims(cells: Cells, corner: Ints, rise: float) -> Cells:
    """Cells in which fewer joined corners on a bounding plane have a third mirror.

    Of planar cells, and the corner that each triangle's becomes when those of short borders are
    joined, (t,). Grooves to a plane become longer by the rise, mm. The same object if there is no
    such corner.
    """
    short = _vanishing(_borders_with_planes(cells), cells, corner)
    short = _shortest_of_each(short, cells, corner[short // 3])
    flipped = _flipped(cells, short) if len(short) else cells
    return _raised(flipped, _vanishing(_grooves_to_planes(flipped), flipped, corner), rise)


def with_longer_grooves_to_planes(cells: Cells, too_near: Bools, rise: float) -> Cells:
    """Planar cells whose corners too near to a bounding plane (t,) are farther, by a rise, mm.

    The same object if no groove runs from such a corner to a plane.
    """
    _, twin = half_edges(cells.triangles)
    edge = _grooves_to_planes(cells)
    return _raised(cells, edge[too_near[twin[edge] // 3]], rise)


def _borders_with_planes(cells: Cells) -> Ints:
    """Edges from mirrors to a plane, between two mirrors that could meet instead, (e,)."""
    ends, twin = half_edges(cells.triangles)
    third = opposite(cells.triangles, np.arange(len(ends)))
    between, key = np.column_stack([third, third[twin]]), [len(cells.surfaces), 1]
    borders = (ends[:, 0] < cells.mirrors) & (ends[:, 1] >= cells.mirrors)
    borders &= (between < cells.mirrors).all(axis=1)
    borders &= ~np.isin(between @ key, ends @ key)
    return np.flatnonzero(borders)


def _grooves_to_planes(cells: Cells) -> Ints:
    """Edges between mirrors, with a plane in their triangle and a mirror across, (e,)."""
    ends, twin = half_edges(cells.triangles)
    third = opposite(cells.triangles, np.arange(len(ends)))
    inner = (ends < cells.mirrors).all(axis=1)
    return np.flatnonzero(inner & (third >= cells.mirrors) & (third[twin] < cells.mirrors))


def _vanishing(edge: Ints, cells: Cells, corner: Ints) -> Ints:
    """Those of the directed edges (e,) that have one joined corner at both ends."""
    _, twin = half_edges(cells.triangles)
    return np.asarray(edge[corner[edge // 3] == corner[twin[edge] // 3]])


def _shortest_of_each(edge: Ints, cells: Cells, group: Ints) -> Ints:
    """The edge with the shortest border of each group, of directed edges in groups (e,)."""
    _, twin = half_edges(cells.triangles)
    order = np.argsort(_lengths(cells, edge // 3, twin[edge] // 3), kind="stable")
    return np.asarray(edge[order][np.unique(group[order], return_index=True)[1]])


def _lengths(cells: Cells, one: Ints, other: Ints) -> Floats:
    """Distances of the corners of triangles (e,) and others, mm, (e,)."""
    return np.asarray(norm(cells.corners[one] - cells.corners[other]))


def _flipped(cells: Cells, edge: Ints) -> Cells:
    """Cells without these borders (e,) of mirrors with a plane; the neighbours meet instead."""
    triangles, corners = cells.triangles.copy(), cells.corners.copy()
    _, twin = half_edges(triangles)
    ends = np.stack([edge, twin[edge]]) // 3
    flip_edges(triangles, edge, twin[edge])
    corners[ends] = corners[ends].mean(axis=0)
    return replace(cells, triangles=triangles, corners=corners)


def _raised(cells: Cells, edge: Ints, rise: float) -> Cells:
    """Cells whose grooves to a plane (e,) begin farther from it, toward the mirror above."""
    if not len(edge):
        return cells
    _, twin = half_edges(cells.triangles)
    edge = _shortest_of_each(edge, cells, twin[edge] // 3)
    corners, on_plane, above = cells.corners.copy(), edge // 3, twin[edge] // 3
    apex = cells.surfaces.apex[opposite(cells.triangles, twin[edge])]
    length = _lengths(cells, above, on_plane) + rise
    corners[above] = corners[on_plane] + length[:, None] * unit(apex - corners[on_plane])
    return replace(cells, corners=corners)


@dataclass(frozen=True)
class PedestalPlan:
    """What pedestals have in common for all mirrors with the same apices."""

    flat: Cells  # cells of planar mirrors, see also `rims`
    pairs: CellPairs  # of these cells, over e of them
    short: Bools  # which pairs have too short a border: its corners are joined, (e,)
    pinhole: Floats  # of the camera, mm, (3,)
    groove: float  # width at the mirrors' corners, mm, above 0

    @classmethod
    def of(cls, flat: Cells, pinhole: Floats, groove: float) -> "PedestalPlan":
        """Plan in which no planar cell has a border shorter than a groove."""
        pairs = cell_pairs(flat)
        length = norm(np.diff(flat.corners[pairs.triangles], axis=1)[:, 0])
        return cls(flat, pairs, length < groove, pinhole, groove)

    def layout_for(self, mirrors: Surfaces) -> PedestalLayout:
        """Where the pedestals of m mirrors stand; NotRegularError if one has no outline."""
        plan, layout = _joined(self, mirrors, WIDTHS, 0.0)
        if plan.flat is self.flat:
            return layout
        return planned(plan.flat, self.pinhole, self.groove).layout_for(mirrors)

    @property
    def pitch(self) -> float:
        """Median distance of apices from the nearest other, mm."""
        apex = self.flat.mirror_surfaces.apex
        distances, _ = KDTree(apex).query(apex, k=[2])
        return float(np.median(distances))

    @property
    def corner(self) -> Ints:
        """Corner of each triangle (t,), joined or not; NotRegularError if a mirror has too few."""
        count, mirrors = len(self.flat.triangles), self.flat.mirrors
        joined = self.pairs.triangles[self.short]
        graph = coo_array((np.ones(len(joined)), joined.T), shape=(count, count))
        corner = np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
        kept = self.pairs.faces[np.not_equal(*corner[self.pairs.triangles].T)]
        if np.bincount(kept.ravel(), minlength=mirrors)[:mirrors].min() < MIN_SIDES:
            raise NotRegularError(f"grooves of {self.groove:g} mm leave no outline of a mirror")
        return corner


def pedestal_plan(
    surfaces: Surfaces, triangles: Ints, pinhole: Floats, groove: float
) -> PedestalPlan:
    """Plan of pedestals for mirrors with the apices of some, with grooves of a width above 0, mm.

    Surfaces are m mirrors, then the two bounding planes; the dual triangulation (t, 3) is right or
    nearly so. NotRegularError if planes bound no proper cells, or grooves leave none.
    """
    return planned(_flattened(surfaces, triangles, pinhole), pinhole, groove)


def planned(flat: Cells, pinhole: Floats, groove: float) -> PedestalPlan:
    """Plan for mirrors with the apices of planar cells (see `pedestal_plan`)."""
    plan = PedestalPlan.of(flat, pinhole, groove)
    return _joined(plan, flat.mirror_surfaces, PLANAR_WIDTHS, PLANAR_SHARE)[0]


def _flattened(surfaces: Surfaces, triangles: Ints, pinhole: Floats) -> Cells:
    """Cells of planar mirrors that send the rays to their apices on to the origin."""
    m = len(surfaces) - PLANES
    apex, normal = surfaces.apex, surfaces.normal.copy()
    normal[:m] = unit(unit(pinhole - apex[:m]) - unit(apex[:m]))
    return cells_of(Surfaces(apex, normal, np.zeros(len(surfaces))), triangles)


def _joined(
    plan: PedestalPlan, mirrors: Surfaces, widths: float, share: float
) -> tuple[PedestalPlan, PedestalLayout]:
    """Plan and layout without short sides, nor grooves that end too near to a bounding plane.

    Sides are at least so many grooves long, those at a bounding plane by a share of the mirrors'
    pitch more; grooves end half of that before a plane, or half a groove where that is less.
    """
    more = share * plan.pitch
    rise = RISE_SHARE * (plan.groove + more)
    for _ in range(MAX_ROUNDS):
        corner, flat = plan.corner, plan.flat
        eased = without_crowded_rims(flat, corner, rise)
        if eased is flat:
            layout = pedestal_layout(flat, mirrors, plan.pairs, corner, plan.pinhole, plan.groove)
            short = _short_pairs(layout, mirrors, widths * plan.groove, more)
            if len(short):
                plan = replace(plan, short=plan.short | np.isin(np.arange(len(plan.short)), short))
                continue
            near = layout.near_planes((min(widths, 1.0) * plan.groove + more) / 2)[corner]
            eased = with_longer_grooves_to_planes(flat, near, rise)
            if eased is flat:
                return plan, layout
        plan = PedestalPlan.of(eased, plan.pinhole, plan.groove)
    raise NotRegularError(f"grooves of {plan.groove:g} mm do not end at the seam and the foot")


def _short_pairs(layout: PedestalLayout, mirrors: Surfaces, limit: float, more: float) -> Ints:
    """Pairs of cells whose border is shorter than a limit, at bounding planes by more, mm."""
    sides = outline_sides(layout, layout.with_planes(mirrors))
    at_plane = np.any(layout.on_planes[layout.borders.ends[sides.border]], axis=1)
    short = sides.length < limit + more * at_plane
    return np.asarray(layout.borders.pair[sides.border[short]])

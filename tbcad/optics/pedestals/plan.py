"""Which borders of pedestals are too short to be kept, and where the pedestals stand."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from tbcad.geometry.vectors import norm, unit
from tbcad.optics.cells import Cells, cells_of
from tbcad.optics.pedestals.borders import CellPairs, PedestalLayout, cell_pairs, pedestal_layout
from tbcad.optics.pedestals.rims import with_longer_grooves_to_planes, without_crowded_rims
from tbcad.optics.pedestals.sides import outline_sides
from tbcad.optics.power_diagram import PLANES, NotRegularError
from tbcad.optics.surfaces import Surfaces
from tbcad.types import Bools, Floats, Ints

# Each round joins some corners or moves some away from a plane.
MAX_ROUNDS = 100
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


@dataclass(frozen=True)
class PedestalPlan:
    """What pedestals have in common for all mirrors with the same apices.

    Attributes:
        flat: cells of planar mirrors, see also `rims`.
        pairs: of these cells, over e of them.
        short: which pairs have too short a border: its corners are joined, (e,).
        pinhole: of the camera, mm, (3,).
        groove: width at the mirrors' corners, mm, above 0.
    """

    flat: Cells
    pairs: CellPairs
    short: Bools
    pinhole: Floats
    groove: float

    @classmethod
    def of(cls, flat: Cells, pinhole: Floats, groove: float) -> "PedestalPlan":
        """Plan in which no planar cell has a border shorter than a groove."""
        pairs = cell_pairs(flat)
        length = norm(np.diff(flat.corners[pairs.triangles], axis=1)[:, 0])
        return cls(flat, pairs, length < groove, pinhole, groove)

    def layout_for(self, mirrors: Surfaces) -> PedestalLayout:
        """Where the pedestals of mirrors (m of them) stand.

        Raises:
            NotRegularError: the grooves leave no outline of a mirror.
        """
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
        """Numbers of corners, one for each triangle (t,); joined ones share theirs.

        Raises:
            NotRegularError: that leaves a mirror fewer than three sides.
        """
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
    """Plan of pedestals for mirrors with the apices of some.

    Args:
        surfaces: of m mirrors, then the two bounding planes.
        triangles: a dual triangulation that is right or nearly so, (t, 3).
        pinhole: of the camera, mm, (3,).
        groove: width of the grooves at the mirrors' corners, mm, above 0.

    Raises:
        NotRegularError: the planes bound no proper cells, or the grooves leave none.
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

    Args:
        plan: to start from.
        mirrors: m of them.
        widths: sides are at least so many grooves long; grooves end half of that before a plane,
            or half a groove where that is less.
        share: those at a bounding plane are longer by this share of the mirrors' pitch.
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
    """Pairs of cells whose border is a mirror's side shorter than a limit, mm.

    At a bounding plane the limit is higher by a length, mm.
    """
    sides = outline_sides(layout, layout.with_planes(mirrors))
    at_plane = np.any(layout.on_planes[layout.borders.ends[sides.border]], axis=1)
    short = sides.length < limit + more * at_plane
    return np.asarray(layout.borders.pair[sides.border[short]])

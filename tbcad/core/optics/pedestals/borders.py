"""Planes between mirrors on pedestals, and the corners that they have in common.

Two neighbours stand on either side of a groove. Its bottom is a straight line between two corners,
and its walls lean apart from the plane through that line and the pinhole. So light on its way to a
mirror never meets the pedestal of another, and three pedestals meet in one corner of the bottom.

Seen from the pinhole the corners are those of planar mirrors that are tangent to the ellipsoid:
they do not depend on radii, nor on where mirrors are aimed.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.cells import Cells, rings_of
from tbcad.core.optics.power_diagram import PLANES, NotRegularError, half_edges
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Bools, Floats, Ints

# Depth of a groove below the lowest mirror at its corners, in widths of the groove: walls lean by 1
# in 8 or little more, so the groove drains, and a mirror that is off moves its edge little.
DEPTH_WIDTHS = 4.0
ON_PLANE_MM = 1e-9  # corners on a bounding plane lie within rounding of it


@dataclass(frozen=True)
class CellPairs:
    """All pairs of a cell and a neighbour, or a bounding plane, over e of them."""

    faces: Ints  # the cell that has the border counter-clockwise (outside), the other, (e, 2)
    triangles: Ints  # at the start and the end of the border, (e, 2)
    half_edges: Ints  # of the triangles, that of the first face and its twin, (e, 2)


@dataclass(frozen=True)
class Corners:
    """Corners c of the borders; those of very short borders are joined."""

    flat: Floats  # where planar mirrors meet, mm, (c, 3)
    top: Floats  # above a groove's bottom, on the lowest mirror there, mm, (c, 3)
    bottom: Floats  # of the groove, mm, (c, 3); the mirror's where no groove ends


@dataclass(frozen=True)
class Borders:
    """Borders between two cells, or a cell and a bounding plane, over k of them."""

    pair: Ints  # index of the pair of cells, (k,)
    faces: Ints  # the cell that has it counter-clockwise (outside), and the other, (k, 2)
    ends: Ints  # corners at which it starts and ends, (k, 2)
    normal: Floats  # of the planes that end both cells, inward, (k, 2, 3); zero for bounds

    def between_mirrors(self, mirrors: int) -> Bools:
        """Which borders (k,) lie between two of the mirrors."""
        return np.asarray((self.faces < mirrors).all(axis=1))


@dataclass(frozen=True)
class PedestalLayout:
    """Where pedestals stand, whatever mirrors they carry."""

    flat: Cells  # cells of planar mirrors with the same apices, see also `pedestal_rims`
    mirrors: Surfaces  # as designed, (m,)
    pinhole: Floats  # that the grooves are seen from, mm, (3,)
    groove: float  # width of the grooves at the mirrors' corners, mm
    pairs: CellPairs  # of the cells
    corners: Corners  # of the borders
    borders: Borders  # between the cells

    def with_planes(self, mirrors: Surfaces) -> Surfaces:
        """Mirrors (m of them), followed by the two bounding planes."""
        return mirrors.joined(self.flat.surfaces.subset(slice(self.flat.mirrors, None)))

    @property
    def on_planes(self) -> Bools:
        """Which corners (c,) lie on a bounding plane."""
        return np.asarray((np.abs(self._heights(self.corners.flat)) < ON_PLANE_MM).any(axis=1))

    def near_planes(self, limit: float) -> Bools:
        """Which ends of grooves (c,) are nearer to a bounding plane than a limit, mm, not on it."""
        near = (self._heights(self.corners.bottom) < limit).any(axis=1)
        return np.asarray(near & ~self.on_planes)

    def _heights(self, points: Floats) -> Floats:
        """Distances (c, 2) of points (c, 3) from the bounding planes, inward, mm."""
        planes = self.flat.mirrors + np.arange(PLANES)
        return self.flat.surfaces.value(planes, points[:, None])


def cell_pairs(cells: Cells) -> CellPairs:
    """The pairs of neighbours of which one at least is a mirror."""
    ends, twin = half_edges(cells.triangles)
    edge = np.flatnonzero((np.arange(len(ends)) < twin) & (ends.min(axis=1) < cells.mirrors))
    both = np.column_stack([edge, twin[edge]])
    return CellPairs(ends[edge], both[:, ::-1] // 3, both)


def pedestal_layout(
    flat: Cells, mirrors: Surfaces, pairs: CellPairs, corner: Ints, pinhole: Floats, groove: float
) -> PedestalLayout:
    """Corners and borders for grooves of a width (mm) seen from a pinhole, between m mirrors.

    The flat cells are those of planar mirrors with the same apices, the corner (t,) is what each
    triangle's becomes. NotRegularError if there is no mirror above the end of a groove.
    """
    between = corner[pairs.triangles]
    pair = np.flatnonzero(between[:, 0] != between[:, 1])
    faces, ends = pairs.faces[pair], between[pair]
    grooved = (faces < flat.mirrors).all(axis=1)
    point, plane = _joined_points(flat, corner)
    down = _downward(flat, corner, point, plane, ends[grooved], pinhole)
    sag = _sag(flat, mirrors, corner, point, down)
    if not np.isfinite(sag).all():
        raise NotRegularError(f"grooves of {groove:g} mm end where a mirror has no surface")
    top = point + sag[:, None] * down
    bounded = ~np.isin(np.arange(len(top)), ends[grooved])
    corners = Corners(
        point, top, np.where(bounded[:, None], top, top + groove * DEPTH_WIDTHS * down)
    )
    normal = _bounding_normals(flat, faces)
    normal[grooved] = _walls(flat, corners, faces[grooved], ends[grooved], pinhole, groove)
    borders = Borders(pair, faces, ends, normal)
    return PedestalLayout(flat, mirrors, pinhole, groove, pairs, corners, borders)


def _sag(flat: Cells, mirrors: Surfaces, corner: Ints, point: Floats, down: Floats) -> Floats:
    """Distance (c,) from planar mirrors' corners down to the lowest mirror; or not finite."""
    triangle, column = np.nonzero(flat.triangles < flat.mirrors)
    mirror, at = flat.triangles[triangle, column], corner[triangle]
    value = mirrors.value(mirror, point[at])
    slope = dot(down[at], mirrors.gradient(mirror, point[at]))
    lowest = np.zeros(len(point))
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(slope**2 - 2 * mirrors.curvature[mirror] * value)
        np.maximum.at(lowest, at, 2 * value / (root - slope))
    return lowest


def _bounding_normals(cells: Cells, faces: Ints) -> Floats:
    """Normals (k, 2, 3) of the bounding planes across borders (k, 2), zero where there is none."""
    across = faces[:, ::-1]
    bounding = (across >= cells.mirrors)[..., None]
    return np.where(bounding, cells.surfaces.normal[across], 0.0)


def _joined_points(cells: Cells, corner: Ints) -> tuple[Floats, Ints]:
    """Mean points of joined corners (c, 3), and the last bounding plane they lie on, or -1."""
    count = np.bincount(corner)[:, None]
    top = np.column_stack([np.bincount(corner, column) for column in cells.corners.T]) / count
    plane = np.full(len(top), -1)
    for face in range(cells.mirrors, cells.mirrors + PLANES):
        on = np.unique(corner[(cells.triangles == face).any(axis=1)])
        normal = cells.surfaces.normal[face]
        top[on] -= ((top[on] - cells.surfaces.apex[face]) @ normal)[:, None] * normal
        plane[on] = face
    return top, plane


def _downward(
    cells: Cells, corner: Ints, top: Floats, plane: Ints, ends: Ints, pinhole: Floats
) -> Floats:
    """Unit vectors (c, 3) from the corners to the bottoms of the grooves (k, 2) that end there.

    They point away from the pinhole; on a bounding plane along the line in which it meets the plane
    through groove and pinhole; on the line in which both bounding planes meet, along it.
    """
    across = np.cross(top[ends[:, 0]] - pinhole, top[ends[:, 1]] - pinhole)
    light = _toward_light(cells, corner, top)
    on_plane = np.zeros_like(top)
    for end in ends.T:
        at = end[plane[end] >= 0]
        along = unit(np.cross(across[plane[end] >= 0], cells.surfaces.normal[plane[at]]))
        np.add.at(on_plane, at, -np.sign(dot(along, light[at]))[:, None] * along)
    line = np.cross(*cells.surfaces.normal[cells.mirrors : cells.mirrors + PLANES])
    along_line = -np.sign(light @ line)[:, None] * line
    on_plane = np.where(np.isin(np.arange(len(top)), ends)[:, None], unit(on_plane), along_line)
    return np.where((plane >= 0)[:, None], on_plane, unit(top - pinhole))


def _toward_light(cells: Cells, corner: Ints, top: Floats) -> Floats:
    """Sums (c, 3) of the normals of the mirrors that meet at the corners."""
    triangle, column = np.nonzero(cells.triangles < cells.mirrors)
    mirror, at = cells.triangles[triangle, column], corner[triangle]
    total = np.zeros_like(top)
    np.add.at(total, at, cells.surfaces.gradient(mirror, top[at]))
    return total


def _walls(
    cells: Cells, corners: Corners, faces: Ints, ends: Ints, pinhole: Floats, groove: float
) -> Floats:
    """Unit normals (k, 2, 3), into the pedestals, of the walls on either side of grooves.

    As high as the lower of its two corners a groove has its width between the walls.
    """
    start, end = (corners.bottom[column] for column in ends.T)
    along = unit(end - start)
    across = unit(np.cross(start - pinhole, end - pinhole))
    apex = cells.surfaces.apex
    across *= np.sign(dot(across, apex[faces[:, 0]] - apex[faces[:, 1]]))[:, None]
    up = np.cross(along, across)
    up *= np.sign(dot(up, pinhole - start))[:, None]
    rise = np.min([dot(corners.top[e] - corners.bottom[e], up) for e in ends.T], axis=0)
    lean = (groove / 2 / rise)[:, None] * up
    return unit(np.stack([across - lean, -across - lean], axis=1))


@dataclass(frozen=True)
class Sides:
    """Sides of all mirrors on pedestals, q of them, cell after cell, counter-clockwise outside."""

    offsets: Ints  # where each cell's sides start, (m + 1,)
    cell: Ints  # (q,)
    border: Ints  # (q,)
    back: Ints  # whether the cell follows the border from end to start, (q,)
    following: Ints  # next side of the cell, (q,)
    corner: Ints  # at which each side starts, (q,)
    normal: Floats  # of the plane that ends the cell, into the cell, (q, 3)
    point: Floats  # where the side starts on the mirror, mm, (q, 3)
    length: Floats  # on the mirror or between the grooves' bottoms, the shorter, mm, (q,)


def outline_sides(layout: PedestalLayout, surfaces: Surfaces) -> Sides:
    """Sides of m mirrors, then two planes; NotRegularError if one lies below a groove's end."""
    cells, corners, borders = layout.flat, layout.corners, layout.borders
    side = np.full(3 * len(cells.triangles), -1)
    side[layout.pairs.half_edges[borders.pair]] = np.arange(2 * len(borders.pair)).reshape(-1, 2)
    offsets, sides = rings_of(cells.triangles, cells.mirrors, side)
    border, back = sides // 2, sides % 2
    cell = np.repeat(np.arange(cells.mirrors), np.diff(offsets))
    following = np.arange(len(sides)) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    corner, normal = borders.ends[border, back], borders.normal[border, back]
    before = np.empty_like(normal)
    before[following] = normal
    bottom = corners.bottom[corner]
    point = _above(surfaces, cell, bottom, np.cross(before, normal))
    height = np.where(_grooved(layout)[corner], -surfaces.value(cell, bottom), 1)
    if not height.min() > 0:
        raise NotRegularError(f"a groove ends {-height.min():.3g} mm above a mirror")
    along = unit(corners.flat[corner[following]] - corners.flat[corner])
    length = np.minimum(*(dot(line[following] - line, along) for line in (point, bottom)))
    return Sides(offsets, cell, border, back, following, corner, normal, point, length)


def _grooved(layout: PedestalLayout) -> Bools:
    """At which corners (c,) a groove ends."""
    inner = layout.borders.between_mirrors(layout.flat.mirrors)
    return np.isin(np.arange(len(layout.corners.top)), layout.borders.ends[inner])


def _above(surfaces: Surfaces, mirror: Ints, bottom: Floats, line: Floats) -> Floats:
    """Where lines (q, 3) through points (q, 3) below surfaces (q,), or near them, leave them."""
    line, value = unit(line), surfaces.value(mirror, bottom)
    slope = dot(line, surfaces.gradient(mirror, bottom))
    line *= np.where(slope < 0, -1.0, 1.0)[:, None]
    root = np.abs(slope) + np.sqrt(slope**2 - 2 * surfaces.curvature[mirror] * value)
    return np.asarray(bottom - (2 * value / root)[:, None] * line)

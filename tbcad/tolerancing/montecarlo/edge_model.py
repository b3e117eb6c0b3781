"""One half of the shell as designed, as the fast model needs it, and its simulated builds."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import GrooveWalls, PedestalCells, groove_walls
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.optics.sphere_forms import FIRST, FORM_COLUMNS, HEIGHT, PER_MM, SECOND
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.optics.zernike import MONOMIALS, term_polynomials
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.shell.cell_outlines import rows_and_columns
from tbcad.tolerancing.montecarlo.draws import ShellDraws, WarpMaps, pivots, smooth_field, warp_map
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.types import Bools, Floats, Ints

# Limit of an edge's length, in distances of its mirrors' farthest corners from their apices: the
# faces of a pair cover what lies between there and the cells.
REACH = 1.5


PairArrays: TypeAlias = tuple[Ints, Ints, Ints, Floats]
# No symmetry plane of a design contains this direction, so no corner lies on a screen's axis; for
# mirrors on the seam it points away from the seam, where both halves' outlines are open.
ASYMMETRIC = np.array([1.0, 0.1234, 0.0567])
APEX, NORMAL, CURVATURE = slice(0, 3), slice(3, 6), 6  # columns of a table of surfaces


@dataclass(frozen=True)
class NeighbourPairs:
    """Pairs of faces that may share an edge, e of them, and the faces that may cut it short."""

    pair: Ints  # a mirror and another mirror or a plane, (e, 2)
    offset: Ints  # where the faces of each pair begin in `face`, (e + 1,)
    face: Ints  # mirrors and planes, in the order of their distance from both of the pair
    reach: Floats  # maximum distance of the edge's points from its middle, mm, (e,)
    footed: Ints  # mirrors with a foot plane of their own, (r,): faces m + 2 onwards, then walls


def neighbour_pairs(cells: Cells) -> NeighbourPairs:
    """All pairs that are neighbours or share a neighbour as designed.

    Errors move corners by far less than a cell is wide, so a mirror meets no other mirror. Seam and
    foot are the first faces of each pair: they are never covered.
    """
    if isinstance(cells, PedestalCells):
        return _pairs_with_walls(cells)
    m = cells.mirrors
    adjacency = _adjacency(cells)
    nearby = csr_array(adjacency + adjacency @ adjacency)
    first, second = coo_array(nearby).coords
    pair = np.column_stack([first, second])[(first < second) & (first < m)].astype(np.int64)
    offset, face = _cutting_faces(nearby, cells.surfaces, m, pair)
    reach_mm = REACH * np.append(cell_radii(cells), [0, 0])[pair].max(axis=1)
    return _with_own_feet(pair, offset, face, reach_mm, m)


def _pairs_with_walls(cells: PedestalCells) -> NeighbourPairs:
    """A mirror on a pedestal and each plane that ends it; its other planes cut the edge there."""
    m, (offsets, sides) = cells.mirrors, cells.rings
    mirror, plane = cells.arcs.faces[sides // 2].T
    plane = np.where(plane < m + PLANES, plane, plane + np.count_nonzero(plane == m + 1))
    count = np.diff(offsets)[mirror]
    of_pair, place = rows_and_columns(count)
    side = offsets[mirror][of_pair] + place
    others = side != of_pair
    offset = np.concatenate([[0], np.cumsum(count - 1)])
    reach_mm = REACH * cell_radii(cells)[mirror]
    pair = np.column_stack([mirror, plane])
    return _with_own_feet(pair, offset, plane[side[others]], reach_mm, m)


def _with_own_feet(pair: Ints, offset: Ints, face: Ints, reach: Floats, m: int) -> NeighbourPairs:
    """Pairs with a foot plane for each mirror: a shell that warps takes its foot with it."""
    first, second = pair.T
    footed = np.unique(first[second == m + 1])
    number = np.full(m, m + 1)
    number[footed] = m + 2 + np.arange(len(footed))
    of_face = np.repeat(first, np.diff(offset))
    pair = np.column_stack([first, np.where(second == m + 1, number[first], second)])
    face = np.where(face == m + 1, number[of_face], face)
    return NeighbourPairs(pair, offset, face, reach, footed)


def cell_radii(cells: Cells) -> Floats:
    """Distance of each mirror's farthest corner from its apex, mm, (m,)."""
    mirror, corner = cells.triangles.ravel(), np.repeat(np.arange(len(cells.triangles)), 3)
    if isinstance(cells, PedestalCells):
        sides = cells.rings[1] // 2
        mirror, corner = cells.arcs.left[sides], cells.arcs.start[sides]
    mirror, corner = mirror[mirror < cells.mirrors], corner[mirror < cells.mirrors]
    radius = np.zeros(cells.mirrors)
    np.maximum.at(radius, mirror, norm(cells.corners[corner] - cells.surfaces.apex[mirror]))
    return radius


def _adjacency(cells: Cells) -> csr_array:
    """Which faces touch, (m + 2, m + 2); mirrors are not neighbours through a plane."""
    m, faces = cells.mirrors, cells.arcs.faces
    both = np.concatenate([faces, faces[:, ::-1]])
    both = both[both[:, 0] < m]
    size = (m + 2, m + 2)
    return csr_array(coo_array((np.ones(len(both), dtype=np.int64), both.T), shape=size))


def _cutting_faces(nearby: csr_array, surfaces: Surfaces, m: int, pair: Ints) -> tuple[Ints, Ints]:
    """Where the faces of each pair (e, 2) begin, (e + 1,), and the faces: see NeighbourPairs."""
    first, second = pair.T
    of_pair, place = rows_and_columns(np.diff(nearby.indptr)[first])
    face = nearby.indices[nearby.indptr[first][of_pair] + place].astype(np.int64)
    other = (face != first[of_pair]) & (face != second[of_pair])
    of_pair, face = of_pair[other], face[other]
    ends = np.where(pair < m, pair, first[:, None])[of_pair]
    distance = norm(surfaces.apex[face][:, None] - surfaces.apex[ends]).sum(axis=1)
    order = np.lexsort((np.where(face < m, distance, 0.0), of_pair))
    offset = np.searchsorted(of_pair, np.arange(len(pair) + 1))
    return np.asarray(offset, dtype=np.int64), np.asarray(face[order])


@dataclass(frozen=True, eq=False)  # compared by identity, so that what follows can be kept
class EdgeModel:
    """One camera's half as designed: m mirrors and two planes."""

    view: Camera
    table: Floats  # apex, normal, curvature of the mirrors, the seam and the foot, (m + 2, 7)
    pairs: NeighbourPairs  # which of them may share an edge
    halved: Bools  # mirrors that the seam halves, (m,)
    screen: Floats  # axes and normal u of a plane through the object each, (m, 3, 3)
    cell_radius: Floats  # distance of each mirror's farthest corner from its apex, mm, (m,)
    walls: GrooveWalls  # w of pedestals; none where neighbouring spheres meet

    def __len__(self) -> int:
        return len(self.halved)

    @property
    def apex(self) -> Floats:
        """Apices of the mirrors, mm, (m, 3)."""
        return self.table[: len(self), APEX]

    @property
    def normal(self) -> Floats:
        """Unit normals of the mirrors there, (m, 3)."""
        return self.table[: len(self), NORMAL]


EdgeModels: TypeAlias = tuple[EdgeModel, EdgeModel]


def edge_models(cameras: tuple[Reflector, Reflector]) -> EdgeModels:
    """The fast models of both cameras with their mirrors."""
    return edge_model(cameras[0]), edge_model(cameras[1])


def edge_model(at: Reflector) -> EdgeModel:
    """The fast model of one camera with its mirrors."""
    surfaces = at.cells.surfaces.subset(slice(len(at) + PLANES))
    table = np.column_stack([surfaces.apex, surfaces.normal, surfaces.curvature])
    first = unit(ASYMMETRIC - dot(at.u, ASYMMETRIC)[:, None] * at.u)
    screen = np.stack([first, np.cross(at.u, first), at.u], axis=1)
    halved = surfaces.apex[: len(at), 0] == 0
    pairs, radius = neighbour_pairs(at.cells), cell_radii(at.cells)
    return EdgeModel(at.camera, table, pairs, halved, screen, radius, groove_walls(at.cells))


def warp_maps_of(models: EdgeModels, errors: Errors) -> WarpMaps | None:
    """Effect of a process's warp on both halves; None where neighbours share none."""
    length = errors.warp.length
    if errors.warp.spread == 0 or length == 0:
        return None
    return _warp_maps(*models, length)


@lru_cache(maxsize=1)  # processes of one material share the length
def _warp_maps(a: EdgeModel, b: EdgeModel, length: float) -> WarpMaps:
    chosen = pivots(a.apex, length)  # of both halves the same mirrors
    first, second = (
        warp_map(one.table, one.cell_radius, one.walls, smooth_field(one.apex, length, chosen))
        for one in (a, b)
    )
    return first, second


def surface_tables(edge_model: EdgeModel, draws: ShellDraws) -> Floats:
    """The surfaces of s builds before their shells are scaled and moved, (s, m + 2 + r + w, 7).

    They end with the foot plane at each of the r mirrors near it (NeighbourPairs.footed) and the w
    walls. A radius too large by d moves the apex out by d; this also holds for planar mirrors,
    which a thicker coating moves too. Their tilt is not an error of its own kind. InputError if an
    error is larger than a mirror's radius.
    """
    m, footed = len(edge_model), edge_model.pairs.footed
    rows = np.append(np.arange(m + 2), np.full(len(footed), m + 1))
    designed = np.concatenate([edge_model.table[rows], edge_model.walls.table])
    table = np.repeat(designed[None], len(draws), axis=0)
    curvature = edge_model.table[:m, CURVATURE]
    if np.any(draws.radius * curvature <= -1):
        raise InputError(
            f"sphere_radius_um and coating_um leave nothing of a mirror: allowed is less than its "
            f"radius, at minimum {1000 / curvature.max():.0f} um: make the errors smaller"
        )
    table[:, :m, APEX] += draws.centre + draws.radius[:, :, None] * edge_model.normal
    table[:, :m, CURVATURE] = curvature / (1 + draws.radius * curvature)
    foot = edge_model.table[m + 1, NORMAL]
    table[:, m + 2 : len(rows), APEX] += draws.foot[:, footed, None] * foot
    table[:, len(rows) :, APEX] += draws.wall[:, :, None] * edge_model.walls.normal
    return table


def form_tables(edge_model: EdgeModel, draws: ShellDraws) -> Floats:
    """Waviness of the surfaces of s builds, (s, m + 2 + r + w, FORM_COLUMNS), of planes 0.

    They are in the order of `surface_tables`; (s, 0, ...) where no mirror has any.
    """
    if not draws.form.any():
        return np.empty((len(draws), 0, FORM_COLUMNS))
    planes = PLANES + len(edge_model.pairs.footed) + len(edge_model.walls)
    forms = np.zeros((len(draws), len(edge_model) + planes, FORM_COLUMNS))
    of_mirrors, axes = forms[:, : len(edge_model)], perpendicular_axes(edge_model.normal)
    # Not by BLAS, whose threads would get into the way of those that simulate builds.
    polynomials = np.einsum("smt,tk->smk", draws.form, term_polynomials())
    of_mirrors[..., HEIGHT : HEIGHT + len(MONOMIALS)] = polynomials
    of_mirrors[..., FIRST : FIRST + 3] = axes[:, 0]
    of_mirrors[..., SECOND : SECOND + 3] = axes[:, 1]
    of_mirrors[..., PER_MM] = 1 / edge_model.cell_radius
    return forms


def view_tables(edge_model: EdgeModel, draws: ShellDraws) -> Floats:
    """Camera and object of s builds, in the frame of the shell, (s, 4, 3).

    The rows are pinhole, object's centre, scale, and the radius of the valleys' fillets. Camera and
    object are moved instead of the shell.
    """
    shell = Rotation.from_rotvec(draws.shell_tilt)
    pinhole = edge_model.view.pinhole + draws.camera_shift
    points = [shell.apply(point - draws.shell_shift, inverse=True) for point in (pinhole, 0.0)]
    valley = np.zeros_like(draws.scale)
    valley[:, 0] = draws.valley
    return np.stack([*points, draws.scale, valley], axis=1)

"""Random errors of simulated builds, as arrays over builds; warp, which mirrors of a part share.

Every point x of a shell in one piece is displaced by d(x), each component of which is a Gaussian
random field. Neighbouring mirrors move, turn and bend together. A mirror becomes the sphere with
astigmatism h that fits its displaced points best: with their normals n, n . d = n . e + r' + h,
where the displacement e of the centre, the growth r' of the radius and h are sought. Shells that
are moved, turned or scaled as a whole are followed exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.vectors import dot, perpendicular_axes
from tbcad.core.optics.pedestals.cells import GrooveWalls
from tbcad.core.optics.zernike import TERMS, monomials, term_polynomials
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.form import ASTIGMATISM, term_shares
from tbcad.types import Floats, Ints

MISSING_VARIANCE = 1e-6  # that a field may lack at any point: 0.1 % of its standard deviation
COMPARED_DIGITS = 9  # of variances, so that rounding does not choose among equal points
RING_POINTS = 6  # of a mirror that are followed on a circle, besides its apex
RING_SHARE = 0.8


@dataclass(frozen=True)
class SmoothField:
    """A field of unit variance, as a function of K standard normal numbers."""

    points: Floats  # X, mm, (K, 3)
    length: float  # correlation length L, mm
    factor: Floats  # F, lower triangular, (K, K)

    def __len__(self) -> int:
        return len(self.points)

    def basis(self, places: Floats) -> Floats:
        """Share of each random number in the field at places (p, 3), (p, K)."""
        kernel = covariance(places, self.points, self.length)
        solved = np.linalg.solve(self.factor, kernel.T).T
        return np.ascontiguousarray(solved, dtype=np.float64)


def smooth_field(points: Floats, length: float, chosen: Ints | None = None) -> SmoothField:
    """The field of a part by its chosen points, or by `pivots` of all; nearer than the length."""
    chosen = pivots(points, length) if chosen is None else chosen
    some = points[chosen]
    factor = np.asarray(np.linalg.cholesky(covariance(some, some, length)), dtype=np.float64)
    return SmoothField(some, length, factor)


def covariance(first: Floats, second: Floats, length: float) -> Floats:
    """Covariance of a field of unit variance between points (p, 3) and (q, 3), (p, q)."""
    square = sum((first[:, None, axis] - second[None, :, axis]) ** 2 for axis in range(3))
    result: Floats = np.exp(square / (-2 * length * length))
    return result


def pivots(points: Floats, length: float) -> Ints:
    """Numbers of the points (n, 3) from whose values the field follows at all others.

    Incomplete Cholesky factorisation with the largest remaining variance as the pivot, until the
    variance that is missing, of 1, is less at all points.
    """
    left, chosen = np.ones(len(points)), list[int]()
    columns = np.empty((len(points), len(points)))
    while left.max() > MISSING_VARIANCE:
        pivot = int(np.argmax(np.round(left, COMPARED_DIGITS)))
        known = columns[:, : len(chosen)]
        column = covariance(points, points[[pivot]], length)[:, 0] - known @ known[pivot]
        columns[:, len(chosen)] = column / np.sqrt(column[pivot])
        left = np.maximum(left - columns[:, len(chosen)] ** 2, 0.0)
        left[pivot] = 0.0
        chosen.append(pivot)
    return np.array(chosen, dtype=np.int64)


@dataclass(frozen=True)
class WarpMap:
    """Effect of K random numbers for each axis on the m mirrors of one half."""

    basis: Floats  # of the field at q points of each mirror, the apex first, (K, m q)
    fit: Floats  # sphere and astigmatism from displacements along the normals, (m, 6, q)
    normal: Floats  # there, (m, q, 3)
    foot_basis: Floats  # of the field where each mirror is nearest to the foot plane, (m, K)
    foot_normal: Floats  # unit normal of the foot plane, (3,)
    wall_basis: Floats  # of the field in the middle of the edge at each wall of a pedestal, (K, w)
    wall_normal: Floats  # unit normals of the walls, (w, 3)

    def walls_moved(self, numbers: Floats) -> Floats:
        """Displacements of the walls of one build by numbers (K, 3), along their normals, (w,)."""
        return dot(field_values(self.wall_basis, numbers).T, self.wall_normal)

    def moved(self, numbers: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Displacements of the mirrors of one build by random numbers (K, 3), mm.

        Of the centres (m, 3), by which radii grow (m,), of the foot plane at each mirror along its
        normal (m,), and factors of the two terms of astigmatism (m, 2), mm.
        """
        points = field_values(self.basis, numbers).reshape(3, *self.normal.shape[:2])
        along = np.einsum("xmq,mqx->mq", points, self.normal)
        spheres = np.einsum("mkq,mq->mk", self.fit, along)
        foot = np.einsum("mk,k->m", self.foot_basis, dot(numbers, self.foot_normal))
        return spheres[:, :3], spheres[:, 3], foot, spheres[:, 4:]


WarpMaps: TypeAlias = tuple[WarpMap, WarpMap]


@compiled_loop
def field_values(basis: Floats, numbers: Floats) -> Floats:
    """Displacements (3, p) by random numbers (K, 3) and the field's basis (K, p).

    Not by BLAS, whose threads would get into the way of those that simulate builds, and not by
    einsum, which takes three times as long.
    """
    result = np.zeros((3, basis.shape[1]))
    for k in range(len(basis)):
        x, y, z = numbers[k, 0], numbers[k, 1], numbers[k, 2]
        for p in range(basis.shape[1]):
            result[0, p] += basis[k, p] * x
            result[1, p] += basis[k, p] * y
            result[2, p] += basis[k, p] * z
    return result


def warp_map(table: Floats, cell_radius: Floats, walls: GrooveWalls, field: SmoothField) -> WarpMap:
    """Effect of a field on a half: see `EdgeModel` for its table (m + 2, 7) and cell radii (m,)."""
    apex, foot = table[:-2, :3], table[-1]
    points, normal = mirror_points(table[:-2], RING_SHARE * cell_radius)
    x, y = RING_SHARE * np.vstack([np.zeros(2), _circle()]).T
    astigmatism = monomials(x, y) @ term_polynomials()[list(ASTIGMATISM)].T
    height = np.broadcast_to(astigmatism, (len(apex), RING_POINTS + 1, 2))
    unknowns = np.concatenate([normal, np.ones((*normal.shape[:2], 1)), height], axis=2)
    above = dot(apex - foot[:3], foot[3:6])
    return WarpMap(
        basis=np.ascontiguousarray(field.basis(points.reshape(-1, 3)).T),
        fit=np.linalg.pinv(unknowns),
        normal=normal,
        foot_basis=field.basis(apex - above[:, None] * foot[3:6]),
        foot_normal=foot[3:6],
        wall_basis=np.ascontiguousarray(field.basis(walls.point).T),
        wall_normal=walls.normal,
    )


def _circle() -> Floats:
    angle = 2 * np.pi * np.arange(RING_POINTS) / RING_POINTS
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def mirror_points(table: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Points of mirrors (m, 7), apex and ring (m,), and unit normals there, (m, q, 3) each."""
    apex, normal, curvature = table[:, :3], table[:, 3:6], table[:, 6]
    across = radius[:, None, None] * (_circle() @ perpendicular_axes(normal))
    depth = curvature * radius**2 / (1 + np.sqrt(1 - (curvature * radius) ** 2))
    ring = across - (depth[:, None] * normal)[:, None]
    offset = np.concatenate([np.zeros((len(table), 1, 3)), ring], axis=1)
    return apex[:, None] + offset, normal[:, None] + curvature[:, None, None] * offset


Shape = tuple[int, ...]


@dataclass(frozen=True)
class ShellDraws:
    """Errors of one camera's half of the shell in s builds, in the order of the builds.

    A point x of the designed shell is moved to R(shell_tilt) (scale * x) + shell_shift.
    """

    centre: Floats  # of the spheres, mm, (s, m, 3)
    radius: Floats  # by which the spheres are too large, coating included, mm, (s, m)
    scale: Floats  # size over the designed size along each axis, (s, 3)
    shell_shift: Floats  # mm, (s, 3)
    shell_tilt: Floats  # rotation vectors about the object's centre, radians, (s, 3)
    camera_shift: Floats  # of the pinhole, mm, (s, 3)
    camera_tilt: Floats  # rotation vectors about the pinhole, radians, (s, 3)
    focal: Floats  # focal length over the designed one, (s,)
    facets: Floats  # coverage lost on facets, mm, (s,)
    foot: Floats  # of the foot plane at each mirror, along its normal, mm, (s, m)
    wall: Floats  # of each wall of a pedestal, along its normal into the mirror's cell, mm, (s, w)
    form: Floats  # factors of the mirrors' form errors (tolerancing.montecarlo.form), mm, (s, m, t)
    valley: Floats  # radius of the fillets in the valleys between mirrors, mm, (s,)

    def __len__(self) -> int:
        return len(self.focal)


def draw(
    errors: Errors,
    seed: int,
    builds: Sequence[int],
    mirrors: int,
    warp: WarpMaps | None = None,
    walls: int = 0,
) -> tuple[ShellDraws, ShellDraws]:
    """Errors of both halves of builds of some numbers, of m mirrors and w walls of pedestals each.

    The warp's maps are those of `warp_maps_of`; ValueError if neighbours share a warp and they are
    missing.
    """
    if warp is None and errors.warp.spread != 0 and errors.warp.length != 0:
        raise ValueError("the warp of these errors needs its maps")
    shapes = shell_error_shapes(mirrors, len(warp[0].basis) if warp else mirrors, walls)
    drawn = draw_kinds(errors, seed, builds, shapes)
    maps = warp or (None, None)
    return _half(drawn, 0, maps[0]), _half(drawn, 1, maps[1])


def shell_error_shapes(m: int, modes: int = 0, walls: int = 0) -> dict[str, Shape]:
    """Shape of each kind of error of a shell, in the order of the streams; only append to it.

    A half has m mirrors, w walls of pedestals, and a warp that follows from so many vectors.
    """
    return {
        "sphere_centre": (2, m, 3),
        "sphere_radius": (2, m),
        "scale_isotropic": (2,),
        "scale_axis": (3,),
        **dict.fromkeys(("shell_shift", "shell_tilt", "camera_shift", "camera_tilt"), (2, 3)),
        **dict.fromkeys(("camera_focal", "coating", "facets"), (2,)),
        "warp": (2, modes, 3),
        "waviness": (2, m, len(TERMS)),
        "groove_wall": (2, walls),
        # Mirrors on pedestals have no valleys.
        **dict.fromkeys(("cutter_radius", "ridge_rounding"), (2, int(walls == 0))),
    }


def _half(drawn: Mapping[str, Floats], side: int, warp: WarpMap | None) -> ShellDraws:
    def of(kind: str) -> Floats:
        return drawn[kind][:, side]

    draws = ShellDraws(
        centre=of("sphere_centre"),
        radius=of("sphere_radius") + of("coating")[:, None],
        scale=1 + of("scale_isotropic")[:, None] + drawn["scale_axis"],
        shell_shift=of("shell_shift"),
        shell_tilt=of("shell_tilt"),
        camera_shift=of("camera_shift"),
        camera_tilt=of("camera_tilt"),
        focal=1 + of("camera_focal"),
        facets=of("facets"),
        foot=np.zeros(of("sphere_radius").shape),
        wall=of("groove_wall"),
        form=of("waviness") * np.sqrt(term_shares()),
        valley=np.maximum(of("cutter_radius"), of("ridge_rounding")).max(axis=1, initial=0),
    )
    if warp is None:  # each mirror is displaced by its own
        return replace(draws, centre=draws.centre + of("warp"))
    for build, numbers in enumerate(of("warp")):
        centre, radius, foot, astigmatism = warp.moved(numbers)
        draws.centre[build] += centre
        draws.radius[build] += radius
        draws.foot[build] += foot
        draws.wall[build] += warp.walls_moved(numbers)
        draws.form[build][:, ASTIGMATISM] += astigmatism
    return draws


def draw_kinds(
    errors: Errors,
    seed: int,
    builds: Sequence[int],
    shapes: Mapping[str, Shape],
    first_stream: int = 0,
) -> dict[str, Floats]:
    """Random errors of each kind, by shapes in the order of the streams, for s builds, (s, ...).

    A build depends on the seed and its number alone, not on the others drawn with it. Each kind of
    error has its own random stream, so that a change of one kind leaves the others as they are.
    """
    return {
        kind: _draw_kind(getattr(errors, kind), seed, builds, first_stream + k, shape)
        for k, (kind, shape) in enumerate(shapes.items())
    }


def _draw_kind(error: Error, seed: int, builds: Sequence[int], stream: int, shape: Shape) -> Floats:
    drawn = np.full((len(builds), *shape), float(error.mean))
    if error.spread != 0:
        for row, build in enumerate(builds):
            key = np.random.SeedSequence(seed, spawn_key=(build, stream))
            drawn[row] = error.sample(np.random.Generator(np.random.Philox(key)), *shape)
    return drawn

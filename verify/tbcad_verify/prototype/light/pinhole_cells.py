"""The mirrors' cells in the camera's picture, from mirrors.csv alone.

The mirror that the pinhole sees first along a ray is found among all spheres, and each cell's
outline by bisection of angles about the direction of the mirror's apex.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.mesh.rays import pixel_rows
from tbcad_verify.mesh.vectors import chunks, dot, norm, tangent_basis, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.export import Camera
from tbcad_verify.types import Bools, Floats, Ints

OUTLINE_DIRECTIONS = 96
NEIGHBOURS = 20
HALVINGS = 34
MAX_ANGLE = 1.2  # rad, from a mirror's apex to its outline, where no neighbour ends the cell
INSIDE = 0.98  # of the angle to the outline, where the mirror itself must be seen
SLACK = 1e-6  # rad: cosines near 1 are off by rounding
PIXELS = 100_000  # of the sensor are sampled, about
TILE = 16  # columns and rows of sampled pixels that follow each other: few mirrors are near all


@dataclass(frozen=True)
class MirrorSpheres:
    """The reflecting spheres of m mirrors, coats included."""

    pinhole: Floats  # (3,) mm
    apex: Floats  # (3, m) mm
    centre: Floats  # (3, m) mm
    radius: Floats  # (m,) mm
    side: float  # 1 where the camera's mirrors have x >= 0, else -1
    foot: float  # height below which there is no mirror, mm
    halved: Bools  # (m,) mirrors whose other half is the other camera's


@dataclass(frozen=True)
class PinholeOutlines:
    """Cells' edges: OUTLINE_DIRECTIONS directions for each of m mirrors, in order round the apex.

    Attributes:
        chief: (3, m) unit, to the apices.
        direction: (3, m, OUTLINE_DIRECTIONS) unit.
        angle: (m, OUTLINE_DIRECTIONS) from the chief, rad.
        is_edge: (m, OUTLINE_DIRECTIONS) false where a halved mirror goes on beyond the seam.
    """

    chief: Floats
    direction: Floats
    angle: Floats
    is_edge: Bools

    def take(self, mirror: Ints) -> PinholeOutlines:
        """The cells of some mirrors."""
        chief, direction = self.chief[:, mirror], self.direction[:, mirror]
        return PinholeOutlines(chief, direction, self.angle[mirror], self.is_edge[mirror])

    def at_share(self, share: Floats) -> Floats:
        """(3, m, OUTLINE_DIRECTIONS) directions at shares (m, ...) of the angle to the outline."""
        angle = share * self.angle
        return np.asarray(np.cos(angle) * self.chief[:, :, None] + np.sin(angle) * self._across)

    @cached_property
    def _across(self) -> Floats:
        """(3, m, OUTLINE_DIRECTIONS) from the chief toward the outline, unit."""
        edge = self.direction - np.cos(self.angle) * self.chief[:, :, None]
        return np.asarray(edge / np.maximum(np.sin(self.angle), 1e-300))


def mirror_spheres(context: PrototypeContext) -> MirrorSpheres:
    """The spheres of the camera that the prototype serves."""
    rows = context.export.mirrors.take(context.mirror_rows)
    return MirrorSpheres(
        context.pinhole,
        rows.columns("px", 3),
        rows.columns("cx", 3),
        rows.columns("radius_mm")[0],
        float(np.sign(context.pinhole[0])),
        context.export.foot_z_mm,
        context.halved,
    )


def cell_outlines(shell: MirrorSpheres) -> PinholeOutlines:
    """Outlines of all cells; of one that does not contain its own apex, the apex itself."""
    chief = unit(shell.apex - shell.pinhole[:, None])
    first, second = tangent_basis(chief)
    around = 2 * np.pi * np.arange(OUTLINE_DIRECTIONS) / OUTLINE_DIRECTIONS
    out = first[:, :, None] * np.cos(around) + second[:, :, None] * np.sin(around)
    near = _neighbours(shell)
    high = _outside(shell, near, chief, out)
    low = np.zeros_like(high)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        d = np.cos(middle) * chief[:, :, None] + np.sin(middle) * out
        inside = _inside(shell, near, d)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    d = np.cos(low) * chief[:, :, None] + np.sin(low) * out
    is_edge = ~shell.halved[:, None] | (shell.side * _points(shell, d)[0] >= 0)
    return PinholeOutlines(chief, d, low, is_edge)


def _outside(shell: MirrorSpheres, near: Ints, chief: Floats, out: Floats) -> Floats:
    """(m, OUTLINE_DIRECTIONS) angles beyond the outline: rad, to the farthest of the neighbours.

    Not farther where that is outside: toward its silhouette a sphere may rise above the foot again.
    """
    cosine = (chief[:, :, None] * chief[:, near]).sum(axis=0)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)).max(axis=1, initial=0.0)[:, None]
    inside = _inside(shell, near, np.cos(angle) * chief[:, :, None] + np.sin(angle) * out)
    return np.where(inside, MAX_ANGLE, angle)


def first_mirrors(shell: MirrorSpheres, d: Floats, together: int = OUTLINE_DIRECTIONS) -> Ints:
    """(N,) the mirror that the pinhole sees first along d (3, N); -1 for none.

    Beyond the seam and below the foot there is no mirror. As many directions as `together` says
    that follow each other are tried against the spheres near all of them.
    """
    toward = shell.centre - shell.pinhole[:, None]
    # A sphere about the pinhole is met by all rays.
    sine = np.where(norm(toward) > shell.radius, shell.radius / norm(toward), np.nan)
    half = np.nan_to_num(np.arcsin(sine), nan=np.pi) + SLACK
    toward, parts = unit(toward), chunks(d.shape[1], together)
    # Arrays are too small for threads, which would wait for the interpreter.
    first = [_first(shell, toward, half, d[:, part]) for part in parts]
    return np.concatenate([np.zeros(0, dtype=np.int64), *first])


def sampled_pixels(camera: Camera) -> tuple[Floats, int]:
    """Directions (3, N), with 1 along `forward`, of every k-th pixel of every k-th row; and k."""
    step = max(1, int(np.sqrt(camera.width * camera.height / PIXELS)))
    rows = range(step // 2, camera.height, step)
    grid = np.stack([pixel_rows(camera, k, k + 1)[:, step // 2 :: step] for k in rows], axis=1)
    tiles = [
        grid[:, y : y + TILE, x : x + TILE].reshape(3, -1)
        for y in range(0, grid.shape[1], TILE)
        for x in range(0, grid.shape[2], TILE)
    ]
    return np.concatenate(tiles, axis=1), step


def _first(shell: MirrorSpheres, toward: Floats, half: Floats, d: Floats) -> Ints:
    some = _near(toward, half, d)
    offset, radius = shell.pinhole[:, None] - shell.centre[:, some], shell.radius[some]
    # No BLAS, whose rounding depends on the number of threads.
    b = np.einsum("in,im->nm", d, offset, optimize=False)
    square = dot(d, d)[:, None]
    power = dot(offset, offset) - radius**2
    under = b * b - square * power
    met = (under >= 0) & ((b <= 0) | (power <= 0))  # and not behind the pinhole
    with np.errstate(invalid="ignore"):
        reach = np.where(met, -b - np.sqrt(under), np.inf)
    mirror = reach.argmin(axis=1)
    nearest = reach[np.arange(mirror.size), mirror] / square[:, 0]
    point = shell.pinhole[:, None] + np.where(np.isfinite(nearest), nearest, 0) * d
    good = np.isfinite(nearest) & (shell.side * point[0] >= 0) & (point[2] >= shell.foot)
    return np.where(good, some[mirror], -1)


def _near(toward: Floats, half: Floats, d: Floats) -> Ints:
    """Spheres that any of rays d (3, N) may meet, at least one: those in the cone about all rays.

    Of unit directions (3, m) of the centres, and angles (m,) from them to the outlines, rad.
    """
    rays = unit(d)
    axis = unit(rays.sum(axis=1, keepdims=True))
    spread = float(np.arccos(np.clip(dot(axis, rays).min(), -1, 1)))
    reach = np.cos(np.minimum(half + spread, np.pi))
    near = np.flatnonzero(dot(axis, toward) >= reach)
    return near if near.size else np.zeros(1, dtype=np.int64)


def _neighbours(shell: MirrorSpheres) -> Ints:
    """(m, NEIGHBOURS) the mirrors nearest to each, without itself."""
    count = min(NEIGHBOURS + 1, shell.radius.size)
    nearest = cKDTree(unit(shell.apex).T).query(unit(shell.apex).T, k=count)[1]
    return np.asarray(nearest, dtype=np.int64).reshape(shell.radius.size, count)[:, 1:]


def _points(shell: MirrorSpheres, d: Floats) -> Floats:
    """(3, m, s) where rays d meet their own mirrors' balls first; NaN where they miss."""
    offset = (shell.pinhole[:, None] - shell.centre)[:, :, None]
    b = (d * offset).sum(axis=0)
    rest = (offset**2).sum(axis=0) - shell.radius[:, None] ** 2
    with np.errstate(invalid="ignore"):
        return np.asarray(shell.pinhole[:, None, None] + (-b - np.sqrt(b * b - rest)) * d)


def _inside(shell: MirrorSpheres, near: Ints, d: Floats) -> Bools:
    """(m, s) whether rays meet their own mirror, above the foot, on its side, in no neighbour."""
    point = _points(shell, d)
    good = np.isfinite(point[0]) & (point[2] >= shell.foot)
    good &= shell.halved[:, None] | (shell.side * point[0] >= 0)
    centre, radius = shell.centre, shell.radius
    power = (centre**2).sum(axis=0) - radius**2
    for k in range(near.shape[1]):
        other = near[:, k]
        # Inside the other sphere: beyond the radical plane, where both powers are equal.
        across = 2 * (centre[:, other] - centre)
        level = power[other] - power
        good &= (across[:, :, None] * point).sum(axis=0) <= level[:, None]
    return np.asarray(good)

"""Reach of a ball cutter on the mirrors of a mesh.

A ball touches each mirror at points that are spread evenly over its area, along the normals of the
sphere through its corners. It reaches those where it cuts into no facet of the part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mesh import Mesh, longest_sides
from tbcad_verify.mesh.segments import half_edge_vectors
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.touching_balls import cut_depths
from tbcad_verify.mesh.vectors import norm, unit
from tbcad_verify.record.export import Part
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_least,
    informative,
    worst_offenders,
)
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.types import Floats

BALLS, LEAST = 1 << 12, 32  # on all mirrors of a mesh together, and on each at least
# Steps of a sequence that fills a cube evenly (M. Roberts, The Unreasonable Effectiveness of
# Quasirandom Sequences, 2018): equal steps of area would fall on the same columns of a grid.
STEPS = np.array([[0.8191725133961645], [0.6710436067037893], [0.5497004779019703]])
# By how much a ball may cut in besides the facets' chord error: rounding of fits and of float32.
TOLERANCE_MM = 5e-4


@dataclass(frozen=True)
class CutterReach:
    """Reach of a ball on M mirrors; NaN for those that a mesh has not."""

    share: Floats  # (M,) of the mirror's area that it touches without cutting in, 0 to 1
    depth: Floats  # (M,) by how much it cuts in at most, mm
    area: Floats  # (M,) mm^2

    def words(self, ids: Sequence[str], radius: float) -> str:
        """The worst mirrors, all together, and the deepest cut."""
        worst = worst_offenders(ids, 100 * self.share, "%", self.share < 1, ".0f", -self.share)
        whole = 100 * np.nansum(self.share * self.area) / self.area.sum()
        deepest = 1e3 * np.nanmax(self.depth)
        return (
            f"{worst or 'all'} reached by a ball of {radius:g} mm, {whole:.1f} % of all area; "
            f"it cuts in by {deepest:.1f} um"
        )


def measure_reach(
    mesh: Mesh, own: NDArray[np.intp], surfaces: Surfaces, radius: float
) -> CutterReach:
    """Put balls of a radius, mm, on all mirrors of a mesh.

    `own`: (F,) mirror of each facet, negative for none.
    `surfaces`: M, through the mirrors' corners; normals out of the material.
    """
    mirror, touched, area = _spread(mesh, own, surfaces.curvature.size)
    depth = cut_depths(mesh, touched, unit(surfaces.take(mirror).gradient(touched)), radius)
    cut = depth > _tolerances(mesh, own, surfaces.curvature)[mirror]
    share, deepest = np.where(area > 0, [[1.0], [0.0]], np.nan)
    share -= np.bincount(mirror, cut, area.size) / np.maximum(
        np.bincount(mirror, minlength=area.size), 1
    )
    np.maximum.at(deepest, mirror, np.where(cut, depth, 0.0))
    return CutterReach(share, deepest, area)


def mandrel_reach_check(
    name: CheckName, mesh: Mesh, own: NDArray[np.intp], setup: OpticalSetup, radius: float | None
) -> Check:
    """Radius of the largest ball that may reach all mirrors of a negative, against a cutter's.

    It is that of the smallest pocket; less where the cutter's ball cuts in, by half the depth.

    `own`: (F,) mirror of each of the negative's facets, negative for none.

    Unknown: the negative has no mirror.
    """
    if not (own >= 0).any():
        raise Unknown("it has no mirror of the shell's")
    found = _surfaces(setup)
    pocket = 1 / max(float(found.curvature[np.unique(own[own >= 0])].max()), np.finfo(float).tiny)
    if radius is None:
        return informative(
            name, pocket, "the smallest pocket: no larger ball; --cutter puts balls on all"
        )
    negative = Surfaces(found.point, -found.normal, -found.curvature)
    reach = measure_reach(mesh, own, negative, radius)
    deepest = float(np.nanmax(reach.depth))
    largest = min(pocket, radius - deepest / 2) if deepest else pocket
    return at_least(name, largest, radius, reach.words(setup.export.mirrors.ids, radius))


def fillet_checks(setup: OpticalSetup, radius: float) -> list[Check]:
    """Mean width of what a ball leaves in each shell's valleys, on each side of mirrors' edges."""
    return [_fillets(part, setup, radius) for part in setup.export.parts]


def _fillets(part: Part, setup: OpticalSetup, radius: float) -> Check:
    own, mesh = shell_mirrors(setup, part.camera), setup.mesh
    mine = own > -2
    shell = Mesh(mesh.points, mesh.faces[mine], mesh.twin, mesh.area[:, mine])
    reach = measure_reach(shell, own[mine], _surfaces(setup), radius)
    half = np.flatnonzero((mesh.twin >= 0) & (own >= 0).repeat(3))
    other = own[mesh.twin[half] // 3]
    edges = half[(other >= 0) & (other != own[half // 3])]
    length = norm(half_edge_vectors(mesh, edges)[1]).sum()
    width = float(np.nansum((1 - reach.share) * reach.area) / length) if edges.size else 0.0
    words = reach.words(setup.export.mirrors.ids, radius)
    return informative(("fillet width", part.stl, "um"), 1e3 * width, words)


def shell_mirrors(setup: OpticalSetup, camera: str) -> NDArray[np.intp]:
    """(F,) recorded mirror of each facet of the shells; -1: none, -2: of another camera's shell."""
    label = setup.recovery.segments.label
    cameras = np.array([part.camera for part in setup.export.parts])
    mine = cameras[setup.part[label]] == camera
    return np.where(mine, setup.owner()[label], -2)


def _surfaces(setup: OpticalSetup) -> Surfaces:
    """(M,) what was found on the shells, below the coat; those of missing mirrors mean nothing."""
    return setup.recovery.fits.surfaces.take(setup.match.segment)


def _spread(
    mesh: Mesh, own: NDArray[np.intp], count: int
) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Mirrors (N,) and points (3, N) on their facets, evenly by area; area of each mirror (M,)."""
    mine = np.flatnonzero(own >= 0)
    mine = mine[np.argsort(own[mine], kind="stable")]
    size = norm(mesh.area[:, mine]) / 2
    area = np.bincount(own[mine], size, count).astype(np.float64)
    there = np.flatnonzero(area)
    mirror = there.repeat(max(LEAST, BALLS // there.size))
    share, *across = STEPS * np.arange(1, mirror.size + 1) % 1
    at = np.cumsum(area)[mirror] - share * area[mirror]
    facet = mine[np.minimum(np.searchsorted(np.cumsum(size), at), mine.size - 1)]
    u, v = np.where(np.sum(across, axis=0) > 1, np.subtract(1, across), across)
    a, b, c = (mesh.points[mesh.faces[facet, k]].T for k in range(3))
    return mirror, a + u * (b - a) + v * (c - a), area


def _tolerances(mesh: Mesh, own: NDArray[np.intp], curvature: Floats) -> Floats:
    """(M,) how far a ball inside a hollow mirror may cut into facets that follow it, mm.

    A triangle with corners on a sphere is nowhere farther from it than longest^2 / 6 R.
    """
    longest = np.zeros(curvature.size)
    np.maximum.at(longest, own[own >= 0], longest_sides(mesh)[own >= 0])
    return TOLERANCE_MM + longest**2 / 6 * np.maximum(-curvature, 0)

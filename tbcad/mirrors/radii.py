"""Radius rules: what curvature each mirror gets."""

from dataclasses import dataclass

import numpy as np

from tbcad.optics.cells import Cells, cells_of
from tbcad.optics.power_diagram import NotRegularError
from tbcad.optics.surfaces import Surfaces
from tbcad.optics.trace import coverage_diameters
from tbcad.spec.errors import SpecError
from tbcad.types import Floats, Ints, Progress

# A hundredth of a millimetre would do; verification's figures are steadier with an exact design.
CONVERGED_MM = 1e-4
MAX_ITERATIONS = 400
# Designs that settle need none; each costs as much as a step, and further ones have never helped.
MAX_HALVINGS = 4
# Mirrors that an error names at most.
NAMED_MIRRORS = 5


@dataclass(frozen=True)
class RadiusProblem:
    """What a radius rule starts from: poses, bounding planes and a first dual triangulation.

    Attributes:
        mirrors: surfaces with the curvatures of eq. 2, zero or less where flat is enough, (m,).
        planes: the seam and the foot plane.
        triangles: dual triangulation, (t, 3).
        pinhole: of the camera, mm, (3,).
        min_curvature: smallest curvature a sphere may have, 1/mm, (m,).
        target: coverage diameter that the rule traced gives every mirror, mm.
    """

    mirrors: Surfaces
    planes: Surfaces
    triangles: Ints
    pinhole: Floats
    min_curvature: Floats
    target: float

    def cells(self, curvature: Floats, triangles: Ints | None = None) -> Cells:
        """Cells for curvatures (m,), from the given triangulation or the first one."""
        surfaces = self.mirrors.with_curvature(curvature).joined(self.planes)
        start = self.triangles if triangles is None else triangles
        return cells_of(surfaces, start)

    @property
    def paper_curvature(self) -> Floats:
        """Curvatures of eq. 2, but at least the smallest a sphere may have, 1/mm, (m,)."""
        return np.maximum(self.mirrors.curvature, self.min_curvature)


def solve_radii(
    rule: str, problem: RadiusProblem, progress: Progress = lambda _: None
) -> tuple[Cells, Floats]:
    """Cells of the mirrors with radii by a rule, and their coverage diameters (m,), mm.

    Args:
        rule: "traced" (exact rays), "paper" (eqs. 1 and 2 of the paper; nearly flat where those
            give no curvature or hardly any) or "flat" (planar mirrors, Mukaigawa et al.).
        problem: poses and bounding planes of the mirrors.
        progress: called with the state of the search.

    Raises:
        SpecError: when the mirrors do not close to one array, or rule traced finds no radii.
    """
    try:
        if rule == "traced":
            return _traced(problem, progress)
        flat = np.zeros(len(problem.mirrors))
        cells = problem.cells(flat if rule == "flat" else problem.paper_curvature)
    except NotRegularError as error:
        raise SpecError(
            f"mirrors with radius rule {rule} do not close to one array ({error}): "
            "change mirrors.radius_rule, optics.n or optics.capture_diameter_mm"
        ) from None
    return cells, coverage_diameters(cells, problem.pinhole)


def _traced(problem: RadiusProblem, progress: Progress) -> tuple[Cells, Floats]:
    """Radii with which every mirror's exact coverage is the target, or more where nearly flat.

    Coverage grows about in proportion to curvature and hardly depends on the neighbours, so each
    curvature is scaled by target / coverage, all together, until none is off. Where a step goes
    so far that spheres no longer meet it is halved: flat mirrors always close.
    """
    curvature, lowest = problem.paper_curvature, problem.min_curvature
    closed, triangles = np.zeros(len(curvature)), problem.triangles
    coverage, error, halvings = np.zeros(len(curvature)), np.full(len(curvature), np.inf), 0
    for _ in range(MAX_ITERATIONS):
        try:
            cells = problem.cells(curvature, triangles)
        except NotRegularError:
            halvings += 1
            if halvings > MAX_HALVINGS:
                break
            curvature = (curvature + closed) / 2
            lowest = np.minimum(lowest, curvature)
            continue
        closed, triangles = curvature, cells.triangles
        coverage = coverage_diameters(cells, problem.pinhole)
        error = np.where(curvature > lowest, np.abs(coverage - problem.target), 0.0)
        error = np.maximum(error, problem.target - coverage)
        if error.max() < CONVERGED_MM:
            return cells, coverage
        progress(f"largest error of coverage {error.max():.1g} mm")
        curvature = np.maximum(curvature * problem.target / coverage, lowest)
    worst = np.argsort(-error)[:NAMED_MIRRORS]
    named = ", ".join(f"a{i + 1:04d} ({coverage[i]:.3f} mm)" for i in worst)
    raise SpecError(
        f"no radius gives these mirrors a coverage of {problem.target:g} mm: {named}: change "
        "optics.n, optics.capture_diameter_mm or mirrors.margin_mm"
    )

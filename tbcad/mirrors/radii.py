"""Radius rules: what curvature each mirror gets."""

from dataclasses import dataclass

import numpy as np

from tbcad.optics.cells import Cells, cells_of
from tbcad.optics.power_diagram import Boundary, NotRegularError
from tbcad.optics.surfaces import Surfaces
from tbcad.optics.trace import coverage_diameters
from tbcad.spec.errors import SpecError
from tbcad.types import Floats, Ints, Progress

# Asked for is 0.01 mm of coverage; the proof's figures are steadier when the design is exact.
CONVERGED_MM = 1e-4
MAX_ITERATIONS = 400
MAX_HALVINGS = 12
NAMED = 5


@dataclass(frozen=True)
class RadiusProblem:
    """What a rule starts from: poses, bounds and a dual triangulation to begin with.

    Attributes:
        mirrors: surfaces with the paper's curvatures (zero or less where flat is enough).
        planes: the seam and the foot plane.
        boundary: indices of the planes.
        triangles: dual triangulation, (t, 3).
        pinhole: of the camera, mm, (3,).
        least: least curvature a sphere may have, 1/mm, (m,).
        target: coverage diameter wanted by rule traced, mm.
    """

    mirrors: Surfaces
    planes: Surfaces
    boundary: Boundary
    triangles: Ints
    pinhole: Floats
    least: Floats
    target: float

    def cells(self, curvature: Floats, triangles: Ints | None = None) -> Cells:
        """Cells for curvatures (m,), from the given triangulation or the first one."""
        surfaces = self.mirrors.with_curvature(curvature).joined(self.planes)
        start = self.triangles if triangles is None else triangles
        return cells_of(surfaces, self.boundary, start)


def flat_radii(task: RadiusProblem) -> tuple[Cells, Floats]:
    """Planar mirrors (Mukaigawa et al.): cells and their coverage (m,), mm."""
    cells = task.cells(np.zeros(len(task.mirrors)))
    return cells, coverage_diameters(cells, task.pinhole)


def paper_radii(task: RadiusProblem) -> tuple[Cells, Floats]:
    """Radii by eqs. 1 and 2; nearly flat where those want no curvature or hardly any."""
    cells = task.cells(np.maximum(task.mirrors.curvature, task.least))
    return cells, coverage_diameters(cells, task.pinhole)


def traced_radii(task: RadiusProblem, progress: Progress = lambda _: None) -> tuple[Cells, Floats]:
    """Radii with which every mirror's exact coverage is the target, or more where nearly flat.

    Coverage grows about in proportion to curvature and hardly depends on the neighbours, so each
    curvature is scaled by target / coverage, all together, until none is off. Where a step goes
    so far that spheres no longer meet it is halved: flat mirrors always close.

    Raises:
        SpecError: names the mirrors for which no radius was found.
    """
    curvature, least = np.maximum(task.mirrors.curvature, task.least), task.least
    closed, triangles, covered = np.zeros(len(least)), task.triangles, np.zeros(len(least))
    error, halvings = np.full(len(least), np.inf), 0
    for _ in range(MAX_ITERATIONS):
        try:
            cells = task.cells(curvature, triangles)
        except NotRegularError:
            halvings += 1
            if halvings > MAX_HALVINGS:
                break
            curvature = (curvature + closed) / 2
            least = np.minimum(least, curvature)
            continue
        closed, triangles, covered = (
            curvature,
            cells.triangles,
            coverage_diameters(cells, task.pinhole),
        )
        error = np.where(curvature > least, np.abs(covered - task.target), 0.0)
        error = np.maximum(error, task.target - covered)
        if error.max() < CONVERGED_MM:
            return cells, covered
        progress(f"largest error of coverage {error.max():.1g} mm")
        curvature = np.maximum(curvature * task.target / covered, least)
    worst = np.argsort(-error)[:NAMED]
    raise SpecError(_not_made(worst, covered, task.target))


RULES = {"flat": flat_radii, "paper": paper_radii, "traced": traced_radii}


def solve_radii(
    rule: str, task: RadiusProblem, progress: Progress = lambda _: None
) -> tuple[Cells, Floats]:
    """Cells and coverage (m,) by a rule: "traced", "paper" or "flat".

    Raises:
        SpecError: when the mirrors do not close to an array, or none has the coverage wanted.
    """
    try:
        return traced_radii(task, progress) if rule == "traced" else RULES[rule](task)
    except NotRegularError as error:
        raise SpecError(
            f"mirrors with radius rule {rule} do not close to one array ({error}): "
            "change mirrors.radius_rule, optics.n or optics.capture_diameter_mm"
        ) from None


def _not_made(worst: Ints, covered: Floats, target: float) -> str:
    named = ", ".join(f"a{i + 1:04d} ({covered[i]:.3f} mm)" for i in worst)
    return (
        f"no radius gives these mirrors a coverage of {target:g} mm: {named}: change optics.n, "
        "optics.capture_diameter_mm or mirrors.margin_mm"
    )

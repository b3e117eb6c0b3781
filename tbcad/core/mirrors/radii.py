"""Radius rules: what curvature each mirror gets.

First flat mirrors, and the paper's paraxial radii that widen their field (section 3.2).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.pedestals.cells import pedestal_cells
from tbcad.core.optics.pedestals.plan import PedestalPlan, pedestal_plan
from tbcad.core.optics.power_diagram import NotRegularError
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.optics.windows import aimed, coverage_diameters, cut_positions, seam_gaps
from tbcad.core.spec.errors import SpecError
from tbcad.types import Floats, Ints, Progress

# A geodesic vertex has at most six neighbours; it and two rings of them bound every flat mirror.
NEIGHBOURS = 19
CONVERGED_MM = 1e-4  # 1e-2 would do; verification's figures are steadier with an exact design
MAX_ITERATIONS = 400
MAX_STALLED = 40  # of them in which the least error so far does not fall
# Designs that settle need none; each costs as much as a step, and further ones have never helped.
MAX_HALVINGS = 4
NAMED_MIRRORS = 5  # mirrors that an error names at most


def half_angles(ellipsoid: Ellipsoid, u: Floats, all_u: Floats) -> Floats:
    """Half angle theta_0 of each flat mirror's field of view, radians, (m,) (the paper's figure 3).

    It is that of the largest cone, at the virtual camera about its direction u to the origin, that
    fits in the mirror's polygon. The polygon is cut out by the tangent planes at all directions (k,
    3), u included; a plane that does not bound it never gives the smallest angle, so the nearest
    ones suffice.
    """
    near: Ints = np.asarray(cKDTree(all_u).query(u, k=min(NEIGHBOURS, len(all_u)))[1])
    apex, normal = ellipsoid.apices(all_u), ellipsoid.normals(all_u)
    camera = ellipsoid.camera_distance * u
    mirror, others = near[:, :1], near[:, 1:]
    # From the virtual camera's heights over two tangent planes follows the plane through it and
    # the edge that they share.
    height = dot(normal[mirror], camera[:, None] - apex[mirror])
    other_height = dot(normal[others], camera[:, None] - apex[others])
    plane = other_height[:, :, None] * normal[mirror] - height[:, :, None] * normal[others]
    sines: Floats = np.abs(dot(unit(plane), u[:, None])).min(axis=1)
    return np.arcsin(sines)


def half_widths(ellipsoid: Ellipsoid, u: Floats, theta0: Floats) -> Floats:
    """Half width l = (d - rho) tan(theta_0) of flat mirrors in directions u (m, 3), mm, (m,)."""
    return (ellipsoid.camera_distance - ellipsoid.radial_distance(u)) * np.tan(theta0)


def required_angles(
    ellipsoid: Ellipsoid, u: Floats, half_width: Floats, sphere_radius: float
) -> Floats:
    """Half angle theta_1 = atan((R - l) / rho) that sees the capture sphere, radians, (m,) (eq. 1).

    Directions u (m, 3), half widths l of flat mirrors (m,) and the sphere's radius R in mm.
    """
    return np.arctan2(sphere_radius - half_width, ellipsoid.radial_distance(u))


def paper_curvatures(theta0: Floats, theta1: Floats, half_width: Floats) -> Floats:
    """Curvatures 1 / r with r = l / sin((theta_1 - theta_0) / 2), 1/mm, (m,) (eq. 2).

    Zero or negative where the flat mirror already sees enough. The equation is paraxial: with
    these radii mirrors hit at an angle cover less than the capture sphere (rule traced).
    """
    return np.sin((theta1 - theta0) / 2) / half_width


@dataclass(frozen=True)
class RadiusProblem:
    """What a radius rule starts from: poses, bounding planes and a first dual triangulation."""

    mirrors: Surfaces  # curved by eq. 2, zero or less where flat is enough, (m,)
    planes: Surfaces  # the seam and the foot plane
    triangles: Ints  # dual triangulation, (t, 3)
    pinhole: Floats  # of the camera, mm, (3,)
    min_curvature: Floats  # smallest curvature a sphere may have, 1/mm, (m,)
    diameter: float  # of the capture sphere, mm
    margin: Floats  # that the rule traced adds to it for each mirror, mm, (m,)
    groove: float | None = None  # width between pedestals, mm; None: neighbouring spheres meet

    @property
    def target(self) -> Floats:
        """Coverage diameter that the rule traced gives each mirror, mm, (m,)."""
        return self.diameter + self.margin

    def cells(
        self, curvature: Floats, aim: Floats | None = None, triangles: Ints | None = None
    ) -> Cells:
        """Cells for curvatures (m,) and aims (m,), from the given triangulation or the first.

        NotRegularError if mirrors bound no proper cells, SpecError if grooves leave nothing of one.
        """
        mirrors = self.mirrors.with_curvature(curvature)
        mirrors = mirrors if aim is None else aimed(mirrors, self.pinhole, aim)
        start = self.triangles if triangles is None else triangles
        if self.groove is None:
            return cells_of(mirrors.joined(self.planes), start)
        try:
            return pedestal_cells(self.plan, mirrors)
        except NotRegularError as error:
            raise SpecError(f"{error}: make shell.groove_mm or optics.n smaller") from None

    @cached_property
    def plan(self) -> PedestalPlan:
        """Of pedestals, which depends neither on curvatures nor on aims."""
        surfaces = self.mirrors.joined(self.planes)
        return pedestal_plan(surfaces, self.triangles, self.pinhole, self.groove or 0.0)

    def coverage(self, cells: Cells) -> Floats:
        """Coverage diameter of each mirror's virtual camera, mm, (m,).

        That of a halved mirror falls short of the capture sphere by what neither half sees of it.
        """
        gap = seam_gaps(cells, self.pinhole, self.diameter / 2)
        coverage = coverage_diameters(cells, self.pinhole)
        return np.where(gap > 0, np.minimum(coverage, self.diameter - gap), coverage)

    def missing_aim(self, cells: Cells) -> Floats:
        """How much farther beyond the seam each halved mirror has to be aimed, mm, (m,).

        Both halves are to see as far beyond x = 0 as each other edge has for a margin.
        """
        position = cut_positions(cells, self.pinhole, self.target / 2)
        return np.where(cells.halved, position + self.margin / 2, 0.0)

    @property
    def paper_curvature(self) -> Floats:
        """Curvatures of eq. 2, but at least the smallest a sphere may have, 1/mm, (m,)."""
        return np.maximum(self.mirrors.curvature, self.min_curvature)


def solve_radii(
    rule: str, problem: RadiusProblem, progress: Progress = lambda _: None
) -> tuple[Cells, Floats]:
    """Cells of the mirrors with radii by a rule, and their coverage diameters (m,), mm.

    Rules are "traced" (exact rays), "paper" (eqs. 1 and 2 of the paper; nearly flat where those
    give no curvature or hardly any) or "flat" (planar mirrors, Mukaigawa et al.). SpecError if the
    mirrors do not close to one array, or rule traced finds no radii.
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
    return cells, problem.coverage(cells)


def _traced(problem: RadiusProblem, progress: Progress) -> tuple[Cells, Floats]:
    """Radii with which every mirror's exact coverage is the target, or more where nearly flat.

    Coverage grows about in proportion to curvature and hardly depends on the neighbours, so each
    curvature is scaled by target / coverage until none is off; halved mirrors are aimed farther
    beyond the seam by what they miss. A step with which spheres no longer meet is halved: flat
    mirrors close.
    """
    curvature, lowest = problem.paper_curvature, problem.min_curvature
    aim = np.zeros(len(curvature))
    closed, triangles = (np.zeros(len(curvature)), aim), problem.triangles
    coverage, error, halvings = np.zeros(len(curvature)), np.full(len(curvature), np.inf), 0
    least, stalled = np.inf, 0
    for _ in range(MAX_ITERATIONS):
        try:
            cells = problem.cells(curvature, aim, triangles)
        except NotRegularError:
            halvings += 1
            if halvings > MAX_HALVINGS:
                break
            curvature, aim = (curvature + closed[0]) / 2, (aim + closed[1]) / 2
            lowest = np.minimum(lowest, curvature)
            continue
        closed, triangles = (curvature, aim), cells.triangles
        coverage = coverage_diameters(cells, problem.pinhole)
        error = np.where(curvature > lowest, np.abs(coverage - problem.target), 0.0)
        error = np.maximum(error, problem.target - coverage)
        # A half that sees beyond the seam without being aimed stays as it is.
        step = np.maximum(problem.missing_aim(cells), -aim)
        error = np.maximum(error, np.abs(step))
        if error.max() < CONVERGED_MM:
            return cells, problem.coverage(cells)
        stalled = 0 if error.max() < least else stalled + 1
        least = min(least, error.max())
        if stalled > MAX_STALLED:
            break
        progress(f"largest error of coverage {error.max():.1g} mm")
        curvature = np.maximum(curvature * problem.target / coverage, lowest)
        aim = aim + step
    worst = np.argsort(-error)[:NAMED_MIRRORS]
    named = ", ".join(
        f"a{i + 1:04d} ({coverage[i]:.3f} of {problem.target[i]:g} mm)" for i in worst
    )
    # Borders of pedestals that vanish with some radii and not with others may never settle.
    groove = "" if problem.groove is None else "shell.groove_mm, "
    raise SpecError(
        f"no radius gives these mirrors the coverage that is wanted: {named}: change {groove}"
        "optics.n, optics.capture_diameter_mm or mirrors.margin_mm"
    )

"""The negative of a shell, on which it is electroformed: what closes it, as points and curves.

It fills the inside of the mirrors up to the joining planes x = 0 and z = foot, which the edges of
the deposit are cut flush with. Blind holes in both planes, of the sizes of the shell's flanges,
hold it, lead the current, and locate it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from tbcad.core.geometry.conics import Ellipsoid, Spheroid
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import perpendicular_axes, unit
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.design import FlangeSpec, ShellSpec
from tbcad.core.spec.errors import SpecError
from tbcad.shell.envelope import Holes, arc_around, arc_over_top, flange_holes
from tbcad.types import Floats

# Points on each arc: between two of them a normal turns by so little that draft changes by less
# than 0.01 degrees.
ARC_SAMPLES = 9
NO_DIRECTION = 1e-9  # below any length of the shortest average of unit vectors with a direction
PULL_DIGITS = 9
X, _, Z = np.eye(3)
DEPTH_DIAMETERS = 2.0  # of a blind hole: a thread in aluminium then holds as much as its screw
INSET_STEP_MM = 1.0
ROUND, ALONG = 24, 5  # places where the distance of a hole from the mirrors is looked at


@dataclass(frozen=True)
class Draft:
    """How a shell comes off its negative."""

    pull: Floats  # unit vector along which the shell is drawn, (3,)
    angle: float  # least angle between the negative's surface and the pull, rad; below 0 it catches


def draft_of(cells: Cells) -> Draft:
    """The pull with the largest draft; where walls catch whatever it is, the mirrors' best pull."""
    every = mirrors = _mirror_normals(cells)
    if isinstance(cells, PedestalCells):
        every = np.concatenate([mirrors, -cells.surfaces.normal[cells.mirrors + PLANES :]])
    pull = best_pull(every)
    if pull is None:
        pull = best_pull(mirrors)
    if pull is None:
        pull = unit(every.sum(axis=0))
    # Rounded so that the last bits of a search do not reach a file.
    pull = unit(np.round(pull, PULL_DIGITS) + 0.0)
    return Draft(pull, float(np.arcsin(np.clip((every @ pull).min(), -1, 1))))


def best_pull(normals: Floats) -> Floats | None:
    """Unit vector (3,) whose least product with unit normals (k, 3) is largest; None if below 0.

    The shortest x with n.x >= 1 for all normals points there. It is the solution of a least-squares
    problem without negative unknowns (Lawson and Hanson, Solving Least Squares Problems, chapter
    23, algorithm LDP).
    """
    table = np.vstack([normals.T, np.ones(len(normals))])
    target = np.array([0.0, 0.0, 0.0, 1.0])
    weights, length = nnls(table, target)
    if length < NO_DIRECTION:
        return None
    rest = table @ weights - target
    return unit(-rest[:3] / rest[3])


def _mirror_normals(cells: Cells) -> Floats:
    """The negative's outward normals along the mirrors' outlines, (k, 3).

    On a sphere the normal farthest from the pull is on the outline, but for cells that hold the
    sphere's point opposite to the pull, which no outline of theirs would let go either.
    """
    arcs = cells.arcs
    arc, t = np.broadcast_arrays(np.arange(len(arcs))[:, None], np.linspace(0, 1, ARC_SAMPLES))
    points = arcs.at(arc, t)
    normals = []
    for side in arcs.faces.T:
        mirror = np.flatnonzero(side < cells.mirrors)
        face = np.broadcast_to(side[mirror, None], (len(mirror), ARC_SAMPLES)).ravel()
        normals.append(-unit(cells.surfaces.gradient(face, points[mirror].reshape(-1, 3))))
    return np.concatenate(normals)


@dataclass(frozen=True)
class Mandrel:
    """What closes camera a's cells to a negative."""

    foot: float  # height of the foot plane, mm
    seam_holes: Holes  # blind holes along +x
    foot_holes: Holes  # blind holes along +z
    draft: Draft  # how the shell comes off


def mandrel_of(shell: ShellSpec, cells: Cells, ellipsoid: Ellipsoid) -> Mandrel:
    """Holes and draft of camera a's negative; SpecError if there is no room for holes."""
    foot = float(cells.surfaces.apex[cells.foot, 2])
    seam_holes, foot_holes = (
        _inset_holes(shell, cells, ellipsoid, foot, seam) for seam in (True, False)
    )
    return Mandrel(foot, seam_holes, foot_holes, draft_of(cells))


def _inset_holes(
    shell: ShellSpec, cells: Cells, ellipsoid: Ellipsoid, foot: float, seam: bool
) -> Holes:
    """Holes of seam or foot as near the mirrors as the wall allows."""
    for holes in _holes(shell, ellipsoid, foot, seam):
        if _clear(holes, cells.mirror_surfaces, shell):
            return holes
    size = 2 * max(_radius(shell.seam_flange), _radius(shell.foot_flange))
    raise SpecError(
        f"the mandrel has no room for blind holes of {size:g} mm with shell.wall_mm "
        f"{shell.wall_mm:g} round them: make bolt_hole_mm and dowel_hole_mm under "
        "shell.seam_flange and shell.foot_flange or shell.wall_mm smaller, or set shell.negative "
        "to false"
    )


def _holes(shell: ShellSpec, ellipsoid: Ellipsoid, foot: float, seam: bool) -> Iterator[Holes]:
    """Holes of seam or foot along ever smaller spheroids."""
    flange = shell.seam_flange if seam else shell.foot_flange
    rim = shell.wall_mm + _radius(flange)
    for inset in np.arange(rim, ellipsoid.semi_minor, INSET_STEP_MM).tolist():
        spheroid = Spheroid(ellipsoid, -inset)
        try:
            if seam:
                line = arc_over_top(spheroid, 0.0, foot + rim)
            else:
                line = arc_around(spheroid, _depth(shell.seam_flange) + rim, foot, foot)
            yield flange_holes(flange, line, _depth(flange) * (X if seam else Z), 0.0)
        except (ValueError, SpecError):  # the plane misses, or the line is too short
            return


def _radius(flange: FlangeSpec) -> float:
    return max(flange.bolt_hole_mm, flange.dowel_hole_mm if flange.dowels else 0.0) / 2


def _depth(flange: FlangeSpec) -> float:
    return DEPTH_DIAMETERS * 2 * _radius(flange)


def _clear(holes: Holes, mirrors: Surfaces, shell: ShellSpec) -> bool:
    """Whether a wall is left between all holes and all mirrors."""
    axes = perpendicular_axes(unit(holes.direction))
    circle = unit_circle(even_angles(ROUND)) @ axes
    along = np.linspace(0, 1, ALONG)[:, None] * holes.direction
    rims = holes.centre[:, None] + holes.radius[:, None, None] * circle
    points = (rims[:, :, None] + along).reshape(-1, 3)
    return bool(distances(mirrors, points).min() >= shell.wall_mm)


def distances(mirrors: Surfaces, points: Floats) -> Floats:
    """Distance of points (k, 3) on the light's side from their nearest mirror, mm, (k,)."""
    every = np.arange(len(mirrors))
    value = mirrors.value(every, points[:, None])
    root = np.sqrt(np.maximum(1 + 2 * mirrors.curvature * value, 0))
    return np.asarray((2 * value / (1 + root)).min(axis=1))

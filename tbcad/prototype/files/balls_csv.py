"""balls.csv: every ball, where it stands with the base at angle zero, and what it shows."""

import numpy as np

from tbcad.formats.csv_table import Cell, Row
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.types import Floats

COLUMNS = (
    *("number", "kind", "size", "diameter_mm", "grade", "standard", "mass_g"),
    *("radius_mm", "body_radius_mm", "polar_deg", "azimuth_deg"),
    *("px", "py", "pz", "nx", "ny", "nz", "cx", "cy", "cz", "bx", "by", "bz"),
    *("mirrors", "pixels", "pixels_shell", "coverage_mm", "coverage_fixed_mm", "error_deg"),
)


def rows(made: PrototypeLayout) -> list[Row]:
    """One record for each ball, in the order of COLUMNS, numbered from 1.

    p is the apex, n the inward normal there, c the centre of the reflecting sphere and b that of
    the sphere in the seat, mm, in the frame of the shell with the base at angle zero. Diameter is
    the body's. Coverages are the least of all mirrors that the ball stands in for, within cells
    moved along with the ball and within fixed ones; pixels are the sums. A cap has no grade, and
    no mass, which is its maker's.
    """
    served = np.bincount(made.fit.ball, minlength=len(made)).tolist()
    cells = zip(_pose(made).tolist(), served, _shown(made).tolist(), strict=True)
    return [
        dict(zip(COLUMNS, [*_names(made, j), *pose, count, *shown], strict=True))
        for j, (pose, count, shown) in enumerate(cells)
    ]


def _names(made: PrototypeLayout, j: int) -> list[Cell]:
    balls = made.balls
    diameter, size = 2 * float(balls.body_radius[j]), balls.size[j]
    if balls.cap[j]:
        return [j + 1, "cap", size, diameter, None, None, None]
    standard = balls.catalogue.balls[balls.stock[j]].standard
    return [j + 1, "ball", size, diameter, made.grade.grade, standard, float(balls.mass_g[j])]


def _pose(made: PrototypeLayout) -> Floats:
    """Radii, angles, apex, normal and both centres, (k, 16)."""
    balls = made.balls
    table: Floats = np.column_stack(
        [
            balls.radius,
            balls.body_radius,
            np.degrees(balls.poses.polar),
            np.degrees(made.placement.azimuth),
            made.apices(),
            made.normals(),
            made.centres(),
            made.body_centres(),
        ]
    )
    return table + 0.0  # no negative zeros


def _shown(made: PrototypeLayout) -> Floats:
    """Pixels kept and the shell's, least coverages, largest error of direction, (k, 5)."""
    fit, k = made.fit, len(made)
    error = np.zeros(k)
    np.maximum.at(error, fit.ball, np.degrees(made.stops.error))
    return np.column_stack(
        [
            np.bincount(fit.ball, fit.pixels, k),
            np.bincount(fit.ball, fit.pixels_shell, k),
            made.groups.minimum(fit.coverage),
            made.groups.minimum(fit.coverage_fixed),
            error,
        ]
    )

"""balls.csv: every ball, its place with the base at angle zero, and what it shows."""

import numpy as np

from tbcad.formats.csv_table import Cell, Row
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.records.tables import BallRow
from tbcad.types import Floats

COLUMNS = BallRow.columns()


def ball_rows(layout: PrototypeLayout) -> list[Row]:
    """One row for each ball, in the order of COLUMNS, numbered from 1.

    p is the apex, n the inward normal there, c the centre of the reflecting sphere and b that of
    the sphere in the seat, mm, in the frame of the shell with the base at angle zero. Diameter is
    the body's. A coverage is the minimum over all mirrors that the ball replaces, within cells that
    move with the ball and within fixed ones; pixels are sums over them. A cap has no grade and no
    mass: those depend on how it is made.
    """
    served = np.bincount(layout.fit.ball, minlength=len(layout)).tolist()
    cells = zip(_pose(layout).tolist(), served, _shown(layout).tolist(), strict=True)
    return [
        dict(zip(COLUMNS, [*_names(layout, j), *pose, count, *shown], strict=True))
        for j, (pose, count, shown) in enumerate(cells)
    ]


def _names(layout: PrototypeLayout, j: int) -> list[Cell]:
    balls = layout.balls
    diameter, size = 2 * float(balls.body_radius[j]), balls.size[j]
    if balls.cap[j]:
        return [j + 1, "cap", size, diameter, None, None, None]
    standard = balls.catalogue.balls[balls.stock[j]].standard
    return [j + 1, "ball", size, diameter, layout.grade.grade, standard, float(balls.mass_g[j])]


def _pose(layout: PrototypeLayout) -> Floats:
    """Radii, angles, apex, normal and both centres, (k, 16)."""
    balls = layout.balls
    table: Floats = np.column_stack(
        [
            balls.radius,
            balls.body_radius,
            np.degrees(balls.poses.polar),
            np.degrees(layout.placement.azimuth),
            layout.apices(),
            layout.normals(),
            layout.centres(),
            layout.body_centres(),
        ]
    )
    return table + 0.0  # no negative zeros


def _shown(layout: PrototypeLayout) -> Floats:
    """Pixels kept and the shell's, least coverages, largest error of direction, (k, 5)."""
    fit, k = layout.fit, len(layout)
    error = np.zeros(k)
    np.maximum.at(error, fit.ball, np.degrees(layout.stops.error))
    return np.column_stack(
        [
            np.bincount(fit.ball, fit.pixels, k),
            np.bincount(fit.ball, fit.pixels_shell, k),
            layout.groups.minimum(fit.coverage),
            layout.groups.minimum(fit.coverage_fixed),
            error,
        ]
    )

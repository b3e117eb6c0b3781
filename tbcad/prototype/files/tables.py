"""Tables for whoever assembles and runs the prototype.

balls.csv lists every ball, its place with the base at angle zero and what it shows,
rotation_plan.csv every picture, stops.csv every stop of the base, and plate_holes.csv where the
base plate is drilled and tapped.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from tbcad.cad.formats.checked_files import Cell, Row
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.drive.drive import DriveLoads
from tbcad.prototype.frame.stock import Stock
from tbcad.records.tables import BallRow, PictureRow, StopRow
from tbcad.types import Floats

BALL_COLUMNS, PICTURE_COLUMNS = BallRow.columns(), PictureRow.columns()
STOP_COLUMNS = StopRow.columns()
HOLE_COLUMNS = ("hole", "x_mm", "y_mm", "thread", "holds")
THREAD = "M5"


def ball_rows(layout: PrototypeLayout) -> list[Row]:
    """One row for each ball, in the order of BALL_COLUMNS, numbered from 1.

    p is the apex, n the inward normal there, c the centre of the reflecting sphere and b that of
    the sphere in the seat, mm, in the frame of the shell with the base at angle zero. b is as the
    base is made; weight brings it to its place by sag, on the mean over its pictures. Diameter is
    the body's. A coverage is the minimum over all mirrors that the ball replaces, within cells that
    move with the ball and within fixed ones; pixels are sums over them. A cap has no grade and no
    mass: those depend on how it is made.
    """
    served = np.bincount(layout.fit.ball, minlength=len(layout)).tolist()
    cells = enumerate(zip(_pose(layout).tolist(), served, _shown(layout).tolist(), strict=True))
    rows = ([*_names(layout, j), *pose, count, *shown] for j, (pose, count, shown) in cells)
    return _rows(BALL_COLUMNS, rows)


def _rows(columns: Iterable[str], cells: Iterable[Sequence[Cell]]) -> list[Row]:
    return [dict(zip(columns, row, strict=True)) for row in cells]


def _names(layout: PrototypeLayout, j: int) -> list[Cell]:
    balls = layout.balls
    diameter, size = 2 * float(balls.body_radius[j]), balls.size[j]
    if balls.cap[j]:
        return [j + 1, "cap", size, diameter, None, None, None]
    place = int(balls.stock[j])
    grade, standard = layout.bought_grade(place), balls.catalogue.balls[place].standard
    return [j + 1, "ball", size, diameter, grade, standard, float(balls.mass_g[j])]


def _pose(layout: PrototypeLayout) -> Floats:
    """Radii, angles, apex, normal, both centres and sag, (k, 19)."""
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
            layout.seated_centres(),
            np.broadcast_to(layout.sag, (len(layout), 3)),
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


def picture_rows(layout: PrototypeLayout) -> list[Row]:
    """One row for each mirror's picture, in order; stops and balls are numbered from 1.

    Camera a's mirrors come first, then camera b's with the object turned. The base goes through
    its stops twice, both times upward, so that play in the drive has no effect. One photograph
    shows all mirrors of a stop. Errors of azimuth and polar angle are the ball's less the mirror's.
    """
    stops, ball, stop = layout.stops, (layout.fit.ball + 1).tolist(), layout.stops.stop.tolist()
    errors = [stops.polar_error, stops.azimuth_error, stops.error]
    degrees = (np.degrees([stops.angle[stops.stop], *errors]) + 0.0).T.tolist()
    order = np.argsort(stops.stop, kind="stable").tolist()
    mirrors_b = [f"b{i + 1:04d}" for i in layout.twin.tolist()]
    cells = (
        (turn, stop[i] + 1, degrees[i][0], ball[i], ids[i], *degrees[i][1:])
        for turn, ids in ((0, layout.array.ids), (180, mirrors_b))
        for i in order
    )
    return _rows(PICTURE_COLUMNS, ((number, *row) for number, row in enumerate(cells, 1)))


def stop_rows(layout: PrototypeLayout, balance: BaseBalance, loads: DriveLoads) -> list[Row]:
    """One row for each stop: how many mirrors, which balls, the worst errors, gravity's effect.

    Worst errors are >= 0. Gravity's torque about the axis has the sign of the base angle, as has
    the wind-up: the angle by which the base is farther than the motor's steps say, because motor
    and belt yield, less that at angle zero, where it is homed. All hold for both turns of the
    object.
    """
    torque = balance.torque(np.append(layout.stops.angle, 0.0))
    wind_up = loads.wind_up_at(torque)
    beyond = np.degrees(wind_up[:-1] - wind_up[-1]) + 0.0
    gravity = zip(torque[:-1].tolist(), beyond.tolist(), strict=True)
    cells = ([*_stop_cells(layout, stop), *effect] for stop, effect in enumerate(gravity))
    return _rows(STOP_COLUMNS, cells)


def hole_rows(stock: Stock) -> list[Row]:
    """One row for each hole of the plate, numbered from 1.

    x runs along the plate, from the uprights to the camera, and y across it, both from the corner
    that is behind on the right when one looks from the uprights to the camera.
    """
    places = (stock.holes - stock.corner + 0.0).tolist()
    held = enumerate(zip(places, stock.holds, strict=True), 1)
    return _rows(HOLE_COLUMNS, ((number, x, y, THREAD, name) for number, ((x, y), name) in held))


def _stop_cells(layout: PrototypeLayout, stop: int) -> list[Cell]:
    stops, mirrors = layout.stops, layout.stops.mirrors(stop)
    balls = " ".join(str(ball + 1) for ball in np.unique(layout.fit.ball[mirrors]).tolist())
    worst = [np.abs(error[mirrors]).max() for error in (stops.azimuth_error, stops.error)]
    angle, *errors = (np.degrees([stops.angle[stop], *worst]) + 0.0).tolist()
    return [stop + 1, angle, len(mirrors), balls, *errors]

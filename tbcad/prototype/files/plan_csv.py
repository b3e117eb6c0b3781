"""rotation_plan.csv: every picture; stops.csv: the same for the hand at the machine, by stops."""

from pathlib import Path

import numpy as np

from tbcad.prototype.balls.layout import PlannedPicture, PrototypeLayout
from tbcad.prototype.files.balls_csv import Row, write_table

COLUMNS = (
    *("order", "object_turn_deg", "stop", "base_angle_deg", "ball", "mirror"),
    *("polar_error_deg", "azimuth_error_deg", "error_deg"),
)
STOP_COLUMNS = ("stop", "base_angle_deg", "mirrors", "balls", "azimuth_error_deg", "error_deg")


def rows(photographs: list[PlannedPicture]) -> list[Row]:
    """One record for each mirror's picture, in order; stops and balls are numbered from 1.

    One photograph shows all mirrors of a stop with the object as it is turned. Errors of azimuth
    and polar angle are the ball's less the mirror's.
    """
    return [_row(order, one) for order, one in enumerate(photographs, 1)]


def stop_rows(made: PrototypeLayout) -> list[Row]:
    """One record for each stop: how many mirrors, which balls, and the worst errors, all >= 0.

    They hold for both turns of the object.
    """
    return [_stop(made, stop) for stop in range(len(made.stops))]


def write_plan(path: Path, records: list[Row]) -> None:
    """Write rotation_plan.csv with full double precision."""
    write_table(path, COLUMNS, records)


def write_stops(path: Path, records: list[Row]) -> None:
    """Write stops.csv with full double precision."""
    write_table(path, STOP_COLUMNS, records)


def _row(order: int, one: PlannedPicture) -> Row:
    values = (
        *(order, round(float(np.degrees(one.object_angle))), one.stop + 1, _degrees(one.angle)),
        *(one.ball + 1, one.mirror),
        *(_degrees(one.polar_error), _degrees(one.azimuth_error), _degrees(one.error)),
    )
    return dict(zip(COLUMNS, values, strict=True))


def _stop(made: PrototypeLayout, stop: int) -> Row:
    stops, mirrors = made.stops, made.stops.mirrors(stop)
    balls = " ".join(str(ball + 1) for ball in np.unique(made.fit.ball[mirrors]).tolist())
    worst = [float(np.abs(error[mirrors]).max()) for error in (stops.azimuth_error, stops.error)]
    values = (stop + 1, _degrees(float(stops.angle[stop])), len(mirrors), balls)
    return dict(zip(STOP_COLUMNS, (*values, *map(_degrees, worst)), strict=True))


def _degrees(angle: float) -> float:
    return float(np.degrees(angle)) + 0.0

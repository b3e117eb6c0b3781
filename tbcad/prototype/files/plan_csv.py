"""Tables for whoever assembles and runs the prototype.

rotation_plan.csv lists every picture, stops.csv every stop of the base, and plate_holes.csv where
the base plate is drilled and tapped.
"""

import numpy as np

from tbcad.formats.csv_table import Row
from tbcad.prototype.balls.layout import PlannedPicture, PrototypeLayout
from tbcad.prototype.frame.layout import FrameLayout

PICTURE_COLUMNS = (
    *("order", "object_turn_deg", "stop", "base_angle_deg", "ball", "mirror"),
    *("polar_error_deg", "azimuth_error_deg", "error_deg"),
)
STOP_COLUMNS = ("stop", "base_angle_deg", "mirrors", "balls", "azimuth_error_deg", "error_deg")
HOLE_COLUMNS = ("hole", "x_mm", "y_mm", "thread", "holds")
THREAD = "M5"


def picture_rows(pictures: list[PlannedPicture]) -> list[Row]:
    """One row for each mirror's picture, in order; stops and balls are numbered from 1.

    One photograph shows all mirrors of a stop with the object as it is turned. Errors of azimuth
    and polar angle are the ball's less the mirror's.
    """
    return [_picture_row(order, picture) for order, picture in enumerate(pictures, 1)]


def stop_rows(layout: PrototypeLayout) -> list[Row]:
    """One row for each stop: how many mirrors, which balls, and the worst errors, all >= 0.

    They hold for both turns of the object.
    """
    return [_stop_row(layout, stop) for stop in range(len(layout.stops))]


def hole_rows(frame: FrameLayout) -> list[Row]:
    """One row for each hole of the plate, numbered from 1.

    x runs along the plate, from the uprights to the camera, and y across it, both from the corner
    that is behind on the right when one looks from the uprights to the camera.
    """
    places = (frame.holes - frame.corner + 0.0).tolist()
    return [
        dict(zip(HOLE_COLUMNS, (number, x, y, THREAD, name), strict=True))
        for number, ((x, y), name) in enumerate(zip(places, frame.holds, strict=True), 1)
    ]


def _picture_row(order: int, picture: PlannedPicture) -> Row:
    values = (
        *(
            order,
            round(float(np.degrees(picture.object_angle))),
            picture.stop + 1,
            _degrees(picture.angle),
        ),
        *(picture.ball + 1, picture.mirror),
        *(_degrees(picture.polar_error), _degrees(picture.azimuth_error), _degrees(picture.error)),
    )
    return dict(zip(PICTURE_COLUMNS, values, strict=True))


def _stop_row(layout: PrototypeLayout, stop: int) -> Row:
    stops, mirrors = layout.stops, layout.stops.mirrors(stop)
    balls = " ".join(str(ball + 1) for ball in np.unique(layout.fit.ball[mirrors]).tolist())
    worst = [float(np.abs(error[mirrors]).max()) for error in (stops.azimuth_error, stops.error)]
    values = (stop + 1, _degrees(float(stops.angle[stop])), len(mirrors), balls)
    return dict(zip(STOP_COLUMNS, (*values, *map(_degrees, worst)), strict=True))


def _degrees(angle: float) -> float:
    return float(np.degrees(angle)) + 0.0

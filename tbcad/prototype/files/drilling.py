"""plate_holes.csv: where the base plate is drilled and tapped."""

from pathlib import Path

from tbcad.prototype.files.balls_csv import Row, write_table
from tbcad.prototype.frame.layout import FrameLayout

COLUMNS = ("hole", "x_mm", "y_mm", "thread", "holds")
THREAD = "M5"


def rows(frame: FrameLayout) -> list[Row]:
    """One record for each hole, numbered from 1.

    x runs along the plate, from the uprights to the camera, and y across it, both from the corner
    that is behind on the right when one looks from the uprights to the camera.
    """
    places = (frame.holes - frame.corner + 0.0).tolist()
    return [
        dict(zip(COLUMNS, (number, x, y, THREAD, name), strict=True))
        for number, ((x, y), name) in enumerate(zip(places, frame.holds, strict=True), 1)
    ]


def write_drilling(path: Path, records: list[Row]) -> None:
    """Write plate_holes.csv with full double precision."""
    write_table(path, COLUMNS, records)

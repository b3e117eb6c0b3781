"""A prototype as the simulation meets it: its plan, and the files that it is read from."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tbcad.cad.formats.checked_files import write_table
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.mirrors.record import write_record
from tbcad.light.simulate.prototype.run import Plan
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.files import tables
from tbcad.records.tables import StopRow
from tests.prototype_records import write_prototype


def plan_of(made: PrototypeLayout) -> Plan:
    """The plan without the way through files."""
    ball, stop = made.fit.ball, made.stops.stop
    back = np.argsort(made.twin)
    return Plan(
        frame=made.array.ellipsoid.frame(),
        apex=made.apices(),
        normal=made.normals(),
        radius=made.balls.radius,
        body_centre=made.body_centres(),
        body_radius=made.balls.body_radius,
        moved=True,
        angle=made.stops.angle,
        ball=np.stack([ball, ball[back]]),
        stop=np.stack([stop, stop[back]]),
    )


def write_export(folder: Path, little: MirrorDesign, made: PrototypeLayout) -> Path:
    """What the simulation needs of an export with its prototype, by the export's own writers."""
    write_record(folder, little, shells=False)
    plan = tables.picture_rows(made)
    write_table(folder / "rotation_plan.csv", tables.PICTURE_COLUMNS, plan)
    write_table(folder / "balls.csv", tables.BALL_COLUMNS, tables.ball_rows(made))
    axis, zero, third = made.array.ellipsoid.frame().tolist()
    write_prototype(
        folder,
        picture=little.spec.prototype.picture,
        frame={"axis": axis, "zero": zero, "third": third},
        leds=[
            {"name": f"led_{number}", "position_mm": place, "direction": [0.0, 0.0, 1.0]}
            for number, place in enumerate(little.spec.prototype.stage.leds_mm, 1)
        ],
    )
    return folder


def write_wind_up(folder: Path, stops: int) -> None:
    """A base that gravity turns by another angle at each stop."""
    write_stops(folder, [0.0] * stops, [0.01 * stop for stop in range(stops)])


def write_stops(folder: Path, angles_deg: Sequence[float], wind_up_deg: Sequence[float]) -> None:
    """stops.csv, as far as it is read: of each stop its angle and how far gravity turns it."""
    columns = StopRow.columns()
    rows = [
        {**dict.fromkeys(columns, 0), "stop": number, "base_angle_deg": angle, "wind_up_deg": more}
        for number, (angle, more) in enumerate(zip(angles_deg, wind_up_deg, strict=True), 1)
    ]
    write_table(folder / "stops.csv", columns, rows)

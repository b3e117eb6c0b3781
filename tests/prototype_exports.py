"""A prototype as the simulation meets it: its plan, and the files that it is read from."""

import json
from pathlib import Path

import numpy as np

from tbcad.formats.csv_table import write_table
from tbcad.mirrors.array import MirrorDesign
from tbcad.mirrors.record import write_record
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.files import balls_csv, plan_csv
from tbcad.simulate.prototype.plan import Plan


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
    plan = plan_csv.picture_rows(made)
    write_table(folder / "rotation_plan.csv", plan_csv.PICTURE_COLUMNS, plan)
    write_table(folder / "balls.csv", balls_csv.COLUMNS, balls_csv.ball_rows(made))
    axis, zero, third = made.array.ellipsoid.frame().tolist()
    document = {
        "schema": "tbcad-prototype/2",
        "camera": "a",
        "picture": little.spec.prototype.picture,
        "frame": {"axis": axis, "zero": zero, "third": third},
        "balls": "balls.csv",
        "leds": [
            {"name": f"led_{number}", "position_mm": place, "direction": [0.0, 0.0, 1.0]}
            for number, place in enumerate(little.spec.prototype.stage.leds_mm, 1)
        ],
    }
    (folder / "prototype.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


def write_wind_up(folder: Path, stops: int) -> None:
    """A base that gravity turns by another angle at each stop."""
    rows = [{"stop": stop + 1, "wind_up_deg": 0.01 * stop} for stop in range(stops)]
    write_table(folder / "stops.csv", ("stop", "wind_up_deg"), rows)

"""How far gravity turns the base of an export at each stop: read from stops.csv."""

from typing import Annotated

import numpy as np
from pydantic import Field

from tbcad.errors import InputError
from tbcad.formats.checked_files import REBUILD, Record, read_csv
from tbcad.simulate.prototype.plan import MISSING, Plan
from tbcad.simulate.scene.exported import ExportedDesign
from tbcad.types import Floats

STOPS = "stops.csv"
MAX_DEG = 10.0  # far beyond what a build permits


class _Stop(Record):
    stop: int
    wind_up_deg: Annotated[float, Field(ge=-MAX_DEG, le=MAX_DEG)]


def read_wind_up(export: ExportedDesign, plan: Plan) -> Floats:
    """Angles (t,) by which the base is beyond those of the plan at its t stops, radians.

    Motor and belt yield to the base's weight: see tbcad.prototype.drive.loads.

    Raises:
        InputError: the file is missing, malformed, or of another plan.
    """
    path = export.folder / STOPS
    rows = read_csv(path, _Stop, MISSING)
    if [row.stop for row in rows] != list(range(1, len(plan.angle) + 1)):
        raise InputError(
            f"{path}: stops are not those of the plan, 1 to {len(plan.angle)}: {REBUILD}"
        )
    return np.radians([row.wind_up_deg for row in rows])

"""How far gravity turns the base of an export at each stop: read from stops.csv."""

import numpy as np

from tbcad.errors import InputError
from tbcad.formats.checked_files import REBUILD
from tbcad.records.tables import StopRow
from tbcad.simulate.prototype.plan import Plan
from tbcad.simulate.scene.exported import ExportedDesign
from tbcad.types import Floats


def read_wind_up(export: ExportedDesign, plan: Plan) -> Floats:
    """Angles (t,) by which the base is beyond those of the plan at its t stops, radians.

    Motor and belt yield to the base's weight: see tbcad.prototype.drive.loads.

    Raises:
        InputError: the file is missing, malformed, or of another plan.
    """
    path = export.folder / StopRow.FILE
    rows = StopRow.read(export.folder)
    if [row.stop for row in rows] != list(range(1, len(plan.angle) + 1)):
        raise InputError(
            f"{path}: stops are not those of the plan, 1 to {len(plan.angle)}: {REBUILD}"
        )
    return np.radians([row.wind_up_deg for row in rows])

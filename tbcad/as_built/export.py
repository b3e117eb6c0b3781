"""From a calibration and the export it is of to the files of the machine as built."""

from pathlib import Path
from typing import Any

from tbcad.as_built.deviations import deviations
from tbcad.as_built.files import write_as_built
from tbcad.errors import InputError
from tbcad.machine.record import RECORD, read_machine
from tbcad.simulate.prototype.plan import read_plan
from tbcad.simulate.scene.exported import read_export


def as_built(calibration: Path, exports: Path, folder: Path) -> dict[str, Any]:
    """Write the files of a machine as built, and return their record.

    Args:
        calibration: folder with machine.json.
        exports: that was calibrated.
        folder: exists, and is the caller's to replace.

    Raises:
        InputError: one cannot be read, or they do not belong together.
    """
    machine, _ = read_machine(calibration / RECORD)
    plan = read_plan(read_export(exports))
    if len(machine.radius) != len(plan):
        raise InputError(
            f"{calibration} has {len(machine.radius)} balls, {exports} has {len(plan)}: name the "
            "export that was calibrated with --exports"
        )
    facts = {"calibration": str(calibration), "exports": str(exports), "balls": len(plan)}
    return write_as_built(folder, machine, plan, deviations(machine, plan), facts)

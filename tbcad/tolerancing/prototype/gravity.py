"""Effect of gravity on a prototype at its stops, as its build worked it out."""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.gravity.compliance import best_motions
from tbcad.prototype.gravity.sag import read_sag
from tbcad.records.tables import BallRow, SagRow, StopRow
from tbcad.types import Floats


@dataclass(frozen=True)
class Gravity:
    """Turn of the base, and displacements of its k bodies with their seats' turns, at t stops."""

    wind_up: Floats  # by which the base is beyond the plan's angles, radians, (t,)
    # displacements of bodies in the base's frame at angle zero: as the carrier bends, and as what
    # holds its hub does, mm, (2, t, k, 3)
    sag: Floats
    # small rotations of the seats, which caps follow, radians, (2, t, k, 3)
    turn: Floats
    # on the mean over each ball's pictures: seats are made so much beside the places of their
    # balls, mm, (k, 3)
    mean: Floats

    def sagged(self, share: Floats) -> Floats:
        """Displacements with shares (..., 2) of both, mm, (..., t, k, 3)."""
        return np.tensordot(share, self.sag, axes=(-1, 0))

    def turned(self, share: Floats) -> Floats:
        """Rotations with shares (..., 2) of both, radians, (..., t, k, 3)."""
        return np.tensordot(share, self.turn, axes=(-1, 0))


def weightless(plan: Plan) -> Gravity:
    """Without gravity, and with seats where the balls are to be."""
    stops, balls = len(plan.angle), len(plan)
    none = np.zeros((2, stops, balls, 3))
    return Gravity(np.zeros(stops), none, none, np.zeros((balls, 3)))


def read_gravity(export: ExportedDesign, plan: Plan) -> Gravity:
    """Effect of gravity at the stops of a plan; displacements are zero where none are known.

    Motor and belt yield to the base's weight: see tbcad.prototype.drive.drive; carrier and frame
    bend: see tbcad.prototype.gravity. InputError if a file is missing, malformed, or of another
    plan, or seats are placed against weight that no file tells.
    """
    path, none = export.folder / StopRow.FILE, weightless(plan)
    rows = StopRow.read(export.folder)
    if [row.stop for row in rows] != list(range(1, len(plan.angle) + 1)):
        raise InputError(
            f"{path}: stops are not those of the plan, 1 to {len(plan.angle)}: {REBUILD}"
        )
    wind_up = np.radians([row.wind_up_deg for row in rows])
    found = read_sag(export.folder)
    if found is None and np.any(plan.sag):
        raise InputError(
            f"{export.folder / SagRow.FILE} is not there, and the seats of {BallRow.FILE} are "
            f"placed against weight: {REBUILD}"
        )
    if found is None:
        return replace(none, wind_up=wind_up)
    carrier = found.of["carrier"]
    sag = np.stack([carrier, found.whole - carrier]) @ found.axes
    as_one = best_motions(plan.body_centre, sag[1])[:, None, 3:]
    turn = np.stack([found.seat_turn @ found.axes, np.broadcast_to(as_one, carrier.shape)])
    return Gravity(wind_up, sag, turn, plan.sag)

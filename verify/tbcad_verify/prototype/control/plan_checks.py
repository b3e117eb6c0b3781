"""The rotation plan: every mirror has its picture, by a ball and a stop that there are."""

from __future__ import annotations

from collections import Counter

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_checks import program_check
from tbcad_verify.record.prototype import PLAN, PROGRAM, STOPS
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    guarded_each,
    short_list,
)
from tbcad_verify.types import Ints

SAME_DIRECTION = 1e-9
TURNS = (0.0, 180.0)
CHECKS = (
    ("plan mirrors", PLAN, "missing, doubled or foreign"),
    ("plan twins", PLAN, "mirrors"),
    ("plan stops", STOPS, "faults"),
    ("plan program", PROGRAM, "faults"),
)


def checks(context: PrototypeContext) -> list[Check]:
    """Compare plan, stops and program with the mirrors, the balls and each other."""
    return guarded_each(CHECKS, (_mirrors, _twins, _stops, program_check), context)


def _mirrors(name: CheckName, context: PrototypeContext) -> Check:
    """Each of this camera's mirrors once with the object at 0 degrees, all others once at 180.

    Rows are numbered, and name balls that exist.
    """
    plan, rows = context.prototype.plan, context.export.mirrors
    faults: list[str] = []
    for turn in TURNS:
        of_camera = (rows.camera == context.prototype.camera) == (turn == 0)
        expected = [rows.ids[k] for k in np.flatnonzero(of_camera).tolist()]
        count = Counter(plan.mirror[k] for k in np.flatnonzero(plan.turn == turn).tolist())
        faults += [name for name in expected if count[name] != 1]
        faults += sorted(set(count) - set(expected))
    faults += [
        f"row {k + 1} at another object angle" for k in np.flatnonzero(~np.isin(plan.turn, TURNS))
    ]
    foreign = (plan.ball < 1) | (plan.ball > len(context.prototype.balls))
    faults += [f"row {k + 1} of no ball" for k in np.flatnonzero(foreign).tolist()]
    unordered = np.flatnonzero(plan.order != np.arange(1, len(plan) + 1))
    faults += [f"row {k + 1} out of order" for k in unordered.tolist()]
    return at_most(name, len(faults), 0, short_list(faults))


def twins(context: PrototypeContext) -> Ints:
    """(m,) row of mirrors.csv of the mirror that each one shows with the object at 180 degrees.

    Rotated by 180 degrees about z, direction (x, y, z) becomes (-x, -y, z).

    Raises:
        Unknown: there is no mirror in that direction.
    """
    rows = context.export.mirrors
    u = rows.columns("ux", 3)
    others = np.flatnonzero(rows.camera != context.prototype.camera)
    if not others.size:
        raise Unknown("there is no other camera")
    rotated = u[:, context.mirror_rows] * np.array([[-1.0], [-1.0], [1.0]])
    distance, nearest = map(np.asarray, cKDTree(u[:, others].T).query(rotated.T))
    if not distance.max() <= SAME_DIRECTION:
        missing = context.mirror_ids[int(distance.argmax())]
        raise Unknown(f"no mirror of the other camera is {missing} rotated by 180 degrees")
    return np.asarray(others[nearest])


def _twins(name: CheckName, context: PrototypeContext) -> Check:
    """With the object at 180 degrees, each mirror uses the ball and stop of its twin."""
    plan, rows = context.prototype.plan, context.export.mirrors
    at_180 = {plan.mirror[k]: k for k in np.flatnonzero(plan.turn == TURNS[1]).tolist()}
    ids = [rows.ids[k] for k in twins(context).tolist()]
    row = np.array([at_180.get(name, -1) for name in ids])
    first = context.plan_rows
    same = (
        (row >= 0) & (plan.ball[row] == plan.ball[first]) & (plan.angle[row] == plan.angle[first])
    )
    same &= plan.stop[row] == plan.stop[first]
    faults = [ids[k] for k in np.flatnonzero(~same).tolist()]
    return at_most(
        name, len(faults), 0, f"another ball or stop than their images: {short_list(faults)}"
    )


def _stops(name: CheckName, context: PrototypeContext) -> Check:
    """Numbered, ascending, within the swing, and as the plan has them."""
    stops, plan = context.prototype.stops, context.prototype.plan
    low, high = context.prototype.swing
    faults = []
    if not (stops.stop == np.arange(1, len(stops) + 1)).all():
        faults.append("not numbered from 1")
    if not (np.diff(stops.angle) > 0).all():
        faults.append("angles do not ascend")
    beyond = np.flatnonzero((stops.angle < low) | (stops.angle > high))
    faults += [f"stop {k + 1} beyond the swing" for k in beyond.tolist()]
    known = (plan.stop >= 1) & (plan.stop <= len(stops))
    at = stops.angle[np.where(known, plan.stop, 1) - 1]
    unlike = np.flatnonzero(~known | (at != plan.angle))
    faults += [f"row {k + 1} of the plan at another angle" for k in unlike.tolist()]
    unused = sorted({*range(1, len(stops) + 1)} - {*plan.stop.tolist()})
    faults += [f"stop {number} is not in the plan" for number in unused]
    return at_most(name, len(faults), 0, short_list(faults))

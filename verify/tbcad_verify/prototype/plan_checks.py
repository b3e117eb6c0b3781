"""The plan of rotation: every mirror has its picture, at the angle and with the error it says."""

from __future__ import annotations

from collections import Counter

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.prototype import axis, gcode
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import PLAN, PROGRAM, STOPS
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    guarded,
    short_list,
    worst_offenders,
)
from tbcad_verify.types import Floats, Ints

ERROR_DEG = 1e-6
PROGRAM_DEG = 1.0001e-4  # the digits of the program
SAME_DIRECTION = 1e-9
TURNS = (0.0, 180.0)
CHECKS = (
    ("plan mirrors", PLAN, "missing, doubled or foreign"),
    ("plan twins", PLAN, "mirrors"),
    ("plan errors", PLAN, "deg off"),
    ("plan stops", STOPS, "faults"),
    ("plan program", PROGRAM, "faults"),
)


def checks(context: PrototypeContext) -> list[Check]:
    """Hold plan, stops and program against the mirrors, the balls and each other."""
    work = (_mirrors, _twins, _errors, _stops, _program)
    return [
        check
        for name, job in zip(CHECKS, work, strict=True)
        for check in guarded([name], lambda name=name, job=job: [job(name, context)])  # type: ignore[misc]
    ]


def _mirrors(name: CheckName, context: PrototypeContext) -> Check:
    """Each of this camera's mirrors once with the object straight, all others once with it turned.

    Rows are numbered, and name balls that there are.
    """
    plan, rows = context.prototype.plan, context.export.mirrors
    odd: list[str] = []
    for turn in TURNS:
        own = (rows.camera == context.prototype.camera) == (turn == 0)
        wanted = [rows.ids[k] for k in np.flatnonzero(own).tolist()]
        given = Counter(plan.mirror[k] for k in np.flatnonzero(plan.turn == turn).tolist())
        odd += [one for one in wanted if given[one] != 1]
        odd += sorted(set(given) - set(wanted))
    odd += [f"row {k + 1} turned oddly" for k in np.flatnonzero(~np.isin(plan.turn, TURNS))]
    foreign = (plan.ball < 1) | (plan.ball > len(context.prototype.balls))
    odd += [f"row {k + 1} of no ball" for k in np.flatnonzero(foreign).tolist()]
    unordered = np.flatnonzero(plan.order != np.arange(1, len(plan) + 1))
    odd += [f"row {k + 1} out of order" for k in unordered.tolist()]
    served = np.bincount(np.clip(context.ball, 0, None), minlength=len(context.prototype.balls))
    unlike = np.flatnonzero(served != context.prototype.balls.mirrors)
    odd += [f"ball {k + 1} serves {served[k]}" for k in unlike.tolist()]
    return at_most(name, len(odd), 0, short_list(odd))


def twins(context: PrototypeContext) -> Ints:
    """(m,) row of mirrors.csv of the mirror that each one shows when the object is turned.

    Turned by 180 degrees about z, direction (x, y, z) becomes (-x, -y, z).

    Raises:
        Unknown: there is no mirror in that direction.
    """
    rows = context.export.mirrors
    u = rows.columns("ux", 3)
    others = np.flatnonzero(rows.camera != context.prototype.camera)
    if not others.size:
        raise Unknown("there is no other camera")
    wanted = u[:, context.mine] * np.array([[-1.0], [-1.0], [1.0]])
    away, near = map(np.asarray, cKDTree(u[:, others].T).query(wanted.T))
    if not away.max() <= SAME_DIRECTION:
        lost = rows.ids[int(context.mine[int(away.argmax())])]
        raise Unknown(f"no mirror of the other camera is {lost} turned by 180 degrees")
    return np.asarray(others[near])


def _twins(name: CheckName, context: PrototypeContext) -> Check:
    """The turned half goes by the same ball and stop as the mirrors it is the image of."""
    plan, rows = context.prototype.plan, context.export.mirrors
    turned = {plan.mirror[k]: k for k in np.flatnonzero(plan.turn == TURNS[1]).tolist()}
    ids = [rows.ids[k] for k in twins(context).tolist()]
    row = np.array([turned.get(one, -1) for one in ids])
    first = context.pictures
    same = (
        (row >= 0) & (plan.ball[row] == plan.ball[first]) & (plan.angle[row] == plan.angle[first])
    )
    same &= (plan.stop[row] == plan.stop[first]) & (plan.errors[row] == plan.errors[first]).all(1)
    odd = [ids[k] for k in np.flatnonzero(~same).tolist()]
    return at_most(
        name, len(odd), 0, f"another ball, stop or error than their images: {short_list(odd)}"
    )


def errors(context: PrototypeContext) -> Floats:
    """(m, 3) polar angle, azimuth and direction of each ball at its stop less the mirror's, rad."""
    u = context.export.mirrors.columns("ux", 3)[:, context.mine]
    apex = context.prototype.balls.columns("px", 3)[:, context.ball]
    at = axis.turned(apex, context.frame[0][:, None], context.angle)
    (mirror, phi), (ball, psi) = axis.angles(context.frame, u), axis.angles(context.frame, at)
    return np.stack([ball - mirror, axis.wrapped(psi - phi), axis.between(at, u)], axis=1)


def _errors(name: CheckName, context: PrototypeContext) -> Check:
    away = np.abs(
        np.degrees(errors(context)) - context.prototype.plan.errors[context.pictures]
    ).max(axis=1)
    worst = np.argsort(-away, kind="stable")
    worst = worst[~(away[worst] <= ERROR_DEG)]
    ids = [context.export.mirrors.ids[k] for k in context.mine.tolist()]
    detail = "recorded otherwise than poses make them: " + worst_offenders(
        ids, away, "deg", worst, ".3g"
    )
    return at_most(name, float(away.max()), ERROR_DEG, detail)


def _stops(name: CheckName, context: PrototypeContext) -> Check:
    """Numbered, ascending, within the swing, and what the plan makes of them."""
    stops, plan = context.prototype.stops, context.prototype.plan
    low, high = context.prototype.swing
    odd = []
    if not (stops.stop == np.arange(1, len(stops) + 1)).all():
        odd.append("not numbered from 1")
    if not (np.diff(stops.angle) > 0).all():
        odd.append("angles do not ascend")
    beyond = np.flatnonzero((stops.angle < low) | (stops.angle > high))
    odd += [f"stop {k + 1} beyond the swing" for k in beyond.tolist()]
    known = (plan.stop >= 1) & (plan.stop <= len(stops))
    at = stops.angle[np.where(known, plan.stop, 1) - 1]
    unlike = np.flatnonzero(~known | (at != plan.angle))
    odd += [f"row {k + 1} of the plan at another angle" for k in unlike.tolist()]
    straight = (plan.turn == 0) & known
    for k in range(len(stops)):
        here = np.flatnonzero(straight & (plan.stop == k + 1))
        odd += [] if _as_said(context, k, here) else [f"stop {k + 1} is not as the plan has it"]
    return at_most(name, len(odd), 0, short_list(odd))


def _as_said(context: PrototypeContext, k: int, rows: Ints) -> bool:
    """Whether a stop's count, balls and worst errors are those of its rows of the plan."""
    stops, plan = context.prototype.stops, context.prototype.plan
    if rows.size != stops.mirrors[k]:
        return False
    if sorted(set(plan.ball[rows].tolist())) != sorted(stops.balls[k]):
        return False
    worst = np.abs(plan.errors[rows][:, 1:]).max(axis=0, initial=0)
    return bool(np.abs(worst - stops.errors[k]).max() <= ERROR_DEG)


def _program(name: CheckName, context: PrototypeContext) -> Check:
    """Photographs at every stop, in order, twice, and nothing driven beyond the swing."""
    found, wanted = gcode.run(context.prototype.program), np.tile(context.prototype.stops.angle, 2)
    odd = list(found.faults)
    if found.photographs.shape != wanted.shape:
        odd.append(f"{found.photographs.size} photographs, not {wanted.size}")
    else:
        off = np.flatnonzero(~(np.abs(found.photographs - wanted) <= PROGRAM_DEG))
        odd += [f"photograph {k + 1} at {found.photographs[k]:.4f} deg" for k in off.tolist()]
    low, high = context.prototype.swing
    beyond = (found.moves < low - PROGRAM_DEG) | (found.moves > high + PROGRAM_DEG)
    odd += [f"{found.moves[k]:.4f} deg is beyond the swing" for k in np.flatnonzero(beyond)]
    return at_most(name, len(odd), 0, short_list(odd))

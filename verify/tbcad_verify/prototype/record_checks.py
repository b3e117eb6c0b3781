"""Balls on the ellipsoid, and the rotation plan: every mirror has its picture, by ball and stop."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.mesh.vectors import dot, norm, polar_and_azimuth, unit, wrapped
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.gcode_checks import program_check
from tbcad_verify.record.poses import POSE_MM
from tbcad_verify.record.prototype import BALLS, PLAN, PROGRAM, STOPS
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    each_at_most,
    guarded_each,
    no_faults,
)
from tbcad_verify.types import Ints

DENSITIES_G_MM3 = 1.5e-3, 20e-3  # of anything that balls are made of
SAME_DIRECTION = 1e-9
TURNS = (0.0, 180.0)
CHECKS = (
    ("ball positions", BALLS, "mm off"),
    ("ball sizes", BALLS, "balls"),
    ("plan mirrors", PLAN, "missing, doubled or foreign"),
    ("plan twins", PLAN, "mirrors"),
    ("plan stops", STOPS, "faults"),
    ("plan program", PROGRAM, "faults"),
)


def checks(context: PrototypeContext) -> list[Check]:
    """Balls against the design; plan, stops and program against mirrors, balls and each other."""
    jobs = map(_counted, (_size_faults, _mirror_faults, _twin_faults, _stop_faults))
    return guarded_each(CHECKS, (_positions, *jobs, program_check), context)


def _counted(faults: Callable[[PrototypeContext], Iterator[str]]) -> Callable[..., Check]:
    return lambda name, context: no_faults(name, faults(context))


def _positions(name: CheckName, context: PrototypeContext) -> Check:
    """Largest deviation of each ball from the design, mm; angles as lengths at 1 mm.

    The apex lies on the ellipsoid, at the recorded polar angle and azimuth; the normal is a unit
    vector and bisects the directions to both foci; the reflecting sphere's centre lies on it, one
    radius behind the apex, and so does that of the body.
    """
    balls, pinhole = context.prototype.balls, context.pinhole[:, None]
    p, n, c, b = (balls.columns(key, 3) for key in ("px", "nx", "cx", "bx"))
    double_a = 2 * np.sqrt(context.export.semi_minor_mm**2 + (context.pinhole**2).sum() / 4)
    polar, azimuth = polar_and_azimuth(context.frame, p)
    errors = np.max(
        [
            np.abs(norm(p) + norm(pinhole - p) - double_a),
            np.abs(polar - np.radians(balls.polar_deg)),
            np.abs(wrapped(azimuth - np.radians(balls.azimuth_deg))),
            norm(unit(unit(pinhole - p) - unit(p)) - n),
            norm(c - (p - balls.radius_mm * n)),
            norm(b - (p - dot(p - b, n) * n)),
        ],
        axis=0,
    )
    reason = "off the ellipsoid, not at its angles, not bisecting, or a centre off the normal: "
    names = balls.names(np.arange(errors.size))
    return each_at_most(name, names, errors, POSE_MM, "mm", reason)


def _size_faults(context: PrototypeContext) -> Iterator[str]:
    """A ball reflects with all of its diameter; a cap's front is flatter than its body.

    A ball has the mass of a solid, a cap has none of its own.
    """
    balls = context.prototype.balls
    radius, body, half = balls.radius_mm, balls.body_radius_mm, balls.diameter_mm / 2
    p, c, b = (balls.columns(key, 3) for key in ("px", "cx", "bx"))
    good = np.abs(body - half) <= POSE_MM
    density, (least, most) = balls.mass_g / (np.pi / 6 * balls.diameter_mm**3), DENSITIES_G_MM3
    ball = (np.abs(radius - half) <= POSE_MM) & (norm(b - c) <= POSE_MM)
    ball &= (density >= least) & (density <= most)
    depth = dot(p - b, balls.columns("nx", 3))
    cap = (body <= radius) & (depth > 0) & (depth <= body + POSE_MM) & np.isnan(balls.mass_g)
    bad = np.flatnonzero(~(good & np.where(balls.cap, cap, ball)))
    yield from (f"{name} has not its diameter, or no mass of it" for name in balls.names(bad))


def _mirror_faults(context: PrototypeContext) -> Iterator[str]:
    """Each of this camera's mirrors once with the object at 0 degrees, all others once at 180.

    Rows are numbered, and name balls that exist.
    """
    plan, rows = context.prototype.plan, context.export.mirrors
    for turn in TURNS:
        of_camera = (rows.camera == context.prototype.camera) == (turn == 0)
        expected = [rows.ids[k] for k in np.flatnonzero(of_camera).tolist()]
        count = Counter(plan.mirror[k] for k in np.flatnonzero(plan.turn == turn).tolist())
        yield from (name for name in expected if count[name] != 1)
        yield from sorted(set(count) - set(expected))
    rows_that_are = {
        "at another object angle": ~np.isin(plan.turn, TURNS),
        "of no ball": (plan.ball < 1) | (plan.ball > len(context.prototype.balls)),
        "out of order": plan.order != np.arange(1, len(plan) + 1),
    }
    for what, bad in rows_that_are.items():
        yield from (f"row {k + 1} {what}" for k in np.flatnonzero(bad).tolist())


def twins(context: PrototypeContext) -> Ints:
    """(m,) row of mirrors.csv of the mirror that each one shows with the object at 180 degrees.

    Rotated by 180 degrees about z, direction (x, y, z) becomes (-x, -y, z).

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


def _twin_faults(context: PrototypeContext) -> Iterator[str]:
    """With the object at 180 degrees, each mirror uses the ball and stop of its twin."""
    plan, rows, first = context.prototype.plan, context.export.mirrors, context.plan_rows
    at_180 = {plan.mirror[k]: k for k in np.flatnonzero(plan.turn == TURNS[1]).tolist()}
    ids = [rows.ids[k] for k in twins(context).tolist()]
    row = np.array([at_180.get(name, -1) for name in ids])
    same = row >= 0
    for column in (plan.ball, plan.angle, plan.stop):
        same &= column[row] == column[first]
    yield from (f"{ids[k]} by another ball or stop" for k in np.flatnonzero(~same).tolist())


def _stop_faults(context: PrototypeContext) -> Iterator[str]:
    """Stops are numbered, ascending, within the swing, and as the plan has them."""
    stops, plan = context.prototype.stops, context.prototype.plan
    low, high = context.prototype.swing
    if not (stops.stop == np.arange(1, len(stops) + 1)).all():
        yield "not numbered from 1"
    if not (np.diff(stops.angle) > 0).all():
        yield "angles do not ascend"
    beyond = np.flatnonzero((stops.angle < low) | (stops.angle > high))
    yield from (f"stop {k + 1} beyond the swing" for k in beyond.tolist())
    known = (plan.stop >= 1) & (plan.stop <= len(stops))
    unlike = np.flatnonzero(~known | (stops.angle[np.where(known, plan.stop, 1) - 1] != plan.angle))
    yield from (f"row {k + 1} of the plan at another angle" for k in unlike.tolist())
    unused = sorted({*range(1, len(stops) + 1)} - {*plan.stop.tolist()})
    yield from (f"stop {number} is not in the plan" for number in unused)

"""Balls on the ellipsoid, and the rotation plan: every mirror has its picture, by ball and stop."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.mesh.vectors import dot, norm, polar_and_azimuth, unit, wrapped
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control.program_checks import program_faults
from tbcad_verify.record.poses import POSE_MM
from tbcad_verify.record.prototype import BALLS, PLAN, PROGRAM
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    each_at_most,
    guarded_each,
    no_faults,
)

DENSITIES_G_MM3 = 1.5e-3, 20e-3  # of anything that balls are made of
SAME_DIRECTION = 1e-9
CHECKS = (
    ("ball positions", BALLS, "mm off"),
    ("ball sizes", BALLS, "balls"),
    ("plan", PLAN, "faults"),
    ("plan program", PROGRAM, "faults"),
)

Faults = Callable[[PrototypeContext], Iterator[str]]


def checks(context: PrototypeContext) -> list[Check]:
    """Balls against the design; plan, stops and program against mirrors, balls and each other."""

    def counting(faults: Faults) -> Callable[[CheckName], Check]:
        return lambda name: no_faults(name, faults(context))

    counted = map(counting, (_size_faults, _plan_faults, program_faults))
    return guarded_each(CHECKS, (lambda name: _positions(name, context), *counted))


def _positions(name: CheckName, context: PrototypeContext) -> Check:
    """Largest deviation of each ball from the design, mm; angles as lengths at 1 mm.

    The apex lies on the ellipsoid, at the recorded polar angle and azimuth; the normal is a unit
    vector and bisects the directions to both foci; the reflecting sphere's centre lies on it, one
    radius behind the apex, and so does that of the body, once weight has brought it there.
    """
    balls, pinhole = context.prototype.balls, context.pinhole[:, None]
    p, n, c, b = (balls.columns(key, 3) for key in ("px", "nx", "cx", "bx"))
    b = b + balls.sag
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
    b = b + balls.sag
    good = np.abs(body - half) <= POSE_MM
    density, (least, most) = balls.mass_g / (np.pi / 6 * balls.diameter_mm**3), DENSITIES_G_MM3
    ball = (np.abs(radius - half) <= POSE_MM) & (norm(b - c) <= POSE_MM)
    ball &= (density >= least) & (density <= most)
    depth = dot(p - b, balls.columns("nx", 3))
    cap = (body <= radius) & (depth > 0) & (depth <= body + POSE_MM) & np.isnan(balls.mass_g)
    bad = np.flatnonzero(~(good & np.where(balls.cap, cap, ball)))
    yield from (f"{name}: wrong diameter or mass" for name in balls.names(bad))


def twins(context: PrototypeContext) -> list[str]:
    """Ids of the m mirrors that are shown with the object at 180 degrees as each is at 0.

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
    return [rows.ids[k] for k in others[nearest].tolist()]


def _plan_faults(context: PrototypeContext) -> Iterator[str]:
    """Pictures that are missing, doubled or foreign, or not by ball and stop of their twin's.

    Each of this camera's mirrors has one with the object at 0 degrees, each of the others' one at
    180; stops are those of the table, which ascend within the swing.
    """
    plan, stops = context.prototype.plan, context.prototype.stops
    low, high = context.prototype.swing
    angles = dict(enumerate(stops.angle.tolist(), 1))
    if stops.stop.tolist() != list(angles) or not (np.diff(stops.angle) > 0).all():
        yield "stops are not numbered from 1, or their angles do not ascend"
    yield from (f"stop {k} beyond the swing" for k, one in angles.items() if not low <= one <= high)
    yield from (f"stop {k} is not in the plan" for k in sorted({*angles} - {*plan.stop.tolist()}))
    columns = (plan.turn, plan.mirror, plan.ball, plan.stop, plan.angle)
    rows = list(zip(*(np.asarray(one).tolist() for one in columns), strict=True))
    shown = {(turn, mirror): tuple(how) for turn, mirror, *how in rows}
    pairs = list(zip(context.mirror_ids, twins(context), strict=True))
    expected = {key for one, two in pairs for key in ((0.0, one), (180.0, two))}
    count = Counter((turn, mirror) for turn, mirror, *_ in rows)
    for turn, mirror in sorted(expected | set(count)):
        if count[turn, mirror] != 1 or (turn, mirror) not in expected:
            yield f"{mirror} is shown {count[turn, mirror]} times with the object at {turn:g} deg"
    for one, two in pairs:
        if shown.get((0.0, one)) != shown.get((180.0, two)):
            yield f"{two} by another ball or stop than {one}"
    for k, (_, _, ball, stop, angle) in enumerate(rows, 1):
        if plan.order[k - 1] != k or not 1 <= ball <= len(context.prototype.balls):
            yield f"row {k} is out of order, or of no ball"
        if angles.get(stop) != angle:
            yield f"row {k} is at another angle than its stop"

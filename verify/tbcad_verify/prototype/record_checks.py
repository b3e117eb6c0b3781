"""The record of a prototype checked by itself: frame, seats, and balls on the ellipsoid."""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.vectors import dot, norm, polar_and_azimuth, unit, wrapped
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.poses import POSE_MM
from tbcad_verify.record.prototype import BALLS, RECORD
from tbcad_verify.record.prototype_sections import Balls
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_most,
    each_at_most,
    guarded_each,
    short_list,
)
from tbcad_verify.types import Bools, Floats

PAD_UM = 10.0  # largest error of a ball's centre that its pads may cause
DENSITIES_G_MM3 = 1.5e-3, 20e-3  # of anything that balls are made of
TOLERANCE = 1e-9  # mm, radians, and of unit vectors
CHECKS = (
    ("prototype requirements", RECORD, "unlike the design"),
    ("ball positions", BALLS, "mm off"),
    ("ball sizes", BALLS, "balls"),
)


def checks(context: PrototypeContext) -> list[Check]:
    """The frame is the camera's, and every ball is where it must be."""
    return guarded_each(CHECKS, (_requirements, _positions, _sizes), context)


def _requirements(name: CheckName, context: PrototypeContext) -> Check:
    """Target and frame, against the design that the export carries."""
    prototype, export = context.prototype, context.export
    errors = {
        "target_mm": abs(prototype.target_mm - export.target_mm),
        "frame": float(np.abs(prototype.frame.rows - context.frame).max()),
        "seats": _off_unit(np.array([seat.axis for seat in prototype.seats])),
        "pads": _off_unit(np.array([seat.normals for seat in prototype.seats])),
    }
    errors["picture"] = float(export.spec.prototype.picture != prototype.picture)
    wrong = sorted(what for what, error in errors.items() if not error <= TOLERANCE)
    return at_most(name, len(wrong), 0, f"not as designed: {short_list(wrong)}")


def _off_unit(vectors: Floats) -> float:
    return float(np.abs(np.linalg.norm(vectors, axis=-1) - 1).max())


def _positions(name: CheckName, context: PrototypeContext) -> Check:
    errors = position_errors(context)
    names = context.prototype.balls.names(np.arange(errors.size))
    reason = "off the ellipsoid, not at its angles, not bisecting, or a centre off the normal: "
    return each_at_most(name, names, errors, POSE_MM, "mm", reason)


def position_errors(context: PrototypeContext) -> Floats:
    """(K,) largest deviation of each ball from the design, mm; angles as lengths at 1 mm.

    The apex lies on the ellipsoid, at the recorded polar angle and azimuth; the normal is a unit
    vector and bisects the directions to both foci; the reflecting sphere's centre lies on it, one
    radius behind the apex, and so does that of the body.
    """
    balls, pinhole = context.prototype.balls, context.pinhole[:, None]
    p, n, c, b = (balls.columns(key, 3) for key in ("px", "nx", "cx", "bx"))
    double_a = 2 * np.sqrt(context.export.semi_minor_mm**2 + (context.pinhole**2).sum() / 4)
    polar, azimuth = polar_and_azimuth(context.frame, p)
    depth = dot(p - b, n)
    worst = np.max(
        [
            np.abs(norm(p) + norm(pinhole - p) - double_a),
            np.abs(polar - np.radians(balls.polar_deg)),
            np.abs(wrapped(azimuth - np.radians(balls.azimuth_deg))),
            norm(unit(unit(pinhole - p) - unit(p)) - n),
            norm(c - (p - balls.radius_mm * n)),
            norm(b - (p - depth * n)),
        ],
        axis=0,
    )
    return np.asarray(worst)


def _sizes(name: CheckName, context: PrototypeContext) -> Check:
    balls = context.prototype.balls
    bad = np.flatnonzero(~_has_its_size(balls))
    return at_most(
        name, bad.size, 0, f"no ball, or no cap, of its diameter: {short_list(balls.names(bad))}"
    )


def _has_its_size(balls: Balls) -> Bools:
    """(K,) a ball reflects with all of its diameter; a cap's front is flatter than its body.

    A ball has the mass of a solid, a cap has none of its own.
    """
    radius, body, half = balls.radius_mm, balls.body_radius_mm, balls.diameter_mm / 2
    p, c, b = (balls.columns(key, 3) for key in ("px", "cx", "bx"))
    ball = (np.abs(radius - half) <= POSE_MM) & (np.abs(body - half) <= POSE_MM)
    ball &= norm(b - c) <= POSE_MM
    density, (least, most) = balls.mass_g / (np.pi / 6 * balls.diameter_mm**3), DENSITIES_G_MM3
    ball &= (density >= least) & (density <= most)
    depth = dot(p - b, balls.columns("nx", 3))
    cap = (np.abs(body - half) <= POSE_MM) & (body <= radius)
    cap &= (depth > 0) & (depth <= body + POSE_MM) & np.isnan(balls.mass_g)
    return np.where(balls.cap, cap, ball)

"""The record of a prototype checked by itself: frame, seats, and balls on the ellipsoid."""

from __future__ import annotations

import re

import numpy as np

from tbcad_verify.mesh.lines import polar_and_azimuth, wrapped
from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.poses import POSE_MM
from tbcad_verify.record.prototype import BALLS, RECORD
from tbcad_verify.record.prototype_tables import Balls
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
CATALOGUES = {"metric", "inch"}  # whose labels are sizes, and whose balls are of steel
INCH_MM = 25.4
LABEL_MM = 0.0501  # a cap's radius has one decimal in its label
STEEL_G_MM3, MASS_SHARE = 7.81e-3, 1e-2
ERROR_DEG = 1e-6
TOLERANCE = 1e-9  # mm, radians, and of unit vectors
CHECKS = (
    ("prototype requirements", RECORD, "unlike the design"),
    ("ball positions", BALLS, "mm off"),
    ("ball sizes", BALLS, "balls"),
    ("ball labels", BALLS, "faults"),
)


def checks(context: PrototypeContext) -> list[Check]:
    """The frame is the camera's, and every ball is where it must be."""
    return guarded_each(CHECKS, (_requirements, _positions, _sizes, _labels), context)


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
    errors["target_pad_um"] = float(prototype.pad_um > PAD_UM)
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


def _labels(name: CheckName, context: PrototypeContext) -> Check:
    """Labels, grades, masses and errors of direction, as sizes, spec and plan have them."""
    balls, spec = context.prototype.balls, context.export.spec.prototype
    built_in = set(spec.catalogues) <= CATALOGUES
    faults = []
    for k, (label, diameter) in enumerate(zip(balls.size, balls.diameter_mm, strict=True)):
        cap, radius = bool(balls.cap[k]), float(balls.radius_mm[k])
        known = radius if cap else diameter
        size = labelled_mm(str(label), cap)
        if (size is None and (built_in or cap)) or abs((size or known) - known) > (
            LABEL_MM if cap else POSE_MM
        ):
            faults.append(f"ball {k + 1} is no {label}")
        if str(balls.grade[k]) != ("" if cap else spec.grade):
            faults.append(f"ball {k + 1} has grade {balls.grade[k]}")
        steel = STEEL_G_MM3 * np.pi / 6 * diameter**3
        if cap != bool(np.isnan(balls.mass_g[k])):
            faults.append(f"ball {k + 1}: a ball has a mass, a cap has none")
        elif not cap and built_in and abs(balls.mass_g[k] - steel) > MASS_SHARE * steel:
            faults.append(f"ball {k + 1} is not {balls.mass_g[k]:g} g")
    largest = np.zeros(len(balls))
    np.maximum.at(largest, context.ball, context.prototype.plan.error[context.plan_rows])
    unlike = np.flatnonzero(~(np.abs(largest - balls.error_deg) <= ERROR_DEG))
    faults += [f"ball {k + 1} is {largest[k]:.3f} deg off" for k in unlike.tolist()]
    return at_most(name, len(faults), 0, short_list(faults))


def labelled_mm(label: str, cap: bool) -> float | None:
    """The diameter of a ball, or a cap's radius, that a label names; None if it names none."""
    if cap:
        label_parts = re.fullmatch(r"cap R ([\d.]+) mm", label)
        return float(label_parts[1]) if label_parts else None
    if label_parts := re.fullmatch(r"([\d.]+) mm", label):
        return float(label_parts[1])
    if label_parts := re.fullmatch(r"(?:(\d+) )?(?:(\d+)/(\d+))? ?in", label):
        whole, share, parts = (float(one or 0) for one in label_parts.groups())
        return INCH_MM * (whole + (share / parts if parts else 0))
    return None


def _has_its_size(balls: Balls) -> Bools:
    """(K,) a ball reflects with all of its diameter; a cap's front is flatter than its body."""
    radius, body, half = balls.radius_mm, balls.body_radius_mm, balls.diameter_mm / 2
    p, c, b = (balls.columns(key, 3) for key in ("px", "cx", "bx"))
    ball = (np.abs(radius - half) <= POSE_MM) & (np.abs(body - half) <= POSE_MM)
    ball &= norm(b - c) <= POSE_MM
    depth = dot(p - b, balls.columns("nx", 3))
    cap = (np.abs(body - half) <= POSE_MM) & (body <= radius)
    cap &= (depth > 0) & (depth <= body + POSE_MM)
    return np.where(balls.cap, cap, ball)

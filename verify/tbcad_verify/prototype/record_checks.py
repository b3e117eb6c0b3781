"""The record of a prototype against itself: tables, frame, and balls on the ellipsoid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.prototype import axis
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.poses import POSE_MM
from tbcad_verify.record.prototype_record import BALL_COLUMNS, BALLS, RECORD, Balls
from tbcad_verify.record.prototype_tables import number_in
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_most,
    guarded,
    short_list,
    worst_offenders,
)
from tbcad_verify.types import Floats

ANGLE = 1e-9  # radians, and of unit vectors
CHECKS = (
    ("prototype record", BALLS, "cells unlike prototype.json"),
    ("prototype requirements", RECORD, "unlike the design"),
    ("ball places", RECORD, "mm off"),
    ("ball sizes", RECORD, "balls"),
)


def checks(context: PrototypeContext) -> list[Check]:
    """Tables agree, the frame is the camera's, and every ball stands where it must."""
    work = (_agree, _asked, _places, _sizes)
    return [
        check
        for name, job in zip(CHECKS, work, strict=True)
        for check in guarded([name], lambda name=name, job=job: [job(name, context)])  # type: ignore[misc]
    ]


def _agree(name: CheckName, context: PrototypeContext) -> Check:
    balls, rows = context.prototype.balls, context.prototype.ball_rows
    if len(rows) != len(balls):
        return at_most(name, abs(len(rows) - len(balls)) * len(BALL_COLUMNS), 0, "rows are missing")
    odd = [
        f"ball {k + 1} {key}"
        for k, (row, item) in enumerate(zip(rows, balls.rows, strict=True))
        for key, cell in zip(BALL_COLUMNS, row, strict=True)
        if not _same(cell, item.get(key))
    ]
    return at_most(name, len(odd), 0, f"differ: {short_list(odd)}")


def _same(cell: str, value: object) -> bool:
    """Whether a field of the table is a value of the record, bit for bit."""
    if value is None or isinstance(value, str):
        return cell == (value or "")
    return number_in(cell) == value


def _asked(name: CheckName, context: PrototypeContext) -> Check:
    """Target and frame, against the design that the export carries."""
    prototype, export = context.prototype, context.export
    wanted = {
        "target_mm": abs(prototype.target_mm - export.target_mm),
        "frame": float(np.abs(prototype.frame - context.frame).max()),
        "seats": float(np.abs(np.linalg.norm(prototype.seats.axis, axis=-1) - 1).max()),
        "pads": float(np.abs(np.linalg.norm(prototype.seats.normals, axis=-1) - 1).max()),
    }
    spec = export.spec.get("prototype")
    if isinstance(spec, dict) and "picture" in spec:
        wanted["picture"] = float((spec["picture"] == "moved") != prototype.moved)
    odd = sorted(what for what, away in wanted.items() if not away <= ANGLE)
    return at_most(name, len(odd), 0, f"not as designed: {short_list(odd)}")


def _places(name: CheckName, context: PrototypeContext) -> Check:
    errors = position_errors(context)
    worst = np.argsort(-errors, kind="stable")
    worst = worst[~(errors[worst] <= POSE_MM)]
    return at_most(
        name,
        float(errors.max()),
        POSE_MM,
        "off the ellipsoid, not at its angles, not bisecting, or a centre off the normal: "
        + worst_offenders(
            context.prototype.balls.names(np.arange(errors.size)), errors, "mm", worst, ".3g"
        ),
    )


def position_errors(context: PrototypeContext) -> Floats:
    """(K,) largest deviation of each ball from the design, mm; angles as lengths at 1 mm.

    Checked: the apex lies on the ellipsoid, at the recorded polar angle and azimuth; the normal
    is unit and bisects the ways to both foci; the reflecting sphere's centre lies one radius
    behind the apex on it, and that of the body on it too.
    """
    balls, pinhole = context.prototype.balls, context.pinhole[:, None]
    p, n, c, b = (balls.columns(key, 3) for key in ("px", "nx", "cx", "bx"))
    double_a = 2 * np.sqrt(context.semi_minor**2 + (context.pinhole**2).sum() / 4)
    polar, azimuth = axis.angles(context.frame, p)
    depth = dot(p - b, n)
    worst = np.max(
        [
            np.abs(norm(p) + norm(pinhole - p) - double_a),
            np.abs(polar - np.radians(balls.of("polar_deg"))),
            np.abs(axis.wrapped(azimuth - np.radians(balls.of("azimuth_deg")))),
            norm(unit(unit(pinhole - p) - unit(p)) - n),
            norm(c - (p - balls.of("radius_mm") * n)),
            norm(b - (p - depth * n)),
        ],
        axis=0,
    )
    return np.asarray(worst)


def _sizes(name: CheckName, context: PrototypeContext) -> Check:
    balls = context.prototype.balls
    bad = np.flatnonzero(~_sized(balls))
    return at_most(name, bad.size, 0, f"no ball, or no cap, of its diameter: {listed_of(bad)}")


def _sized(balls: Balls) -> NDArray[np.bool_]:
    """(K,) a ball reflects with all of its diameter; a cap's front is flatter than its body."""
    radius, body, half = (balls.of(k) for k in ("radius_mm", "body_radius_mm", "diameter_mm"))
    half = half / 2
    p, c, b = (balls.columns(key, 3) for key in ("px", "cx", "bx"))
    ball = (np.abs(radius - half) <= POSE_MM) & (np.abs(body - half) <= POSE_MM)
    ball &= norm(b - c) <= POSE_MM
    depth = dot(p - b, balls.columns("nx", 3))
    cap = (np.abs(body - half) <= POSE_MM) & (body <= radius)
    cap &= (depth > 0) & (depth <= body + POSE_MM)
    return np.where(balls.cap, cap, ball)


def listed_of(which: NDArray[np.intp]) -> str:
    """Some balls by number, from 1."""
    return short_list([f"ball {k + 1}" for k in which.tolist()])

"""Caps as their meshes have them: the front that reflects, and the body that lies on the pads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.segments import rounding
from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart
from tbcad_verify.report.checks import Check, Unknown, at_most
from tbcad_verify.types import Floats

# Facets may be a sphere's if their corners are this near to the recorded one, and face outward.
NEAR_MM = (0.1, 0.03, 0.01, 0.003)
MOST_OF = 90  # percent of the vertices, whose form counts
FACING = 0.9
STEPS = 8
LEAST = 8  # vertices
CENTRE_UM = 5.0
CHECKS = {"cap fronts": "um", "cap bodies": "um", "cap form": "um"}


@dataclass(frozen=True)
class FittedSphere:
    """A sphere through vertices.

    Attributes:
        centre: (3,) mm.
        radius: mm.
        form: distance from it that most vertices keep, mm.
        blur: how far float32 can have moved the centre, six standard deviations, mm.
    """

    centre: Floats
    radius: float
    form: float
    blur: float


@dataclass(frozen=True)
class MeasuredCap:
    """Front and body of the cap of one ball, from 0."""

    ball: int
    front: FittedSphere
    body: FittedSphere


def measure_cap(context: PrototypeContext, body: MeasuredPart) -> MeasuredCap:
    """Fit both spheres of a cap.

    Raises:
        Unknown: there is no such surface, or no mesh.
    """
    balls, k = context.prototype.balls, body.part.ball
    centre, middle = balls.columns("cx", 3)[:, k], balls.columns("bx", 3)[:, k]
    front = fit_sphere(body.placed_mesh, centre, float(balls.radius_mm[k]))
    return MeasuredCap(
        k, front, fit_sphere(body.placed_mesh, middle, float(balls.body_radius_mm[k]))
    )


def fit_sphere(mesh: Mesh, centre: Floats, radius: float) -> FittedSphere:
    """The sphere through the vertices of facets that lie near one.

    Facets beyond the rim, where both surfaces run close together, drop out round after round.

    Raises:
        Unknown: fewer than `LEAST` vertices lie there.
    """
    guess, first, points = np.append(centre, radius), np.zeros((3, 0)), np.zeros((3, 0))
    inverse = np.zeros((4, 4))
    for near in NEAR_MM:
        points = _near(mesh, guess, near)
        if points.shape[1] < LEAST:
            raise Unknown(f"no sphere of radius {radius:.3f} mm where the record has one")
        first = first if first.size else points
        guess, inverse = _fitted(points, guess)
    off = np.abs(norm(first - guess[:3, None]) - guess[3])
    blur = 6 * rounding(mesh) / np.sqrt(3) * float(np.sqrt(np.trace(inverse)))
    return FittedSphere(guess[:3], float(guess[3]), float(np.percentile(off, MOST_OF)), blur)


def _near(mesh: Mesh, guess: Floats, near: float) -> Floats:
    """(3, P) vertices of facets that lie near a sphere and face as it does."""
    away = np.linalg.norm(mesh.points - guess[:3], axis=1) - guess[3]
    facets = (np.abs(away) < near)[mesh.faces].all(axis=1)
    out = mesh.points[mesh.faces].mean(axis=1).T - guess[:3, None]
    facets &= dot(unit(out), unit(mesh.area)) > FACING
    return np.asarray(mesh.points[np.unique(mesh.faces[facets])].T)


def _fitted(points: Floats, guess: Floats) -> tuple[Floats, Floats]:
    """Centre and radius by Gauss and Newton, and the inverse of the normal equations."""
    matrix = np.eye(4)
    for _ in range(STEPS):
        toward = points - guess[:3, None]
        length = norm(toward)
        slope = np.vstack([toward / length, np.ones(length.size)])
        matrix = np.einsum("in,jn->ij", slope, slope)
        guess = guess + np.linalg.solve(matrix, np.einsum("in,n->i", slope, length - guess[3]))
    return guess, np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def checks(context: PrototypeContext, caps: list[MeasuredCap], files: str) -> list[Check]:
    """Fronts and bodies against the record."""
    front, body, form = ((name, files, unit_) for name, unit_ in CHECKS.items())
    balls = context.prototype.balls
    return [
        _held(
            front,
            [(one.ball, one.front) for one in caps],
            balls.columns("cx", 3),
            balls.radius_mm,
        ),
        _held(
            body,
            [(one.ball, one.body) for one in caps],
            balls.columns("bx", 3),
            balls.body_radius_mm,
        ),
        at_most(
            form,
            1000 * max(max(one.front.form, one.body.form) for one in caps),
            1.0,
            "vertices do not lie on a sphere",
        ),
    ]


def _held(
    name: tuple[str, str, str],
    found: list[tuple[int, FittedSphere]],
    centre: Floats,
    radius: Floats,
) -> Check:
    """Centre and radius errors less what float32 leaves in doubt."""
    errors = [
        1000
        * max(float(np.linalg.norm(one.centre - centre[:, k])), abs(one.radius - float(radius[k])))
        for k, one in found
    ]
    over = [
        max(error - 1000 * one.blur, 0.0) for error, (_, one) in zip(errors, found, strict=True)
    ]
    worst = int(np.argmax(over))
    detail = f"ball {found[worst][0] + 1}: centre or radius {errors[worst]:.3g} um off"
    return at_most(name, over[worst], CENTRE_UM, detail)

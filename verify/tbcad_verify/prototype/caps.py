"""Caps as their meshes have them: the front that reflects, and the body that lies on the pads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.segments import rounding
from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart
from tbcad_verify.record.prototype import Balls
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most
from tbcad_verify.types import Floats

# Facets may be a sphere's if their corners are this near to it and they face outward. Each round
# starts from the fit of the one before.
NEAR_MM = (0.1, 0.03, 0.01, 0.003)
FORM_PERCENTILE = 90  # of the vertices' distances
FACING_COS = 0.9
NEWTON_STEPS = 8
MIN_VERTICES = 8
CENTRE_UM = 5.0
FORM_UM = 1.0
FILE = ("cap",)
CHECKS = {"cap fronts": "um", "cap bodies": "um", "cap form": "um"}


@dataclass(frozen=True)
class FittedSphere:
    """A sphere through vertices."""

    centre: Floats  # (3,) mm
    radius: float  # mm
    form: float  # distance from it that most vertices keep, mm
    blur: float  # how far float32 can have moved the centre, six standard deviations, mm


@dataclass(frozen=True)
class MeasuredCap:
    """Front and body of the cap of one ball, from 0."""

    ball: int
    front: FittedSphere
    body: FittedSphere


def measure_cap(context: PrototypeContext, part: MeasuredPart) -> MeasuredCap:
    """Fit both spheres of a cap. Unknown: there is no such surface, or no mesh."""
    balls, k, mesh = context.prototype.balls, part.part.ball, part.placed_mesh
    front, body = (
        fit_sphere(mesh, centre[:, k], float(radius[k])) for centre, radius in _recorded(balls)
    )
    return MeasuredCap(k, front, body)


def _recorded(balls: Balls) -> tuple[tuple[Floats, Floats], ...]:
    """Centres (3, K) and radii (K,) of fronts and of bodies in the seats, without weight, mm."""
    front = balls.columns("cx", 3) - balls.sag, balls.radius_mm
    return front, (balls.columns("bx", 3), balls.body_radius_mm)


def fit_sphere(mesh: Mesh, centre: Floats, radius: float) -> FittedSphere:
    """The sphere through the vertices of facets that lie near one.

    Facets beyond the rim, where both surfaces run close together, drop out round after round.

    Unknown: fewer than `MIN_VERTICES` vertices lie there.
    """
    sphere, inverse = np.append(centre, radius), np.zeros((4, 4))
    candidates: list[Floats] = []
    for near in NEAR_MM:
        candidates.append(_vertices_near(mesh, sphere, near))
        if candidates[-1].shape[1] < MIN_VERTICES:
            raise Unknown(f"no sphere of radius {radius:.3f} mm where the record has one")
        sphere, inverse = _least_squares(candidates[-1], sphere)
    off = np.abs(norm(candidates[0] - sphere[:3, None]) - sphere[3])
    blur = 6 * rounding(mesh) / np.sqrt(3) * float(np.sqrt(np.trace(inverse)))
    form = float(np.percentile(off, FORM_PERCENTILE))
    return FittedSphere(sphere[:3], float(sphere[3]), form, blur)


def _vertices_near(mesh: Mesh, sphere: Floats, near: float) -> Floats:
    """(3, P) vertices of facets that lie near a sphere and face as it does."""
    height = np.linalg.norm(mesh.points - sphere[:3], axis=1) - sphere[3]
    facets = (np.abs(height) < near)[mesh.faces].all(axis=1)
    out = mesh.points[mesh.faces].mean(axis=1).T - sphere[:3, None]
    facets &= dot(unit(out), unit(mesh.area)) > FACING_COS
    return np.asarray(mesh.points[np.unique(mesh.faces[facets])].T)


def _least_squares(points: Floats, sphere: Floats) -> tuple[Floats, Floats]:
    """Centre and radius by Gauss-Newton steps, and the inverse of the normal equations."""
    matrix = np.eye(4)
    for _ in range(NEWTON_STEPS):
        spoke = points - sphere[:3, None]
        length = norm(spoke)
        slope = np.vstack([spoke / length, np.ones(length.size)])
        matrix = np.einsum("in,jn->ij", slope, slope)
        residual = np.einsum("in,n->i", slope, length - sphere[3])
        sphere = sphere + np.linalg.solve(matrix, residual)
    return sphere, np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def checks(
    names: list[CheckName], context: PrototypeContext, caps: list[MeasuredCap]
) -> list[Check]:
    """Fronts and bodies against the record: errors less the uncertainty of float32; their form."""
    if not caps:
        return []
    balls, made = context.prototype.balls, []
    spheres = [[cap.front for cap in caps], [cap.body for cap in caps]]
    which = [cap.ball for cap in caps]
    for name, fits, (place, radius) in zip(names, spheres, _recorded(balls), strict=False):
        centre = np.array([fit.centre for fit in fits]).T - place[:, which]
        size = np.array([fit.radius for fit in fits]) - radius[which]
        errors = 1000 * np.maximum(norm(centre), np.abs(size))
        over = np.maximum(errors - 1000 * np.array([fit.blur for fit in fits]), 0)
        k = int(over.argmax())
        detail = f"ball {which[k] + 1}: centre or radius {errors[k]:.3g} um off"
        made.append(at_most(name, float(over[k]), CENTRE_UM, detail))
    worst = 1000 * max(sphere.form for fits in spheres for sphere in fits)
    return [*made, at_most(names[2], worst, FORM_UM, "vertices do not lie on a sphere")]

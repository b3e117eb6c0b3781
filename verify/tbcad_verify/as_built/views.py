"""Views by each mirror's ball, where the calibration found camera, base and balls."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.as_built.forms import Fronts
from tbcad_verify.as_built.machine import AsBuilt
from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.surfaces import (
    PreparedSurfaces,
    ReflectedRays,
    Surfaces,
    prepare_for_rays,
    reflect,
)
from tbcad_verify.mesh.vectors import nearest_on_lines, norm, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.light.ball_views import ended_on_balls, outline_coverage
from tbcad_verify.prototype.light.pinhole_cells import MirrorSpheres, cell_outlines
from tbcad_verify.prototype.light.windows import highlights, rotated, sights, window_rotations
from tbcad_verify.record.poses import ON_SEAM
from tbcad_verify.types import Bools, Floats, Ints

HALF_TURN = np.array([[-1.0], [-1.0], [1.0]])
"""Turns points by 180 degrees about z, as the object is turned for the second run."""


@dataclass(frozen=True)
class Half:
    """The m mirrors of one camera of the shell, in the frame of the prototype."""

    ids: tuple[str, ...]  # of the mirrors
    shell: MirrorSpheres  # their spheres, turned into those of the prototype's camera where need be
    ball: Ints  # (m,) that substitutes for each, from 0
    frame: Ints  # (m,) of the machine, in which it does; -1 where that stop was not measured
    designed: Floats  # (3, m) apices of the balls there, by the plan


@dataclass(frozen=True)
class HalfViews:
    """Views of m mirrors."""

    coverage: Floats  # (m,) mm; NaN where the stop was not measured
    margin: Floats  # (m,) least distance of the window from the picture's edge, pixels
    clearance: Floats  # (m,) least distance of the way to the ball from the capture sphere, mm


@dataclass(frozen=True)
class RealTransfer:
    """Takes directions of the shell's picture to rays after the real balls."""

    matrix: Floats  # (3, 3, m) from the shell's picture to the real camera's sight
    mirrors: PreparedSurfaces  # a ball for each mirror
    fronts: Fronts  # of the same balls

    def reflected(self, mirror: Ints, d: Floats) -> tuple[Floats, ReflectedRays]:
        """Directions (3, N) of mirrors' cells as they meet the balls, and their reflections."""
        turned = rotated(self.matrix[:, :, mirror], d)
        return turned, self.rays(mirror, turned)

    def rays(self, mirror: Ints, turned: Floats) -> ReflectedRays:
        """Rays (3, N) of the real camera after the balls of mirrors (N,)."""
        spheres = reflect(self.mirrors, mirror, turned)
        return self.fronts.rays(self.mirrors.origin, mirror, turned, spheres)


def halves(context: PrototypeContext, machine: AsBuilt) -> list[Half]:
    """Both runs: that for the prototype's camera, and that for the other, the object turned.

    BadExport: another number of balls, or the plan leaves a mirror out.
    """
    if len(machine.balls) != len(context.prototype.balls):
        raise BadExport(
            f"machine.json has {len(machine.balls)} balls, the build "
            f"{len(context.prototype.balls)}; name the build that was calibrated"
        )
    mine = context.prototype.camera
    others = [name for name in context.export.cameras if name != mine]
    return [_half(context, machine, mine, 0), *(_half(context, machine, x, 180) for x in others)]


def half_views(
    context: PrototypeContext, machine: AsBuilt, half: Half, centre: Floats
) -> HalfViews:
    """Trace the outlines of all windows of a run whose stops were measured.

    `centre`: (3, K) of the balls with the base at angle zero, mm.
    """
    known = np.flatnonzero(half.frame >= 0)
    views = HalfViews(*(np.full(len(half.ids), np.nan) for _ in range(3)))
    if known.size == 0:
        return views
    shell = _taken(half.shell, known)
    which = half.ball[known]
    ball = machine.placed(centre[:, which], which, half.frame[known])
    radius, pinhole = machine.radius[which], machine.camera.pinhole
    apex = highlights(pinhole, ball, radius, np.zeros(3))
    start = shell.apex if context.moved else half.designed[:, known]
    before, after = sights(start, shell.pinhole), sights(apex, pinhole)
    matrix = window_rotations(before, after)
    normal = unit(apex - ball)
    surfaces = prepare_for_rays(pinhole, Surfaces(apex, normal, 1 / radius))
    # Neighbours of all mirrors bound the cells, measured or not.
    fronts = machine.fronts(ball, which, half.frame[known])
    transfer = RealTransfer(matrix, surfaces, fronts)
    outlines, nearest = ended_on_balls(transfer, cell_outlines(half.shell).take(known))
    d = np.einsum("ijm,jms->ims", matrix, outlines.direction)
    covered = outline_coverage(outlines.is_edge, nearest, d, after[0], shell.halved)
    views.coverage[known] = covered
    views.margin[known] = _least(machine.camera.frame_margin(d.reshape(3, -1)), outlines.is_edge)
    rays = transfer.rays(np.repeat(np.arange(known.size), d.shape[2]), d.reshape(3, -1))
    passing = norm(nearest_on_lines(pinhole[:, None], d.reshape(3, -1), 0.0, rays.reach))
    views.clearance[known] = _least(passing - context.radius, outlines.is_edge)
    return views


def _half(context: PrototypeContext, machine: AsBuilt, camera: str, turn: int) -> Half:
    export, plan = context.export, context.prototype.plan
    rows = np.flatnonzero(export.mirrors.camera == camera)
    mirrors = export.mirrors.take(rows)
    flip = HALF_TURN if turn else np.ones((3, 1))
    row_of = {plan.mirror[k]: k for k in np.flatnonzero(plan.turn == turn).tolist()}
    if missing := [name for name in mirrors.ids if name not in row_of]:
        raise BadExport(f"rotation_plan.csv shows no {missing[0]} ({len(missing)} missing)")
    picture = np.array([row_of[name] for name in mirrors.ids])
    ball = plan.ball[picture] - 1
    if not np.isin(ball, np.arange(len(context.prototype.balls))).all():
        raise BadExport("rotation_plan.csv names balls that do not exist")
    apex = context.prototype.balls.columns("px", 3)[:, ball]
    designed = context.base_rotation(np.radians(plan.angle[picture])).apply(apex.T).T
    shell = MirrorSpheres(
        context.pinhole,
        flip * mirrors.columns("px", 3),
        flip * mirrors.columns("cx", 3),
        mirrors.radius_mm,
        float(np.sign(context.pinhole[0])),
        export.foot_z_mm,
        np.asarray(np.abs(mirrors.ux) < ON_SEAM),
    )
    frame = machine.frame_of(turn, plan.stop[picture])
    return Half(mirrors.ids, shell, ball, frame, designed)


def _taken(shell: MirrorSpheres, some: Ints) -> MirrorSpheres:
    return replace(
        shell,
        apex=shell.apex[:, some],
        centre=shell.centre[:, some],
        radius=shell.radius[some],
        halved=shell.halved[some],
    )


def _least(values: Floats, is_edge: Bools) -> Floats:
    """(m,) smallest of values (m * s,) on edges of cells (m, s)."""
    return np.asarray(np.where(is_edge, values.reshape(is_edge.shape), np.inf).min(axis=1))

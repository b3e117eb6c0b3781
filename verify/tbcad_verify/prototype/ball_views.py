"""What every mirror's ball shows at its stop: coverage, and a free way for the light."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces, prepare_for_rays, reflect
from tbcad_verify.mesh.vectors import dot, norm, tangent_basis, unit
from tbcad_verify.prototype import axis
from tbcad_verify.prototype.blocked_rays import blocked_rays
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype
from tbcad_verify.prototype.pinhole_cells import (
    AROUND,
    INSIDE,
    CellOutlines,
    MirrorSpheres,
    cell_outlines,
    first_mirrors,
    mirror_spheres,
    sampled_pixels,
)
from tbcad_verify.prototype.ray_transfer import (
    RayTransfer,
    lengths,
    nearest_points,
    nearest_to_origin,
    ray_transfer,
    rotated,
)
from tbcad_verify.prototype.triangle_distances import to_segments
from tbcad_verify.types import Bools, Floats, Ints

HALVINGS = 26
RINGS = (0.25, 0.5, 0.75)  # of the way to the rim, each with one direction in EACH
EACH = 4
ROUND = 0.25  # by which turns about the origin may differ from one


@dataclass(frozen=True)
class BallViews:
    """What is found for each of m mirrors.

    Attributes:
        coverage: (m,) mm; 0 where the ball does not show the object's middle in the window.
        hidden: (m,) directions just inside the cell that another mirror of the shell takes.
        rays: (m,) looked at: pixels, and rings out to the rim of the capture sphere.
        blocked: (m,) of them that something stops, or that fall beside the ball.
        blockers: what stops them, each once.
        pixels: (m,) whose ray meets the capture sphere off the ball.
        pixels_shell: (m,) off the mirror.
    """

    coverage: Floats
    hidden: Ints
    rays: Ints
    blocked: Ints
    blockers: tuple[str, ...]
    pixels: Floats
    pixels_shell: Floats


def ball_views(measured: MeasuredPrototype) -> BallViews:
    """Trace all mirrors of the camera, each on its ball at its stop."""
    shell, ready = mirror_spheres(measured.context), ray_transfer(measured)
    cell = cell_outlines(shell)
    edge, miss = _on_balls(ready, cell)
    rim, mirror = _rim(ready, edge, miss)
    pixel, seen, weight, shell_weight = _pixels(ready, shell)
    stopped, blockers = blocked_rays(ready, np.append(mirror, seen), np.hstack([rim, pixel]))
    count = shell.radius.size
    every = np.append(mirror, seen)
    return BallViews(
        _coverage(ready, edge, miss),
        _hidden(shell, cell),
        np.bincount(every, minlength=count),
        np.bincount(every[stopped], minlength=count),
        blockers,
        np.bincount(seen, weight, count).astype(np.float64),
        shell_weight,
    )


def _on_balls(transfer: RayTransfer, edge: CellOutlines) -> tuple[CellOutlines, Floats]:
    """Outlines drawn in to where a ball ends before its mirror's cell does, and their misses."""
    miss = nearest_points(transfer, np.arange(edge.own.shape[0]), edge.direction)
    beside = np.isnan(miss[0])
    some = np.flatnonzero(beside.any(axis=1))
    share = np.ones(beside.shape)
    share[some] = _largest(transfer, edge, some, beside[some], np.inf)
    share = np.where(beside, share, 1.0)
    drawn = replace(edge, direction=edge.toward(share), angle=share * edge.angle)
    miss[:, some] = nearest_points(transfer, some, drawn.direction[:, some])
    return drawn, miss


def _largest(
    transfer: RayTransfer, edge: CellOutlines, some: Ints, search: Bools, radius: float
) -> Floats:
    """(s, AROUND) share of the way to the outline up to which rays pass within a radius, mm.

    Args:
        transfer: ready for rays.
        edge: all outlines.
        some: (s,) mirrors.
        search: (s, AROUND) where not all of the way is.
        radius: about the origin; infinite: as long as they meet the ball.
    """
    mine = CellOutlines(
        edge.chief[:, some], edge.direction[:, some], edge.angle[some], edge.own[some]
    )
    low, high = np.where(search, 0.0, 1.0), np.ones(search.shape)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        good = lengths(nearest_points(transfer, some, mine.toward(middle))) <= radius
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return low


def _coverage(transfer: RayTransfer, edge: CellOutlines, miss: Floats) -> Floats:
    """(m,) twice the least distance of the outline's image from the origin, mm.

    Zero where the outline does not run round the direction in which the ball shows the origin,
    once, or for a halved mirror by half, without its cut.
    """
    context, both = transfer.measured.context, edge.own & np.roll(edge.own, -1, axis=1)
    flat = [x.reshape(3, -1) for x in (miss, np.roll(miss, -1, axis=2))]
    away = to_segments(np.zeros_like(flat[0]), *flat).reshape(both.shape)
    # What passes the ball by shows nothing, so it takes nothing away.
    least = 2 * np.where(both & np.isfinite(away), away, np.inf).min(axis=1)
    apex = context.prototype.balls.columns("px", 3)[:, transfer.ball]
    middle = tangent_basis(unit(apex - context.pinhole[:, None]))
    way = np.einsum("ijm,jms->ims", transfer.on_base, edge.direction)
    angle = np.arctan2(*((side[:, :, None] * way).sum(axis=0) for side in reversed(middle)))
    step = axis.wrapped(np.roll(angle, -1, axis=1) - angle)
    turns = np.abs(np.where(both, step, 0).sum(axis=1)) / (2 * np.pi)
    wanted = np.where(context.halved, 0.5, 1.0)
    return np.where(np.abs(turns - wanted) <= ROUND, least, 0.0)


def _hidden(shell: MirrorSpheres, edge: CellOutlines) -> Ints:
    """(m,) directions of each cell, a little inside, along which another mirror comes first."""
    share = np.full(edge.angle.shape, INSIDE)
    found = first_mirrors(shell, edge.toward(share).reshape(3, -1)).reshape(edge.own.shape)
    wrong = (found != np.arange(shell.radius.size)[:, None]) & edge.own
    return np.asarray(wrong.sum(axis=1))


def _rim(transfer: RayTransfer, edge: CellOutlines, miss: Floats) -> tuple[Floats, Ints]:
    """Rays (3, N) that graze the capture sphere off the balls, and whose they are.

    They lie between the middle of the cell and its outline, or on that where it sees too little;
    the middle and a few rings within them go along, for what stands where no pixel looks.
    """
    every, radius = np.arange(edge.own.shape[0]), transfer.measured.context.radius
    share = _largest(transfer, edge, every, lengths(miss) > radius, radius)
    found = [edge.toward(share)[:, edge.own], edge.chief]
    mirror = [np.repeat(every[:, None], AROUND, axis=1)[edge.own], every]
    some = edge.own & (np.arange(AROUND) % EACH == 0)
    for ring in RINGS:
        found.append(edge.toward(ring * share)[:, some])
        mirror.append(np.repeat(every[:, None], AROUND, axis=1)[some])
    return np.concatenate(found, axis=1), np.concatenate(mirror)


def _pixels(transfer: RayTransfer, shell: MirrorSpheres) -> tuple[Floats, Ints, Floats, Floats]:
    """Rays of sampled pixels that meet the capture sphere off their ball, in the shell's picture.

    Returns:
        Directions (3, N), mirrors (N,), pixels that each stands for in the prototype's picture
        (N,), and pixels of the shell's picture by mirror (m,).
    """
    camera, radius = transfer.measured.context.camera, transfer.measured.context.radius
    d, step = sampled_pixels(camera)
    mirror = first_mirrors(shell, d)
    on = np.flatnonzero(mirror >= 0)
    d, mirror = d[:, on], mirror[on]
    normal = unit(shell.apex - shell.centre)
    balls = Surfaces(shell.centre + shell.radius * normal, normal, 1 / shell.radius)
    straight = (
        norm(nearest_to_origin(reflect(prepare_for_rays(shell.pinhole, balls), mirror, d)))
        <= radius
    )
    way = rotated(transfer.moved[:, :, mirror], d)
    meets = norm(nearest_to_origin(transfer.lines(mirror, d)[1])) <= radius
    depth = dot(way, np.broadcast_to(camera.forward[:, None], way.shape))
    # Turned toward the frame's edge, the same cone of rays fills more pixels.
    dense = np.asarray(step**2 / np.maximum(depth, 1e-3) ** 3, dtype=np.float64)
    area = np.full(int(straight.sum()), float(step**2))
    shell_count = np.bincount(mirror[straight], area, shell.radius.size).astype(np.float64)
    return d[:, meets], mirror[meets], dense[meets], shell_count

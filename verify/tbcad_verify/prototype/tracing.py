"""What every mirror's ball shows at its stop: coverage, and a free way for the light."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces, prepare_for_rays, reflect
from tbcad_verify.mesh.vectors import dot, norm, tangent_basis, unit
from tbcad_verify.prototype import axis
from tbcad_verify.prototype.blocked import blocked
from tbcad_verify.prototype.cells import (
    AROUND,
    INSIDE,
    Outlines,
    Shell,
    first_mirrors,
    outlines,
    sampled_pixels,
    shell_of,
)
from tbcad_verify.prototype.nearest import to_segments
from tbcad_verify.prototype.rig import Rig
from tbcad_verify.prototype.trace import Trace, lengths, misses, nearest, times, trace
from tbcad_verify.types import Bools, Floats, Ints

HALVINGS = 26
RINGS = (0.25, 0.5, 0.75)  # of the way to the rim, each with one direction in EACH
EACH = 4
ROUND = 0.25  # by which turns about the origin may differ from one


@dataclass(frozen=True)
class Shown:
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


def show(made: Rig) -> Shown:
    """Trace all mirrors of the camera, each on its ball at its stop."""
    shell, ready = shell_of(made.view), trace(made)
    cell = outlines(shell)
    edge, miss = _on_balls(ready, cell)
    rim, mirror = _rim(ready, edge, miss)
    pixel, seen, weight, shell_weight = _pixels(ready, shell)
    stopped, blockers = blocked(ready, np.append(mirror, seen), np.hstack([rim, pixel]))
    count = shell.radius.size
    every = np.append(mirror, seen)
    return Shown(
        _coverage(ready, edge, miss),
        _hidden(shell, cell),
        np.bincount(every, minlength=count),
        np.bincount(every[stopped], minlength=count),
        blockers,
        np.bincount(seen, weight, count).astype(np.float64),
        shell_weight,
    )


def _on_balls(made: Trace, edge: Outlines) -> tuple[Outlines, Floats]:
    """Outlines drawn in to where a ball ends before its mirror's cell does, and their misses."""
    miss = misses(made, np.arange(edge.own.shape[0]), edge.direction)
    beside = np.isnan(miss[0])
    some = np.flatnonzero(beside.any(axis=1))
    share = np.ones(beside.shape)
    share[some] = _largest(made, edge, some, beside[some], np.inf)
    share = np.where(beside, share, 1.0)
    drawn = replace(edge, direction=edge.toward(share), angle=share * edge.angle)
    miss[:, some] = misses(made, some, drawn.direction[:, some])
    return drawn, miss


def _largest(made: Trace, edge: Outlines, some: Ints, search: Bools, radius: float) -> Floats:
    """(s, AROUND) share of the way to the outline up to which rays pass within a radius, mm.

    Args:
        made: ready for rays.
        edge: all outlines.
        some: (s,) mirrors.
        search: (s, AROUND) where not all of the way is.
        radius: about the origin; infinite: as long as they meet the ball.
    """
    mine = Outlines(edge.chief[:, some], edge.direction[:, some], edge.angle[some], edge.own[some])
    low, high = np.where(search, 0.0, 1.0), np.ones(search.shape)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        good = lengths(misses(made, some, mine.toward(middle))) <= radius
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return low


def _coverage(made: Trace, edge: Outlines, miss: Floats) -> Floats:
    """(m,) twice the least distance of the outline's image from the origin, mm.

    Zero where the outline does not run round the direction in which the ball shows the origin,
    once, or for a halved mirror by half, without its cut.
    """
    view, both = made.rig.view, edge.own & np.roll(edge.own, -1, axis=1)
    flat = [x.reshape(3, -1) for x in (miss, np.roll(miss, -1, axis=2))]
    away = to_segments(np.zeros_like(flat[0]), *flat).reshape(both.shape)
    # What passes the ball by shows nothing, so it takes nothing away.
    least = 2 * np.where(both & np.isfinite(away), away, np.inf).min(axis=1)
    apex = view.made.balls.columns("px", 3)[:, made.ball]
    middle = tangent_basis(unit(apex - view.pinhole[:, None]))
    way = np.einsum("ijm,jms->ims", made.on_base, edge.direction)
    angle = np.arctan2(*((side[:, :, None] * way).sum(axis=0) for side in reversed(middle)))
    step = axis.wrapped(np.roll(angle, -1, axis=1) - angle)
    turns = np.abs(np.where(both, step, 0).sum(axis=1)) / (2 * np.pi)
    wanted = np.where(view.halved, 0.5, 1.0)
    return np.where(np.abs(turns - wanted) <= ROUND, least, 0.0)


def _hidden(shell: Shell, edge: Outlines) -> Ints:
    """(m,) directions of each cell, a little inside, along which another mirror comes first."""
    share = np.full(edge.angle.shape, INSIDE)
    found = first_mirrors(shell, edge.toward(share).reshape(3, -1)).reshape(edge.own.shape)
    wrong = (found != np.arange(shell.radius.size)[:, None]) & edge.own
    return np.asarray(wrong.sum(axis=1))


def _rim(made: Trace, edge: Outlines, miss: Floats) -> tuple[Floats, Ints]:
    """Rays (3, N) that graze the capture sphere off the balls, and whose they are.

    They lie between the middle of the cell and its outline, or on that where it sees too little;
    the middle and a few rings within them go along, for what stands where no pixel looks.
    """
    every, radius = np.arange(edge.own.shape[0]), made.rig.view.radius
    share = _largest(made, edge, every, lengths(miss) > radius, radius)
    found = [edge.toward(share)[:, edge.own], edge.chief]
    mirror = [np.repeat(every[:, None], AROUND, axis=1)[edge.own], every]
    some = edge.own & (np.arange(AROUND) % EACH == 0)
    for ring in RINGS:
        found.append(edge.toward(ring * share)[:, some])
        mirror.append(np.repeat(every[:, None], AROUND, axis=1)[some])
    return np.concatenate(found, axis=1), np.concatenate(mirror)


def _pixels(made: Trace, shell: Shell) -> tuple[Floats, Ints, Floats, Floats]:
    """Rays of sampled pixels that meet the capture sphere off their ball, in the shell's picture.

    Returns:
        Directions (3, N), mirrors (N,), pixels that each stands for in the prototype's picture
        (N,), and pixels of the shell's picture by mirror (m,).
    """
    camera, radius = made.rig.view.camera, made.rig.view.radius
    d, step = sampled_pixels(camera)
    mirror = first_mirrors(shell, d)
    on = np.flatnonzero(mirror >= 0)
    d, mirror = d[:, on], mirror[on]
    normal = unit(shell.apex - shell.centre)
    balls = Surfaces(shell.centre + shell.radius * normal, normal, 1 / shell.radius)
    straight = norm(nearest(reflect(prepare_for_rays(shell.pinhole, balls), mirror, d))) <= radius
    way = times(made.moved[:, :, mirror], d)
    meets = norm(nearest(made.lines(mirror, d)[1])) <= radius
    depth = dot(way, np.broadcast_to(camera.forward[:, None], way.shape))
    # Turned toward the frame's edge, the same cone of rays fills more pixels.
    dense = np.asarray(step**2 / np.maximum(depth, 1e-3) ** 3, dtype=np.float64)
    area = np.full(int(straight.sum()), float(step**2))
    shell_count = np.bincount(mirror[straight], area, shell.radius.size).astype(np.float64)
    return d[:, meets], mirror[meets], dense[meets], shell_count

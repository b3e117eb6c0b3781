"""View by every mirror's ball at its stop: coverage, and an unobstructed path for the light.

Rays of the shell's picture are rotated as the picture is, reflected by the balls, and stopped by
what is in their way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.mesh.rays import RAYS_A_CHUNK, in_threads
from tbcad_verify.mesh.surfaces import (
    Surfaces,
    nearest_on_rays,
    prepare_for_rays,
    reflect,
)
from tbcad_verify.mesh.vectors import (
    chunks,
    distances_to_segments,
    dot,
    norm,
    rotation_angles,
    unit,
)
from tbcad_verify.prototype.bodies import BodyScene, MeasuredPrototype
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.light.pinhole_cells import (
    INSIDE,
    OUTLINE_DIRECTIONS,
    TILE,
    MirrorSpheres,
    PinholeOutlines,
    cell_outlines,
    first_mirrors,
    mirror_spheres,
    sampled_pixels,
)
from tbcad_verify.prototype.light.windows import RayTransfer, Reflecting, ray_transfer, rotated
from tbcad_verify.prototype.measured_parts import PLACED
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    informative,
    short_list,
    worst_offenders,
)
from tbcad_verify.types import Bools, Floats, Ints

FILE = PLACED
CHECKS = {
    "cells": "directions",
    "coverage, balls": "mm",
    "light paths, balls": "blocked rays",
    "rays, balls": "rays",
    "pixels, balls": "% of the shell's",
}
HALVINGS = 26
RINGS = (0.25, 0.5, 0.75)  # of the angle to the rim, each with one direction in RING_STEP
RING_STEP = 4
TURNS = 0.25  # by which turns about the origin may differ from one
LIFT_MM = 1e-3
# Parts that reach into the capture sphere by less than this, as the object itself may, pass.
GRAZE_MM = 0.01
# A cap's facets lie this near to the sphere that they approximate.
SKIN_MM = 0.1

Hits = Iterator[tuple[Bools, str]]  # which of N rays something stops, and its name


@dataclass(frozen=True)
class BallViews:
    """The view of each of m mirrors."""

    coverage: Floats  # (m,) mm; 0 where the ball does not show the object's middle in the window
    # (m,) directions just inside the cell in which another mirror of the shell is seen
    hidden: Ints
    rays: Ints  # (m,) that were traced: pixels, and rings out to the rim of the capture sphere
    blocked: Ints  # (m,) of them that something stops, or that miss the ball
    blockers: tuple[str, ...]  # what stops them, each once
    # (m,) whose ray meets the capture sphere after the ball, and no LED or rod above the object
    pixels: Floats
    pixels_shell: Floats  # (m,) after the mirror


@dataclass(frozen=True)
class RayPaths:
    """Rays from the pinhole by their balls to the object, where the machine stands."""

    point: Floats  # (N, 3) on the ball, mm
    before: Floats  # (N, 3) unit, from the pinhole
    after: Floats  # (N, 3) unit, from the ball
    reach: Floats  # (N,) from the ball to where the ray is nearest to the object's middle, mm


@dataclass(frozen=True)
class PixelRays:
    """Rays of sampled pixels that meet the capture sphere after their ball."""

    direction: Floats  # (3, N) in the shell's picture
    mirror: Ints  # (N,) whose cell they are in
    weight: Floats  # (N,) pixels of the prototype's picture that each represents
    shell: Floats  # (m,) pixels of the shell's picture that see the capture sphere in each mirror


def ball_views(measured: MeasuredPrototype, pixel: PixelRays) -> BallViews:
    """Trace all mirrors of the camera, each on its ball at its stop."""
    shell, transfer = mirror_spheres(measured.context), ray_transfer(measured)
    cells = cell_outlines(shell)
    outlines, nearest = ended_on_balls(transfer, cells)
    rim, rim_mirror = _rim_rays(transfer, outlines, nearest)
    mirror, count = np.append(rim_mirror, pixel.mirror), shell.radius.size
    weight = np.where(stopped_above(measured, pixel), 0.0, pixel.weight)
    blocked, blockers = blocked_rays(transfer, mirror, np.hstack([rim, pixel.direction]))
    return BallViews(
        _coverage(transfer, outlines, nearest),
        _hidden(shell, cells),
        np.bincount(mirror, minlength=count),
        np.bincount(mirror[blocked], minlength=count),
        blockers,
        np.bincount(pixel.mirror, weight, count).astype(np.float64),
        pixel.shell,
    )


def checks(names: list[CheckName], context: PrototypeContext, views: BallViews) -> list[Check]:
    """Every mirror's ball shows the whole object at its stop, and nothing obstructs the light."""
    cells, covers, light, rays, pixels = names
    ids, target = context.mirror_ids, context.export.target_mm
    hidden, blocked, coverage = views.hidden, views.blocked, views.coverage
    small = worst_offenders(ids, coverage, "mm", coverage < target, badness=-coverage)
    seen, of = views.pixels.sum(), views.pixels_shell.sum()
    by, share = short_list(views.blockers), 100 * float(seen / max(of, 1))
    return [
        at_most(cells, hidden.sum(), 0, f"another mirror covers {_ray_counts(ids, hidden)}"),
        at_least(covers, float(coverage.min()), target, f"shows too little: {small}"),
        at_most(light, blocked.sum(), 0, f"{_ray_counts(ids, blocked)}; blocked by {by}"),
        informative(rays, float(views.rays.sum()), "traced, before and after the ball"),
        informative(pixels, share, f"{seen:.0f} of {of:.0f} px, from a sample"),
    ]


def _ray_counts(ids: list[str], counts: Ints) -> str:
    return worst_offenders(ids, counts.astype(np.float64), "rays", counts > 0, ".0f")


def ended_on_balls(transfer: Reflecting, cells: PinholeOutlines) -> tuple[PinholeOutlines, Floats]:
    """Outlines drawn in to where a ball ends before its mirror's cell does.

    And where (3, m, s) their reflected rays are nearest to the origin.
    """
    nearest = nearest_points(transfer, np.arange(cells.is_edge.shape[0]), cells.direction)
    beside = np.isnan(nearest[0])
    some = np.flatnonzero(beside.any(axis=1))
    share = np.ones(beside.shape)
    share[some] = _largest_share(transfer, cells, some, beside[some], np.inf)
    share = np.where(beside, share, 1.0)
    drawn = replace(cells, direction=cells.at_share(share), angle=share * cells.angle)
    nearest[:, some] = nearest_points(transfer, some, drawn.direction[:, some])
    return drawn, nearest


def _largest_share(
    transfer: Reflecting, outlines: PinholeOutlines, some: Ints, search: Bools, radius: float
) -> Floats:
    """(s, directions) share of the angle to the outline up to which rays pass within a radius.

    Of mirrors `some` (s,); it is less than one where `search` (s, directions) is true. The radius
    is about the origin, mm; infinite: as long as rays meet the ball.
    """
    mine = outlines.take(some)
    low, high = np.where(search, 0.0, 1.0), np.ones(search.shape)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        nearest = nearest_points(transfer, some, mine.at_share(middle))
        good = np.linalg.norm(nearest, axis=0) <= radius
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return low


def _coverage(transfer: RayTransfer, outlines: PinholeOutlines, nearest: Floats) -> Floats:
    """(m,) coverage of all mirrors, mm."""
    d = np.einsum("ijm,jms->ims", transfer.merged, outlines.direction)
    halved = transfer.measured.context.halved
    return outline_coverage(outlines.is_edge, nearest, d, transfer.middle, halved)


def outline_coverage(
    is_edge: Bools, nearest: Floats, d: Floats, middle: Floats, halved: Bools
) -> Floats:
    """(m,) twice the minimum distance of outlines' images from the origin, mm.

    Zero where the outline does not run once round the direction in which the ball shows the
    origin; a halved mirror's outline without its cut runs half round it.

    Args:
        is_edge: (m, s) directions that are on an edge of a cell.
        nearest: (3, m, s) where their reflected rays are nearest to the origin; NaN for none.
        d: (3, m, s) the directions, as they meet the balls.
        middle: (3, m) unit, in which the balls show the origin.
        halved: (m,) mirrors that the seam cuts.
    """
    both = is_edge & np.roll(is_edge, -1, axis=1)
    ends = [x.reshape(3, -1) for x in (nearest, np.roll(nearest, -1, axis=2))]
    distance = distances_to_segments(np.zeros_like(ends[0]), *ends).reshape(both.shape)
    # A ray that misses the ball shows nothing of the object, and does not count.
    diameter = 2 * np.where(both & np.isfinite(distance), distance, np.inf).min(axis=1)
    about = np.repeat(middle, both.shape[1], axis=1)
    ends = [x.reshape(3, -1) for x in (d, np.roll(d, -1, axis=2))]
    angle = np.where(both, rotation_angles(about, *ends).reshape(both.shape), 0)
    turns = np.abs(angle.sum(axis=1)) / (2 * np.pi)
    expected = np.where(halved, 0.5, 1.0)
    return np.where(np.abs(turns - expected) <= TURNS, diameter, 0.0)


def _hidden(shell: MirrorSpheres, cells: PinholeOutlines) -> Ints:
    """(m,) directions of each cell, a little inside, along which another mirror comes first."""
    inside = cells.at_share(np.full(cells.angle.shape, INSIDE))
    first = first_mirrors(shell, inside.reshape(3, -1)).reshape(cells.is_edge.shape)
    wrong = (first != np.arange(shell.radius.size)[:, None]) & cells.is_edge
    return np.asarray(wrong.sum(axis=1))


def _rim_rays(
    transfer: RayTransfer, outlines: PinholeOutlines, nearest: Floats
) -> tuple[Floats, Ints]:
    """Rays (3, N) that graze the capture sphere after the balls, and their mirrors (N,).

    They lie between the middle of the cell and its outline, or on the outline where it sees too
    little. The middle and a few rings are added, for obstacles where no pixel looks.
    """
    every, radius = np.arange(outlines.is_edge.shape[0]), transfer.measured.context.radius
    beyond = np.linalg.norm(nearest, axis=0) > radius
    share = _largest_share(transfer, outlines, every, beyond, radius)
    mirror = np.repeat(every[:, None], OUTLINE_DIRECTIONS, axis=1)
    some = outlines.is_edge & (np.arange(OUTLINE_DIRECTIONS) % RING_STEP == 0)
    rays = [outlines.at_share(share)[:, outlines.is_edge], outlines.chief]
    rays += [outlines.at_share(ring * share)[:, some] for ring in RINGS]
    mirrors = [mirror[outlines.is_edge], every, *[mirror[some]] * len(RINGS)]
    return np.concatenate(rays, axis=1), np.concatenate(mirrors)


def pixel_rays(measured: MeasuredPrototype) -> PixelRays:
    """Rays of sampled pixels that meet the capture sphere after their ball."""
    shell, transfer = mirror_spheres(measured.context), ray_transfer(measured)
    camera, radius = measured.context.camera, measured.context.radius
    d, step = sampled_pixels(camera)
    mirror = first_mirrors(shell, d, TILE**2)
    on = np.flatnonzero(mirror >= 0)
    d, mirror = d[:, on], mirror[on]
    normal = unit(shell.apex - shell.centre)
    spheres = Surfaces(shell.centre + shell.radius * normal, normal, 1 / shell.radius)
    by_mirror = reflect(prepare_for_rays(shell.pinhole, spheres), mirror, d)
    in_shell = norm(nearest_on_rays(by_mirror)) <= radius
    in_prototype = norm(nearest_on_rays(transfer.reflected(mirror, d)[1])) <= radius
    merged = rotated(transfer.merged[:, :, mirror], d)
    depth = dot(merged, np.broadcast_to(camera.forward[:, None], merged.shape))
    # Rotated toward the frame's edge, the same cone of rays fills more pixels.
    weight = np.asarray(step**2 / np.maximum(depth, 1e-3) ** 3, dtype=np.float64)
    area = np.full(int(in_shell.sum()), float(step**2))
    shell_count = np.bincount(mirror[in_shell], area, shell.radius.size).astype(np.float64)
    return PixelRays(d[:, in_prototype], mirror[in_prototype], weight[in_prototype], shell_count)


def ray_paths(measured: MeasuredPrototype, pixel: PixelRays) -> RayPaths:
    """Paths of the pixels' rays, each at its stop."""
    to_ball, rays = ray_transfer(measured).reflected(pixel.mirror, pixel.direction)
    away = norm(nearest_on_rays(rays) - rays.point)
    return RayPaths(rays.point.T, unit(to_ball).T, unit(rays.toward).T, away)


def stopped_above(measured: MeasuredPrototype, pixel: PixelRays) -> Bools:
    """Which rays (N,) boards and rods of LEDs above the object stop, before or after the ball."""
    above = measured.above
    if above.scene is None:
        return np.zeros(pixel.mirror.size, dtype=np.bool_)
    paths = ray_paths(measured, pixel)
    origin = np.broadcast_to(measured.context.pinhole, paths.point.shape)
    to_ball = np.linalg.norm(paths.point - origin, axis=1)
    stopped = above.first(origin.T, paths.before.T)[1] < to_ball
    return np.asarray(stopped | (above.first(paths.point.T, paths.after.T)[1] < paths.reach))


def nearest_points(transfer: Reflecting, mirror: Ints, d: Floats) -> Floats:
    """(3, m, s) where reflected rays are nearest to the origin; NaN beside the ball.

    Of unit directions d (3, m, s) in the cells of mirrors (m,).
    """
    nearest = np.empty_like(d)
    for part in chunks(mirror.size, max(1, RAYS_A_CHUNK // d.shape[2])):
        repeated = np.repeat(mirror[part], d.shape[2])
        rays = transfer.reflected(repeated, d[:, part].reshape(3, -1))[1]
        nearest[:, part] = nearest_on_rays(rays).reshape(3, -1, d.shape[2])
    return nearest


def blocked_rays(transfer: RayTransfer, mirror: Ints, d: Floats) -> tuple[Bools, tuple[str, ...]]:
    """Which rays do not get from the pinhole by their ball to the capture sphere, and why.

    Of directions d (3, N) in the shell's picture, in the cells of mirrors (N,).
    """

    def blocked(part: slice) -> tuple[Bools, set[str]]:
        hits = [*_hits(transfer, mirror[part], d[:, part])]
        stopped = np.any([hit for hit, _ in hits], axis=0)
        return stopped, {name for hit, name in hits if hit.any()}

    results = in_threads(blocked, list(chunks(mirror.size, RAYS_A_CHUNK)))
    names = sorted({name for _, blockers in results for name in blockers})
    return np.concatenate([blocked for blocked, _ in results]), tuple(names)


def _hits(transfer: RayTransfer, mirror: Ints, d: Floats) -> Hits:
    """All that can stop rays, one after the other, on the way to the ball and from it."""
    measured, ball = transfer.measured, transfer.ball[mirror]
    radius, held = measured.context.radius, transfer.held.take(mirror)
    to_ball, rays = transfer.reflected(mirror, d)
    pinhole = np.broadcast_to(measured.context.pinhole[:, None], to_ball.shape)
    off_centre = norm(held.on_base(rays.point) - measured.seated[:, ball])
    yield ~(off_centre <= measured.body_radius[ball] + LIFT_MM), "nothing (beside the ball)"
    from_object = distances_to_segments(np.zeros_like(to_ball), pinhole, rays.point)
    yield from_object < radius, "the capture sphere"
    nearest, from_ball = nearest_on_rays(rays), unit(rays.toward)
    depth = np.sqrt(np.maximum((radius + GRAZE_MM) ** 2 - norm(nearest) ** 2, 0))
    start = rays.point + LIFT_MM * from_ball
    legs = (
        (pinhole, unit(to_ball), norm(rays.point - pinhole) - SKIN_MM),
        (start, from_ball, norm(nearest - start) - depth),
    )
    for origin, along, length in legs:
        start_on, along_on = held.on_base(origin), held.vectors_on_base(along)
        for k in range(measured.body_radius.size):
            sphere = measured.seated[:, k], measured.body_radius[k]
            yield _meets(*sphere, start_on, along_on, length) & (ball != k), f"ball {k + 1}"
        yield from _part_hits(measured.rotating, start_on, along_on, length)
        yield from _part_hits(measured.fixed, origin, along, length)


def _meets(centre: Floats, radius: float, origin: Floats, along: Floats, length: Floats) -> Bools:
    """(N,) whether rays of unit directions meet a sphere within a length."""
    offset = origin - centre[:, None]
    b = dot(offset, along)
    rest = dot(offset, offset) - b * b
    first = -b - np.sqrt(np.maximum(radius**2 - rest, 0))
    return np.asarray((rest < radius**2) & (first < length) & (b < 0))


def _part_hits(obstacles: BodyScene, origin: Floats, along: Floats, length: Floats) -> Hits:
    """Rays that meet parts within a length, part by part."""
    body, distance = obstacles.first(origin, along)
    near = distance < length
    for k in np.unique(body[near]).tolist():
        yield near & (body == k), obstacles.names[k]

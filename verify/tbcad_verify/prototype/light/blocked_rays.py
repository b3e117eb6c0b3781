"""Obstructions of the light: from the pinhole to a ball, and from there to the capture sphere."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tbcad_verify.mesh.rays import RAYS_A_CHUNK, distances_to_planes, first_hits, in_threads
from tbcad_verify.mesh.surfaces import nearest_on_rays
from tbcad_verify.mesh.vectors import chunks, distances_to_segments, dot, norm, unit
from tbcad_verify.prototype.light.ray_transfer import RayTransfer
from tbcad_verify.prototype.measured_prototype import Obstacles
from tbcad_verify.types import Bools, Floats, Ints

LIFT_MM = 1e-3
# Parts that reach into the capture sphere by less than this, as the object itself may, pass.
GRAZE_MM = 0.01
# A cap's facets lie this near to the sphere that they approximate.
SKIN_MM = 0.1

Hits = Iterator[tuple[Bools, str]]  # which of N rays something stops, and its name


def blocked_rays(transfer: RayTransfer, mirror: Ints, d: Floats) -> tuple[Bools, tuple[str, ...]]:
    """Which rays do not get from the pinhole by their ball to the capture sphere, and why.

    Args:
        transfer: to the balls.
        mirror: (N,) whose cells the directions are in.
        d: (3, N) directions in the shell's picture.
    """
    parts = list(chunks(mirror.size, RAYS_A_CHUNK))
    results = in_threads(lambda part: _blocked(transfer, mirror[part], d[:, part]), parts)
    names = sorted({name for _, blockers in results for name in blockers})
    return np.concatenate([blocked for blocked, _ in results]), tuple(names)


def _blocked(transfer: RayTransfer, mirror: Ints, d: Floats) -> tuple[Bools, set[str]]:
    names: set[str] = set()
    blocked = np.zeros(mirror.size, dtype=np.bool_)
    for hit, name in _hits(transfer, mirror, d):
        if hit.any():
            names.add(name)
            blocked |= hit
    return blocked, names


def _hits(transfer: RayTransfer, mirror: Ints, d: Floats) -> Hits:
    """All that can stop rays, one after the other, on the way to the ball and from it."""
    measured = transfer.measured
    radius, base = measured.context.radius, transfer.base[mirror]
    ball = transfer.ball[mirror]
    to_ball, rays = transfer.reflected(mirror, d)
    pinhole = np.broadcast_to(measured.context.pinhole[:, None], to_ball.shape)
    off_centre = norm(rays.point - measured.body[:, ball])
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
        for k in range(measured.body_radius.size):
            hit = _meets(measured.body[:, k], measured.body_radius[k], origin, along, length)
            yield hit & (ball != k), f"ball {k + 1}"
        yield from _part_hits(measured.rotating, origin, along, length)
        on_ground = [base.apply(np.array(x.T)).T for x in (origin, along)]
        yield from _part_hits(measured.fixed, on_ground[0], on_ground[1], length)


def _meets(centre: Floats, radius: float, origin: Floats, along: Floats, length: Floats) -> Bools:
    """(N,) whether rays of unit directions meet a sphere within a length."""
    offset = origin - centre[:, None]
    b = dot(offset, along)
    rest = dot(offset, offset) - b * b
    return np.asarray(
        (rest < radius**2) & (-b - np.sqrt(np.maximum(radius**2 - rest, 0)) < length) & (b < 0)
    )


def _part_hits(obstacles: Obstacles, origin: Floats, along: Floats, length: Floats) -> Hits:
    """Rays that meet parts within a length, part by part."""
    if obstacles.scene is None:
        return
    facet = first_hits(obstacles.scene, origin, along)
    hit = np.flatnonzero(facet >= 0)
    distance = np.full(facet.size, np.inf)
    distance[hit] = distances_to_planes(obstacles.scene, facet[hit], origin[:, hit], along[:, hit])
    near = distance < length
    for k in np.unique(obstacles.owner[facet[near]]).tolist():
        yield near & (obstacles.owner[facet] == k), obstacles.names[k]

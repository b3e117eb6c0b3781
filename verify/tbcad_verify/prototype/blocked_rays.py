"""What stands in the light: pinhole to ball, and ball to capture sphere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tbcad_verify.mesh.rays import RAYS_A_CHUNK, distances_to_planes, first_hits, in_threads
from tbcad_verify.mesh.vectors import chunks, dot, norm, unit
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype, Obstacles, to_ground
from tbcad_verify.prototype.ray_transfer import RayTransfer, nearest_to_origin
from tbcad_verify.prototype.triangle_distances import to_segments
from tbcad_verify.types import Bools, Floats, Ints

LIFT_MM = 1e-3
# What stands out of the capture sphere by less than this, as the object itself may, is no obstacle.
GRAZE_MM = 0.01
# A cap's facets lie this near to the sphere that they stand for.
SKIN_MM = 0.1


def blocked_rays(transfer: RayTransfer, mirror: Ints, d: Floats) -> tuple[Bools, tuple[str, ...]]:
    """Which rays do not get from the pinhole by their ball to the capture sphere, and why."""
    parts = list(chunks(mirror.size, RAYS_A_CHUNK))
    found = in_threads(lambda part: _stopped(transfer, mirror[part], d[:, part]), parts)
    names = sorted({name for _, said in found for name in said})
    return np.concatenate([stopped for stopped, _ in found]), tuple(names)


def _stopped(transfer: RayTransfer, mirror: Ints, d: Floats) -> tuple[Bools, set[str]]:
    measured, context = transfer.measured, transfer.measured.context
    names: set[str] = set()
    way, lines = transfer.lines(mirror, d)
    ball, angle = transfer.ball[mirror], transfer.angle[mirror]
    start = np.broadcast_to(context.pinhole[:, None], way.shape)
    toward = unit(lines.toward)
    at = nearest_to_origin(lines)
    depth = np.sqrt(np.maximum((context.radius + GRAZE_MM) ** 2 - norm(at) ** 2, 0))
    from_ball = lines.point + LIFT_MM * toward
    goal = norm(at - from_ball) - depth
    stopped = np.zeros(mirror.size, dtype=np.bool_)

    def count(bad: Bools, name: str) -> None:
        if bad.any():
            names.add(name)
        np.logical_or(stopped, bad, out=stopped)

    count(~_on(measured, ball, lines.point), "nothing (beside the ball)")
    to_ball = norm(lines.point - start)
    legs = ((start, unit(way), to_ball - SKIN_MM), (from_ball, toward, goal))
    count(
        to_segments(np.zeros_like(start), start, lines.point) < context.radius, "the capture sphere"
    )
    for origin, along, length in legs:
        for k in range(measured.body_radius.size):
            bad = _meets(measured.body[:, k], measured.body_radius[k], origin, along, length)
            count(bad & (ball != k), f"ball {k + 1}")
        _parts(measured.turning, origin, along, length, count)
        ground = [to_ground(context, x, angle) for x in (origin, along)]
        _parts(measured.standing, ground[0], ground[1], length, count)
    return stopped, names


def _on(measured: MeasuredPrototype, ball: Ints, point: Floats) -> Bools:
    """(N,) whether points on reflecting spheres are on the balls that there are."""
    away = norm(point - measured.body[:, ball])
    return np.asarray(away <= measured.body_radius[ball] + LIFT_MM)


def _meets(centre: Floats, radius: float, origin: Floats, along: Floats, length: Floats) -> Bools:
    """(N,) whether rays of unit directions meet a sphere within a length."""
    away = origin - centre[:, None]
    b = dot(away, along)
    rest = dot(away, away) - b * b
    return np.asarray(
        (rest < radius**2) & (-b - np.sqrt(np.maximum(radius**2 - rest, 0)) < length) & (b < 0)
    )


def _parts(
    obstacles: Obstacles,
    origin: Floats,
    along: Floats,
    length: Floats,
    count: Callable[[Bools, str], None],
) -> None:
    """Tell which rays meet parts within a length."""
    if obstacles.scene is None:
        return
    facet = first_hits(obstacles.scene, origin, along)
    hit = np.flatnonzero(facet >= 0)
    at = np.full(facet.size, np.inf)
    at[hit] = distances_to_planes(obstacles.scene, facet[hit], origin[:, hit], along[:, hit])
    bad = at < length
    for k in np.unique(obstacles.owner[facet[bad]]).tolist():
        count(bad & (obstacles.owner[facet] == k), obstacles.names[k])

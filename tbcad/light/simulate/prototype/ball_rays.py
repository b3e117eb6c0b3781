"""What the prototype's camera sees: balls, and the object in them, but no printed part.

Along given directions, in the whole photograph of a stop, or in the pixels that are interpolated.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np

from tbcad.common.compiled import compiled
from tbcad.core.geometry.loop_vectors import Vector, divided, minus, vector
from tbcad.core.geometry.loop_vectors import dot as loop_dot
from tbcad.core.geometry.vectors import dot
from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.pedestals.cells import NO_WALLS, GrooveWalls
from tbcad.core.optics.reflection import reflect
from tbcad.core.optics.sphere_forms import FIRST, ray_reach, surface_normals
from tbcad.light.simulate.capture.photograph import Samples, sample_shifts, to_bytes
from tbcad.light.simulate.prototype.run import SPHERES, PrototypeRun
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays, object_in_front
from tbcad.light.simulate.scene.rays import within_walls
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

# Where a ball's front ends its body begins; for a bought ball both are the same sphere.
SAME_MM = 1e-9
# Points on balls are on them but for rounding.
ON_BALL_MM = 1e-6
# What lies beyond the outermost pixels' centres by no more than rounding is on them.
EDGE_PX = 1e-6
CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
WallTable: TypeAlias = tuple[Ints, Floats]  # of `GrooveWalls.of_mirrors`


@dataclass(frozen=True)
class BallHits:
    """What n rays from the camera meet."""

    ball: Ints  # number of the ball that reflects each, from 1; 0 where none does, (n,)
    origin: Floats  # points on the balls, mm, (n, 3); zero where there is none
    direction: Floats  # unit vectors after the ball, (n, 3); zero where there is none
    distance: Floats  # of the ball, mm, (n,); infinite where there is none


def trace_balls(run: PrototypeRun, direction: Floats, stop: Ints) -> BallHits:
    """What unit directions (n, 3) from the pinhole meet at stops (n,)."""
    return ball_hits(run.camera.pinhole, run.balls, direction, stop)


def trace_own_ball(run: PrototypeRun, direction: Floats, stop: Ints, ball: Ints) -> BallHits:
    """What unit directions (n, 3) meet when nothing is but one ball (n,), from 1, at stops (n,)."""
    sphere = run.balls[stop, np.maximum(ball, 1) - 1]
    to_centre, radius = sphere[:, :3] - run.camera.pinhole, sphere[:, 3]
    along = dot(to_centre, direction)
    root = radius**2 - dot(to_centre, to_centre) + along**2
    on = (ball > 0) & (root >= 0)
    distance = np.where(on, along - np.sqrt(np.maximum(root, 0)), np.inf)
    return _reflected(run.camera.pinhole, direction, np.where(on, ball, 0), distance, sphere)


def ball_hits(
    pinhole: Floats, balls: Floats, direction: Floats, stop: Ints, walls: GrooveWalls = NO_WALLS
) -> BallHits:
    """What unit directions (n, 3) meet at stops (n,): balls (s, k, 8) as of PrototypeRun."""
    ends = walls.of_mirrors(balls.shape[1])
    ball, distance = _first_ball(pinhole, direction, stop, balls, ends)
    return _reflected(pinhole, direction, ball, distance, balls[stop, np.maximum(ball, 1) - 1])


def _reflected(
    pinhole: Floats, direction: Floats, ball: Ints, distance: Floats, sphere: Floats
) -> BallHits:
    """Rays after the balls (n,), from 1, that they meet at distances (n,): of these the rows."""
    on = ball > 0
    origin, reflected = np.zeros_like(direction), np.zeros_like(direction)
    made = on & sphere[:, SPHERES : SPHERES + FIRST].any(axis=1)  # with a form
    centre, radius, form = sphere[:, :3], sphere[:, 3], sphere[:, SPHERES:]
    if made.any():
        shapes = centre[made], radius[made], form[made]
        distance[made] = ray_reach(pinhole, direction[made], shapes, distance[made])
    origin[on] = pinhole + distance[on, None] * direction[on]
    normal = (origin - centre) / radius[:, None]
    if made.any():
        normal[made] = surface_normals(centre[made], origin[made], form[made])
    reflected[on] = reflect(direction[on], normal[on])
    return BallHits(ball, origin, reflected, distance)


def camera_colours(scene: Scene, pinhole: Floats, direction: Floats, hits: BallHits) -> Colours:
    """What a camera records along unit directions (n, 3) that meet balls, 0 to 255."""
    colour, on = np.zeros((len(hits.ball), 3), dtype=np.float32), np.flatnonzero(hits.ball)
    colour[on] = cast_rays(scene, hits.origin[on], hits.direction[on]).colour
    front, direct = object_in_front(scene, pinhole, direction, hits.distance)
    return np.where(front[:, None], direct, colour)


def image_points(camera: LensCamera, direction: Floats) -> Floats:
    """Column and row (n, 2) where directions (n, 3) appear; NaN outside of the pixels' centres."""
    last = np.array([camera.width_px - 1.0, camera.height_px - 1.0])
    shown = camera.shows(direction)
    pixels = np.full((len(direction), 2), np.nan)
    pixels[shown] = camera.project(camera.pinhole + direction[shown])
    outside = (pixels < -EDGE_PX) | (pixels > last + EDGE_PX)
    pixels[outside.any(axis=1)] = np.nan
    return np.asarray(np.clip(pixels, 0, last))


def resampled_photograph(
    run: PrototypeRun, scene: Scene, stop: int, samples: Samples, places: Floats
) -> Bytes:
    """The photograph of a stop at columns and rows (n, 2) between its pixels' centres, (n, 3)."""
    taken = partial(photographed_pixels, run, scene, stop, samples)
    return resampled(run.camera.width_px, places, taken)


def resampled(width_px: int, places: Floats, taken: Callable[[Ints], Bytes]) -> Bytes:
    """A photograph at columns and rows (n, 2) between its pixels' centres, (n, 3).

    Bilinear between the four nearest pixels, which are whole numbers as in a file. `taken`: their
    colours (k, 3), of numbers (k,), counted row by row, ascending.
    """
    near, weight = between_pixels(places)
    pixel = near[..., 0] + near[..., 1] * width_px
    traced, which = np.unique(pixel, return_inverse=True)
    corners = taken(traced)[which.reshape(len(places), 4)]
    return to_bytes(np.einsum("nk,nkc->nc", weight, corners))


def between_pixels(places: Floats) -> tuple[Ints, Floats]:
    """The four pixels about columns and rows (n, 2), (n, 4, 2), and their bilinear weights (n, 4).

    Beyond the last column and row a pixel has no weight, and does not exist.
    """
    corner = np.floor(places).astype(np.int64)
    x, y = (places - corner).T
    weight = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    return corner[:, None] + CORNERS, weight


def photographed_pixels(
    run: PrototypeRun, scene: Scene, stop: int, samples: Samples, pixels: Ints
) -> Bytes:
    """Pixels (n,) of a photograph, counted row by row, (n, 3)."""
    row, column = np.divmod(pixels, run.camera.width_px)
    centres = np.column_stack([column, row]).astype(np.float64)
    stops = np.full(len(pixels), stop)
    total = np.zeros((len(pixels), 3), dtype=np.float32)
    shifts = sample_shifts(samples)
    for shift in shifts:
        direction = run.camera.directions(centres + shift)
        hits = trace_balls(run, direction, stops)
        total += camera_colours(scene, run.camera.pinhole, direction, hits)
    return to_bytes(total / np.float32(len(shifts)))


@compiled
def balls_between(start: Floats, end: Floats, balls: Floats, walls: WallTable) -> Bools:
    """Whether a ball (k, 8) within its walls is between points (n, 3), which may be on balls."""
    hidden = np.zeros(len(start), dtype=np.bool_)
    for i in range(len(start)):
        begin = vector(start[i])
        way = minus(vector(end[i]), begin)
        length = np.sqrt(loop_dot(way, way))
        way = divided(way, length)
        for k in range(len(balls)):
            own = walls[1][walls[0][k] : walls[0][k + 1]]
            first, last, _ = _body_span(begin, way, balls[k], own)
            if first <= last and ON_BALL_MM < first < length - ON_BALL_MM:
                hidden[i] = True
    return hidden


@compiled
def points_within_walls(point: Floats, ball: Ints, walls: WallTable) -> Bools:
    """Which points (n, 3) are on the inner side of the walls of balls (n,), from 0."""
    inside = np.zeros(len(point), dtype=np.bool_)
    for i in range(len(point)):
        own = walls[1][walls[0][ball[i]] : walls[0][ball[i] + 1]]
        inside[i] = within_walls(own, vector(point[i]))
    return inside


@compiled
def _body_span(
    start: Vector, direction: Vector, ball: Floats, walls: Floats
) -> tuple[float, float, float]:
    """Where a ray enters and leaves what a ball (8,) is, and where it enters its sphere.

    That is what both its spheres have in common, on the inner side of its walls (k, 6).
    """
    enters, leaves = _span(start, direction, vector(ball), ball[3])
    body_enters, body_leaves = _span(start, direction, vector(ball, 4), ball[7])
    first, last = max(enters, body_enters), min(leaves, body_leaves)
    if first > last:
        return first, last, enters
    for wall in walls:
        inward = vector(wall, 3)
        value, rate = loop_dot(minus(start, vector(wall)), inward), loop_dot(direction, inward)
        if rate > 0:
            first = max(first, -value / rate)
        elif rate < 0:
            last = min(last, -value / rate)
        elif value < 0:
            return np.inf, -np.inf, enters
    return first, last, enters


@compiled
def _span(start: Vector, direction: Vector, centre: Vector, radius: float) -> tuple[float, float]:
    """Where a ray enters and leaves a sphere; infinite and minus infinite where it misses."""
    x, y, z = minus(start, centre)
    along = loop_dot((x, y, z), direction)
    root = along * along - (-radius * radius + x * x + y * y + z * z)
    if root < 0:
        return np.inf, -np.inf
    return -along - np.sqrt(root), -along + np.sqrt(root)


@compiled
def _first_ball(
    pinhole: Floats, direction: Floats, stop: Ints, balls: Floats, walls: WallTable
) -> tuple[Ints, Floats]:
    """Ball (n,), from 1, that n rays meet first, and its distance, mm, (n,).

    A ray that enters a cap through the sphere in the seat meets its dark side, as one that enters a
    pedestal through a wall does: no ball, but it hides what is behind.
    """
    ball, distance = np.zeros(len(direction), dtype=np.int64), np.full(len(direction), np.inf)
    start = vector(pinhole)
    for i in range(len(direction)):
        way = vector(direction[i])
        for k in range(balls.shape[1]):
            own = walls[1][walls[0][k] : walls[0][k + 1]]
            first, last, enters = _body_span(start, way, balls[stop[i], k], own)
            if 0 < first < distance[i] and first <= last:
                distance[i] = first
                ball[i] = k + 1 if enters >= first - SAME_MM else 0
    return ball, distance

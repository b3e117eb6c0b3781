"""What the prototype's camera sees: balls, and the object in them, but no printed part.

Along given directions, in the whole photograph of a stop, or in the pixels that are interpolated.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from tbcad.optics.lens_camera import LensCamera
from tbcad.optics.reflection import reflect
from tbcad.simulate.capture.photograph import Samples, row_bands, sample_shifts, to_bytes
from tbcad.simulate.parallel import compiled, in_threads
from tbcad.simulate.prototype.run import PrototypeRun
from tbcad.simulate.scene.ray_casting import Scene, cast_rays, object_in_front
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

# Where a ball's front ends its body begins; for a bought ball both are the same sphere.
SAME_MM = 1e-9
# Points on balls are on them but for rounding.
ON_BALL_MM = 1e-6
# What lies beyond the outermost pixels' centres by no more than rounding is on them.
EDGE_PX = 1e-6
CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])


@dataclass(frozen=True)
class BallHits:
    """What n rays from the camera meet.

    Attributes:
        ball: number of the ball that reflects each, from 1; 0 where none does, (n,).
        origin: points on the balls, mm, (n, 3); zero where there is none.
        direction: unit vectors after the ball, (n, 3); zero where there is none.
        distance: of the ball, mm, (n,); infinite where there is none.
    """

    ball: Ints
    origin: Floats
    direction: Floats
    distance: Floats


def trace_balls(run: PrototypeRun, direction: Floats, stop: Ints) -> BallHits:
    """What unit directions (n, 3) from the pinhole meet at stops (n,)."""
    return ball_hits(run.camera.pinhole, run.balls, direction, stop)


def ball_hits(pinhole: Floats, balls: Floats, direction: Floats, stop: Ints) -> BallHits:
    """What unit directions (n, 3) from a pinhole (3,) meet.

    Args:
        pinhole: mm, (3,).
        balls: at each stop, (s, k, 8): see PrototypeRun.
        direction: (n, 3).
        stop: from 0, (n,).
    """
    ball, distance = _first_ball(pinhole, direction, stop, balls)
    on = ball > 0
    origin, reflected = np.zeros_like(direction), np.zeros_like(direction)
    origin[on] = pinhole + distance[on, None] * direction[on]
    sphere = balls[stop[on], ball[on] - 1]
    reflected[on] = reflect(direction[on], (origin[on] - sphere[:, :3]) / sphere[:, 3:4])
    return BallHits(ball, origin, reflected, distance)


def reflected_colours(scene: Scene, hits: BallHits) -> Colours:
    """Colours (n, 3) of the object's images in the balls, 0 to 255."""
    colour = np.zeros((len(hits.ball), 3), dtype=np.float32)
    on = np.flatnonzero(hits.ball)
    colour[on] = cast_rays(scene, hits.origin[on], hits.direction[on]).colour
    return colour


def camera_colours(run: PrototypeRun, scene: Scene, direction: Floats, stop: Ints) -> Colours:
    """What the camera records along unit directions (n, 3) at stops (n,), 0 to 255."""
    hits = trace_balls(run, direction, stop)
    front, direct = object_in_front(scene, run.camera.pinhole, direction, hits.distance)
    return np.where(front[:, None], direct, reflected_colours(scene, hits))


def image_points(camera: LensCamera, direction: Floats) -> Floats:
    """Column and row (n, 2) where directions (n, 3) appear; NaN outside of the pixels' centres."""
    last = np.array([camera.width_px - 1.0, camera.height_px - 1.0])
    shown = camera.shows(direction)
    pixels = np.full((len(direction), 2), np.nan)
    pixels[shown] = camera.project(camera.pinhole + direction[shown])
    outside = (pixels < -EDGE_PX) | (pixels > last + EDGE_PX)
    pixels[outside.any(axis=1)] = np.nan
    return np.asarray(np.clip(pixels, 0, last))


def stop_photograph(run: PrototypeRun, scene: Scene, stop: int, samples: Samples = 1) -> Bytes:
    """The whole photograph of a stop, (h, w, 3).

    Args:
        run: of camera a's mirrors, or of camera b's with the object turned.
        scene: the object.
        stop: number of the stop, from 0.
        samples: a pixel is the mean of these rays.
    """
    height, width = run.camera.height_px, run.camera.width_px
    bands = [np.arange(rows.start * width, rows.stop * width) for rows in row_bands(height)]
    colours = in_threads(partial(_pixels, run, scene, stop, samples), bands)
    return np.concatenate(colours).reshape(height, width, 3)


def resampled_photograph(
    run: PrototypeRun, scene: Scene, stop: int, samples: Samples, places: Floats
) -> Bytes:
    """The photograph of a stop at columns and rows (n, 2) between its pixels' centres, (n, 3).

    Bilinear between the four nearest pixels, which are whole numbers as in a file.
    """
    near, weight = between_pixels(places)
    pixel = near[..., 0] + near[..., 1] * run.camera.width_px
    traced, which = np.unique(pixel, return_inverse=True)
    corners = _pixels(run, scene, stop, samples, traced)[which.reshape(len(places), 4)]
    return to_bytes(np.einsum("nk,nkc->nc", weight, corners))


def between_pixels(places: Floats) -> tuple[Ints, Floats]:
    """The four pixels about columns and rows (n, 2), (n, 4, 2), and their bilinear weights (n, 4).

    Beyond the last column and row a pixel has no weight, and does not exist.
    """
    corner = np.floor(places).astype(np.int64)
    x, y = (places - corner).T
    weight = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    return corner[:, None] + CORNERS, weight


def _pixels(run: PrototypeRun, scene: Scene, stop: int, samples: Samples, pixels: Ints) -> Bytes:
    """Pixels (n,) of a photograph, counted row by row, (n, 3)."""
    row, column = np.divmod(pixels, run.camera.width_px)
    centres = np.column_stack([column, row]).astype(np.float64)
    stops = np.full(len(pixels), stop)
    total = np.zeros((len(pixels), 3), dtype=np.float32)
    shifts = sample_shifts(samples)
    for shift in shifts:
        total += camera_colours(run, scene, run.camera.directions(centres + shift), stops)
    return to_bytes(total / np.float32(len(shifts)))


@compiled
def balls_between(start: Floats, end: Floats, balls: Floats) -> Bools:
    """Whether a ball (k, 8) is between points (n, 3), which may be on balls."""
    hidden = np.zeros(len(start), dtype=np.bool_)
    for i in range(len(start)):
        way = end[i] - start[i]
        length = np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
        way /= length
        for k in range(len(balls)):
            enters, leaves = _span(start[i], way, balls[k, :3], balls[k, 3])
            body_enters, body_leaves = _span(start[i], way, balls[k, 4:7], balls[k, 7])
            first = max(enters, body_enters)
            if first <= min(leaves, body_leaves) and ON_BALL_MM < first < length - ON_BALL_MM:
                hidden[i] = True
    return hidden


@compiled
def _span(pinhole: Floats, direction: Floats, centre: Floats, radius: float) -> tuple[float, float]:
    """Where a ray enters and leaves a sphere; infinite and minus infinite where it misses."""
    along, power = 0.0, -radius * radius
    for j in range(3):
        offset = pinhole[j] - centre[j]
        along += offset * direction[j]
        power += offset * offset
    root = along * along - power
    if root < 0:
        return np.inf, -np.inf
    return -along - np.sqrt(root), -along + np.sqrt(root)


@compiled
def _first_ball(
    pinhole: Floats, direction: Floats, stop: Ints, balls: Floats
) -> tuple[Ints, Floats]:
    """Ball (n,), from 1, that n rays meet first, and its distance, mm, (n,).

    A cap is what its two spheres have in common. A ray that enters it through the
    sphere in the seat meets its dark side: no ball, but it hides what is behind.
    """
    ball, distance = np.zeros(len(direction), dtype=np.int64), np.full(len(direction), np.inf)
    for i in range(len(direction)):
        for k in range(balls.shape[1]):
            row = balls[stop[i], k]
            enters, leaves = _span(pinhole, direction[i], row[:3], row[3])
            body_enters, body_leaves = _span(pinhole, direction[i], row[4:7], row[7])
            first = max(enters, body_enters)
            if 0 < first < distance[i] and first <= min(leaves, body_leaves):
                distance[i] = first
                ball[i] = k + 1 if enters >= body_enters - SAME_MM else 0
    return ball, distance

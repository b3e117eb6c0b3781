"""What the prototype's camera sees along given directions: balls, and the object in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.geometry.vectors import unit
from tbcad.optics.camera import Camera
from tbcad.simulate.parallel import compiled
from tbcad.simulate.prototype.run import PrototypeRun
from tbcad.simulate.scene.ray_casting import Scene, cast_rays
from tbcad.simulate.scene.reflector import pixel_pitch
from tbcad.types import Bools, Floats, Ints

Colours = NDArray[np.float32]

# Where a ball's front ends its body begins; for a bought ball both are the same sphere.
SAME_MM = 1e-9
# What lies beyond the outermost pixels' centres by no more than rounding is on them.
EDGE_PX = 1e-6


@dataclass(frozen=True)
class BallHits:
    """What n rays from the camera meet.

    Attributes:
        ball: number of the ball that reflects each, from 1; 0 where none does, (n,).
        origin: points on the balls, mm, (n, 3); zero where there is none.
        direction: unit vectors after the ball, (n, 3); zero where there is none.
        reach: how far the ball is, mm, (n,); infinite where there is none.
    """

    ball: Ints
    origin: Floats
    direction: Floats
    reach: Floats


def trace_balls(run: PrototypeRun, way: Floats, stop: Ints) -> BallHits:
    """What unit directions (n, 3) from the pinhole meet at stops (n,)."""
    ball, reach = np.zeros(len(way), dtype=np.int64), np.full(len(way), np.inf)
    origin, direction = np.zeros_like(way), np.zeros_like(way)
    _reflect(run.view.pinhole, way, stop, run.balls, ball, reach, origin, direction)
    return BallHits(ball, origin, direction, reach)


def reflected_colours(scene: Scene, seen: BallHits) -> Colours:
    """Colours (n, 3) of the object's images in the balls, 0 to 255."""
    colour = np.zeros((len(seen.ball), 3), dtype=np.float32)
    on = np.flatnonzero(seen.ball)
    colour[on] = cast_rays(scene, seen.origin[on], seen.direction[on]).colour
    return colour


def object_in_front(
    scene: Scene, view: Camera, way: Floats, reach: Floats
) -> tuple[Bools, Colours]:
    """Where (n,) the object stands nearer than a reach (n,), mm, and its colours there (n, 3)."""
    direct = cast_rays(scene, np.broadcast_to(view.pinhole, way.shape), way)
    front = np.isfinite(direct.depth) & (direct.depth < reach)
    return front, direct.colour


def camera_colours(run: PrototypeRun, scene: Scene, way: Floats, stop: Ints) -> Colours:
    """What the camera records along unit directions (n, 3) at stops (n,), 0 to 255."""
    seen = trace_balls(run, way, stop)
    front, direct = object_in_front(scene, run.view, way, seen.reach)
    return np.where(front[:, None], direct, reflected_colours(scene, seen))


def pixel_rays(view: Camera, places: Floats) -> Floats:
    """Unit directions (n, 3) through columns and rows (n, 2); whole numbers are pixel centres."""
    size = np.array([view.width_px, view.height_px])
    across, downward = (places - (size - 1) / 2).T * pixel_pitch(view)
    down = np.cross(view.forward, view.right)
    return unit(view.forward + across[:, None] * view.right + downward[:, None] * down)


def image_points(view: Camera, way: Floats) -> Floats:
    """Column and row (n, 2) where directions (n, 3) appear; NaN outside of the pixels' centres."""
    axes = np.stack([view.right, np.cross(view.forward, view.right), view.forward])
    last = np.array([view.width_px - 1.0, view.height_px - 1.0])
    return _places(way, axes, pixel_pitch(view), last)


@compiled
def _places(way: Floats, axes: Floats, width: float, last: Floats) -> Floats:
    places = np.full((len(way), 2), np.nan)
    for i in range(len(way)):
        depth = axes[2, 0] * way[i, 0] + axes[2, 1] * way[i, 1] + axes[2, 2] * way[i, 2]
        if depth <= 0:
            continue
        for k in range(2):
            across = axes[k, 0] * way[i, 0] + axes[k, 1] * way[i, 1] + axes[k, 2] * way[i, 2]
            places[i, k] = across / depth / width + last[k] / 2
            if not -EDGE_PX <= places[i, k] <= last[k] + EDGE_PX:
                places[i] = np.nan
                break
            places[i, k] = min(max(places[i, k], 0.0), last[k])
    return places


@compiled
def _span(pinhole: Floats, way: Floats, centre: Floats, radius: float) -> tuple[float, float]:
    """Where a ray enters and leaves a sphere; infinite and minus infinite where it misses."""
    along, away = 0.0, -radius * radius
    for j in range(3):
        step = pinhole[j] - centre[j]
        along += step * way[j]
        away += step * step
    root = along * along - away
    if root < 0:
        return np.inf, -np.inf
    return -along - np.sqrt(root), -along + np.sqrt(root)


@compiled
def _reflect(
    pinhole: Floats,
    way: Floats,
    stop: Ints,
    balls: Floats,
    ball: Ints,
    reach: Floats,
    origin: Floats,
    direction: Floats,
) -> None:
    """Fill in what n rays meet first; a cap is what its two spheres have in common.

    A ray that enters a cap through the sphere in the seat meets its dark side: no ball, but it
    hides what is behind.
    """
    for i in range(len(way)):
        for k in range(balls.shape[1]):
            row = balls[stop[i], k]
            enters, leaves = _span(pinhole, way[i], row[:3], row[3])
            body_enters, body_leaves = _span(pinhole, way[i], row[4:7], row[7])
            first = max(enters, body_enters)
            if 0 < first < reach[i] and first <= min(leaves, body_leaves):
                reach[i] = first
                ball[i] = k + 1 if enters >= body_enters - SAME_MM else 0
        if ball[i] == 0:
            continue
        row, slope = balls[stop[i], ball[i] - 1], 0.0
        for j in range(3):
            origin[i, j] = pinhole[j] + reach[i] * way[i, j]
            slope += way[i, j] * (origin[i, j] - row[j]) / row[3]
        for j in range(3):
            direction[i, j] = way[i, j] - 2 * slope * (origin[i, j] - row[j]) / row[3]

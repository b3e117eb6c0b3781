"""Rays through a window's outline after its ball: compiled, all mirrors of one run at a time."""

from math import inf, sqrt

import numpy as np

from tbcad.simulate.parallel import compiled
from tbcad.tolerance.montecarlo.cell_edges import crosses_half_axis
from tbcad.tolerance.vectors import (
    Vector,
    cross,
    divided,
    dot,
    minus,
    plus_scaled,
    reflect,
    unit,
    vector,
)
from tbcad.types import Floats, Ints

# Steps to the point of a ball that shows the object's centre; difference of cosines that ends them.
STEPS = 60
COSINE_TOLERANCE = 1e-14
# Rays of a side; the search for the minimum begins with every COARSE-th of them.
COARSE = 16
SIDE_SAMPLES = 8 * COARSE + 1


@compiled
def minimum_miss_distances(
    side: Floats,
    first: Ints,
    outward: Floats,
    highlight: Floats,
    lens: Floats,
    pinhole: Floats,
    centre: Floats,
    radius: Floats,
) -> Floats:
    """Minimum distance from the object's centre of the rays through each window's outline.

    Args:
        side: camera directions along all sides, at even parameters, (e, SIDE_SAMPLES, 3).
        first: number of each mirror's first side, (m + 1,).
        outward: for each mirror a camera direction from the window's inside to its outline, (m, 3).
        highlight: see `highlights`, (m, 3).
        lens: matrices that turn camera directions, as rows, into true ones, (m, 3, 3).
        pinhole: mm, (3,).
        centre: of each mirror's ball, mm, (m, 3).
        radius: of each, mm, (m,).

    Returns:
        mm, (m,); infinite where all rays miss the ball, zero where the outline does not surround
        the point of the ball that shows the object's centre.
    """
    result, image = np.zeros(len(radius)), np.empty((2, 2))
    for i in range(len(radius)):
        axis = vector(highlight[i])
        toward = _true_direction(outward[i], lens[i])
        right = unit(plus_scaled(toward, -dot(axis, toward), axis))
        down = cross(axis, right)
        minimum, crossings = inf, 0
        for e in range(first[i], first[i + 1]):
            for k in range(0, side.shape[1], COARSE):
                direction = _true_direction(side[e, k], lens[i])
                place = image[(k // COARSE) % 2]
                place[0], place[1] = dot(direction, right), dot(direction, down)
                if k > 0:
                    before = image[(k // COARSE - 1) % 2]
                    crossings += crosses_half_axis(before, place)
            found = _minimum_of_side(side[e], lens[i], pinhole, centre[i], radius[i])
            minimum = min(minimum, found)
        result[i] = sqrt(minimum) if crossings % 2 == 1 else 0.0
    return result


@compiled
def highlights(pinhole: Floats, centre: Floats, radius: Floats) -> Floats:
    """Unit directions (m, 3) in which a camera sees the object's centre in balls.

    At that point the directions to the object and to the camera make the same angle with the
    normal. The normal lies between the directions of both from the ball's centre, and is found by
    false position (Illinois).

    Args:
        pinhole: mm, (3,).
        centre: of the balls, mm, (m, 3).
        radius: of the balls, mm, (m,).
    """
    result, camera = np.empty((len(radius), 3)), vector(pinhole)
    for i in range(len(radius)):
        ball, r = vector(centre[i]), radius[i]
        to_object, to_camera = unit((-ball[0], -ball[1], -ball[2])), unit(minus(camera, ball))
        low, high, last = 0.0, 1.0, 0.0
        below = _cosine_difference(_normal(to_object, to_camera, 0.0), camera, ball, r)
        above = _cosine_difference(_normal(to_object, to_camera, 1.0), camera, ball, r)
        normal = to_object
        for _ in range(STEPS):
            share = (low * above - high * below) / (above - below)
            normal = _normal(to_object, to_camera, share)
            difference = _cosine_difference(normal, camera, ball, r)
            if abs(difference) < COSINE_TOLERANCE:
                break
            if difference > 0:
                low, below, above = share, difference, above / 2 if last > 0 else above
            else:
                high, above, below = share, difference, below / 2 if last < 0 else below
            last = difference
        result[i] = unit(minus(plus_scaled(ball, r, normal), camera))
    return result


@compiled
def _normal(to_object: Vector, to_camera: Vector, share: float) -> Vector:
    """Unit vector between two."""
    zero = (0.0, 0.0, 0.0)
    return unit(plus_scaled(plus_scaled(zero, 1 - share, to_object), share, to_camera))


@compiled
def _cosine_difference(normal: Vector, camera: Vector, centre: Vector, radius: float) -> float:
    """Cosine between a ball's normal and the direction to the object, less that for the camera."""
    point = plus_scaled(centre, radius, normal)
    away = minus(camera, point)
    to_object = -dot(normal, point) / sqrt(dot(point, point))
    return to_object - dot(normal, away) / sqrt(dot(away, away))


@compiled
def _true_direction(direction: Floats, lens: Floats) -> Vector:
    """True unit direction of a camera direction."""
    d = vector(direction)
    return unit(
        (dot(d, vector(lens[:, 0])), dot(d, vector(lens[:, 1])), dot(d, vector(lens[:, 2])))
    )


@compiled
def _minimum_of_side(
    side: Floats, lens: Floats, pinhole: Floats, centre: Floats, radius: float
) -> float:
    """Minimum distance squared of the rays along one side (n, 3).

    The minimum of every COARSE-th ray, then of ever closer ones about it, and at last on the
    parabola through its neighbours.
    """
    last = len(side) - 1
    best, minimum = 0, inf
    for k in range(0, last + 1, COARSE):
        value = _miss(side[k], lens, pinhole, centre, radius)
        if value < minimum:
            best, minimum = k, value
    step = COARSE // 2
    while step > 0:
        middle = best
        for k in (middle - step, middle + step):
            if 0 <= k <= last:
                value = _miss(side[k], lens, pinhole, centre, radius)
                if value < minimum:
                    best, minimum = k, value
        step //= 2
    middle = min(max(best, 1), last - 1)
    before = _miss(side[middle - 1], lens, pinhole, centre, radius)
    value = _miss(side[middle], lens, pinhole, centre, radius)
    after = _miss(side[middle + 1], lens, pinhole, centre, radius)
    bend, slope = before - 2 * value + after, after - before
    if 0 < bend < inf and abs(slope) <= 2 * bend:
        minimum = max(min(minimum, value - slope * slope / (8 * bend)), 0.0)
    return minimum


@compiled
def _miss(direction: Floats, lens: Floats, pinhole: Floats, centre: Floats, radius: float) -> float:
    """Distance squared from the origin of a ray after a ball; infinite where it misses the ball.

    Infinite also where the ray goes away from the object, as in tbcad.optics.ball_light.
    """
    ray, camera = _true_direction(direction, lens), vector(pinhole)
    from_ball = minus(camera, vector(centre))
    along = -dot(from_ball, ray)
    root = radius * radius - dot(from_ball, from_ball) + along * along
    if root < 0:
        return inf
    reach = along - sqrt(root)
    normal = divided(plus_scaled(from_ball, reach, ray), radius)
    point = plus_scaled(camera, reach, ray)
    ahead = dot(point, reflect(ray, normal))
    return inf if ahead > 0 else dot(point, point) - ahead * ahead

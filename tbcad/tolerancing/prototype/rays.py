"""Rays through a window's outline after its ball: compiled, all mirrors of one run at a time."""

from math import inf, sqrt

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.loop_vectors import (
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
from tbcad.tolerancing.montecarlo.edge_samples import MAX_FALL, crosses_half_axis, rise_beside
from tbcad.types import Floats, Ints

# Steps to the point of a ball that shows the object's centre; difference of cosines that ends them.
STEPS = 60
COSINE_TOLERANCE = 1e-14
# Rays of a side; the search for the minimum begins with every COARSE-th of them.
COARSE = 16
COARSE_SAMPLES = 9
SIDE_SAMPLES = (COARSE_SAMPLES - 1) * COARSE + 1
# Places from one quantity of the coarse samples to the next. Rows: distance squared, and place in
# the picture about the highlight.
STRIDE = 16
MISS, RIGHT, DOWN = 0, 1, 2
# Columns of a sampled side: the minimum sample, its number, and what the minimum is not below.
MINIMUM, BEST, BOUND, SIDE_COLUMNS = 0, 1, 2, 3


@compiled_loop
def minimum_miss_distances(
    sides: tuple[Floats, Floats, Ints],
    outward: Floats,
    highlight: Floats,
    lens: Floats,
    pinhole: Floats,
    centre: Floats,
    radius: Floats,
) -> Floats:
    """Minimum distance of the rays through each window's outline from the object, mm, (m,).

    Sides are camera directions at even parameters, (e, SIDE_SAMPLES, 3), some of them (see
    `coarse_directions`), and the number of each mirror's first side, (m + 1,). For each mirror: a
    camera direction outward from the window's inside to its outline, the highlight (see
    `highlights`), the lens, matrices that turn camera directions, as rows, into true ones, and the
    ball. Infinite where all rays miss the ball, zero where the outline does not surround its
    highlight.
    """
    side, coarse, first = sides
    result, side_minima = np.zeros(len(radius)), np.empty((np.diff(first).max(), SIDE_COLUMNS))
    samples = np.empty((3, STRIDE))
    for i in range(len(radius)):
        axis = vector(highlight[i])
        toward = _true_direction(outward[i], lens[i])
        right = unit(plus_scaled(toward, -dot(axis, toward), axis))
        down = cross(axis, right)
        crossings, limit, count = 0, inf, first[i + 1] - first[i]
        for k in range(count):
            e = first[i] + k
            _sample_side(coarse[e], lens[i], pinhole, centre[i], radius[i], right, down, samples)
            crossings += _crossings(samples)
            _put_minimum(side_minima[k], samples[MISS])
            limit = min(limit, side_minima[k, MINIMUM])
        if crossings % 2 == 0:
            continue
        minimum = inf
        for k in range(count):
            if side_minima[k, MINIMUM] == inf or not side_minima[k, BOUND] > limit:
                best, low = int(side_minima[k, BEST]), side_minima[k, MINIMUM]
                refined = _minimum_of_side(
                    side[first[i] + k], best, low, lens[i], pinhole, centre[i], radius[i]
                )
                minimum = min(minimum, refined)
        result[i] = sqrt(minimum)
    return result


def coarse_directions(side: Floats) -> Floats:
    """Every COARSE-th direction of sides (e, SIDE_SAMPLES, 3), x, y and z apart, (e, 3, STRIDE)."""
    result = np.zeros((len(side), 3, STRIDE))
    result[:, :, :COARSE_SAMPLES] = side[:, ::COARSE].swapaxes(1, 2)
    return result


@compiled_loop
def _sample_side(
    coarse: Floats,
    lens: Floats,
    pinhole: Floats,
    centre: Floats,
    radius: float,
    right: Vector,
    down: Vector,
    samples: Floats,
) -> None:
    """Fill in distances squared of a side's rays, and the places of their directions."""
    x, y, z = vector(lens[:, 0]), vector(lens[:, 1]), vector(lens[:, 2])
    camera, ball = vector(pinhole), vector(centre)
    for k in range(COARSE_SAMPLES):
        d = coarse[0, k], coarse[1, k], coarse[2, k]
        direction = unit((dot(d, x), dot(d, y), dot(d, z)))
        samples[MISS, k] = _miss_along(direction, camera, ball, radius)
        samples[RIGHT, k], samples[DOWN, k] = dot(direction, right), dot(direction, down)


@compiled_loop
def _crossings(samples: Floats) -> int:
    """How often a side's line crosses the half line from the highlight to the right."""
    count = 0
    for k in range(COARSE_SAMPLES - 1):
        here, there = samples[:, k], samples[:, k + 1]
        count += crosses_half_axis(here[RIGHT], here[DOWN], there[RIGHT], there[DOWN])
    return count


@compiled_loop
def _put_minimum(side: Floats, miss: Floats) -> None:
    """Fill in a side's minimum sample, its number, and what the minimum is not below."""
    best = 0
    for k in range(1, COARSE_SAMPLES):
        if miss[k] < miss[best]:
            best = k
    side[MINIMUM], side[BEST] = miss[best], best * COARSE
    side[BOUND] = miss[best] - MAX_FALL * rise_beside(miss, COARSE_SAMPLES, best)


@compiled_loop
def highlights(pinhole: Floats, centre: Floats, radius: Floats) -> Floats:
    """Unit directions (m, 3) in which a camera sees the object's centre in balls; lengths in mm.

    At that point the directions to the object and to the camera make the same angle with the
    normal. The normal lies between the directions of both from the ball's centre, and is found by
    false position (Illinois).
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


@compiled_loop
def _normal(to_object: Vector, to_camera: Vector, share: float) -> Vector:
    zero = (0.0, 0.0, 0.0)
    return unit(plus_scaled(plus_scaled(zero, 1 - share, to_object), share, to_camera))


@compiled_loop
def _cosine_difference(normal: Vector, camera: Vector, centre: Vector, radius: float) -> float:
    """Cosine between a ball's normal and the direction to the object, less that for the camera."""
    point = plus_scaled(centre, radius, normal)
    to_point = minus(camera, point)
    to_object = -dot(normal, point) / sqrt(dot(point, point))
    return to_object - dot(normal, to_point) / sqrt(dot(to_point, to_point))


@compiled_loop
def _true_direction(direction: Floats, lens: Floats) -> Vector:
    d = vector(direction)
    return unit(
        (dot(d, vector(lens[:, 0])), dot(d, vector(lens[:, 1])), dot(d, vector(lens[:, 2])))
    )


@compiled_loop
def _minimum_of_side(
    side: Floats,
    best: int,
    minimum: float,
    lens: Floats,
    pinhole: Floats,
    centre: Floats,
    radius: float,
) -> float:
    """Minimum distance squared along a side (n, 3), from every COARSE-th ray by closer ones."""
    last = len(side) - 1
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


@compiled_loop
def _miss(direction: Floats, lens: Floats, pinhole: Floats, centre: Floats, radius: float) -> float:
    """Distance squared from the origin of a ray after a ball; see `_miss_along`."""
    return _miss_along(_true_direction(direction, lens), vector(pinhole), vector(centre), radius)


@compiled_loop
def _miss_along(ray: Vector, camera: Vector, ball: Vector, radius: float) -> float:
    """Distance squared from the origin of a ray after a ball; infinite if it misses, or leaves."""
    from_ball = minus(camera, ball)
    along = -dot(from_ball, ray)
    root = radius * radius - dot(from_ball, from_ball) + along * along
    reach = along - sqrt(max(root, 0.0))
    normal = divided(plus_scaled(from_ball, reach, ray), radius)
    point = plus_scaled(camera, reach, ray)
    ahead = dot(point, reflect(ray, normal))
    distance = dot(point, point) - ahead * ahead
    return inf if (root < 0) | (ahead > 0) else distance

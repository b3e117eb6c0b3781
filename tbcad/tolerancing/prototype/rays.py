"""Rays through a window's outline after its ball: compiled, all mirrors of one run at a time."""

from math import inf, sqrt
from typing import TypeAlias

import numpy as np

from tbcad.common.compiled import compiled_loop, compiled_part
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
from tbcad.core.optics.sphere_forms import PER_MM
from tbcad.tolerancing.montecarlo.edge_samples import MAX_FALL, crosses_half_axis, rise_beside
from tbcad.tolerancing.montecarlo.form import Form, form_numbers, slope
from tbcad.types import Floats, Ints

# Rays of a side; the search for the minimum begins with every COARSE-th of them.
COARSE = 16
COARSE_SAMPLES = 9
SIDE_SAMPLES = (COARSE_SAMPLES - 1) * COARSE + 1
# Rows of the coarse samples: distance squared, and place in the picture about the highlight.
MISS, RIGHT, DOWN = 0, 1, 2
Ball: TypeAlias = tuple[Vector, float, Form]  # centre, radius, form


@compiled_loop
def minimum_miss_distances(
    sides: tuple[Floats, Ints],
    outward: Floats,
    highlight: Floats,
    lens: Floats,
    pinhole: Floats,
    centre: Floats,
    radius: Floats,
    form: Floats,
) -> Floats:
    """Minimum distance of the rays through each window's outline from the object, mm, (m,).

    Sides are camera directions at even parameters, (e, SIDE_SAMPLES, 3), and the number of each
    mirror's first side, (m + 1,). For each mirror: a camera direction outward from the window's
    inside to its outline, the unit direction in which its ball shows the object's centre (the
    highlight), the lens, matrices that turn camera directions, as rows, into true ones, and the
    ball with its form (tbcad.core.optics.sphere_forms), whose slope turns the normal; its height
    is too small to matter. Infinite where all rays miss the ball, zero where the outline does not
    surround its highlight.
    """
    side, first = sides
    result, samples = np.zeros(len(radius)), np.empty((3, COARSE_SAMPLES))
    camera = vector(pinhole)
    for i in range(len(radius)):
        axis, ball = vector(highlight[i]), (vector(centre[i]), radius[i], form_numbers(form[i]))
        toward = _true_direction(outward[i], lens[i])
        right = unit(plus_scaled(toward, -dot(axis, toward), axis))
        down = cross(axis, right)
        crossings, minimum = 0, inf
        for e in range(first[i], first[i + 1]):
            for k in range(COARSE_SAMPLES):
                direction = _true_direction(side[e, k * COARSE], lens[i])
                samples[MISS, k] = _miss(direction, camera, ball)
                samples[RIGHT, k], samples[DOWN, k] = dot(direction, right), dot(direction, down)
            crossings += _crossings(samples)
            best = int(np.argmin(samples[MISS]))
            fall = MAX_FALL * rise_beside(samples[MISS], COARSE_SAMPLES, best)
            least = samples[MISS, best]
            if least == inf or not least - fall > minimum:
                refined = _refined(side[e], best * COARSE, least, lens[i], camera, ball)
                minimum = min(minimum, refined)
        if crossings % 2 == 1:
            result[i] = sqrt(minimum)
    return result


@compiled_part
def _crossings(samples: Floats) -> int:
    """How often a side's line crosses the half line from the highlight to the right."""
    count = 0
    for k in range(COARSE_SAMPLES - 1):
        here, there = samples[:, k], samples[:, k + 1]
        count += crosses_half_axis(here[RIGHT], here[DOWN], there[RIGHT], there[DOWN])
    return count


@compiled_part
def _refined(
    side: Floats, best: int, minimum: float, lens: Floats, camera: Vector, ball: Ball
) -> float:
    """Minimum distance squared along a side (n, 3), from every COARSE-th ray by closer ones."""
    last = len(side) - 1
    step = COARSE // 2
    while step > 0:
        middle = best
        for k in (middle - step, middle + step):
            if 0 <= k <= last:
                value = _miss(_true_direction(side[k], lens), camera, ball)
                if value < minimum:
                    best, minimum = k, value
        step //= 2
    middle = min(max(best, 1), last - 1)
    before = _miss(_true_direction(side[middle - 1], lens), camera, ball)
    value = _miss(_true_direction(side[middle], lens), camera, ball)
    after = _miss(_true_direction(side[middle + 1], lens), camera, ball)
    bend, slope = before - 2 * value + after, after - before
    if 0 < bend < inf and abs(slope) <= 2 * bend:
        minimum = max(min(minimum, value - slope * slope / (8 * bend)), 0.0)
    return minimum


@compiled_part
def _true_direction(direction: Floats, lens: Floats) -> Vector:
    d = vector(direction)
    return unit(
        (dot(d, vector(lens[:, 0])), dot(d, vector(lens[:, 1])), dot(d, vector(lens[:, 2])))
    )


@compiled_part
def _miss(ray: Vector, camera: Vector, ball: Ball) -> float:
    """Distance squared from the origin of a ray after a ball; infinite if it misses, or leaves."""
    centre, radius, form = ball
    from_ball = minus(camera, centre)
    along = -dot(from_ball, ray)
    root = radius * radius - dot(from_ball, from_ball) + along * along
    reach = along - sqrt(max(root, 0.0))
    offset = plus_scaled(from_ball, reach, ray)
    normal = divided(offset, radius)
    if form[PER_MM] > 0:
        normal = minus(normal, slope(form, offset))
    point = plus_scaled(camera, reach, ray)
    ahead = dot(point, reflect(ray, normal))
    distance = dot(point, point) - ahead * ahead
    return inf if (root < 0) | (ahead > 0) else distance

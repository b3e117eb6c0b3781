"""Rays of a window's outline after the ball in it: compiled, all mirrors of one run at a time."""

from math import inf, sqrt

import numpy as np

from tbcad.simulate.parallel import compiled
from tbcad.types import Floats, Ints

# Steps to the point of a ball that shows the object's middle, and what of a cosine may be left.
STEPS = 60
NEAR_ENOUGH = 1e-14
# Rays along each side of a window, of which the search for the least begins with nine.
COARSE = 16
SAMPLES = 8 * COARSE + 1


@compiled
def least_misses(
    side: Floats,
    first: Ints,
    across: Floats,
    highlight: Floats,
    lens: Floats,
    pinhole: Floats,
    centre: Floats,
    radius: Floats,
) -> Floats:
    """Least distance from the object's middle of the rays through each window's outline.

    Args:
        side: directions in the camera along all sides, at even parameters, (e, SAMPLES, 3).
        first: where each mirror's sides begin, (m + 1,).
        across: for each mirror a direction from inside to its outline, in the camera, (m, 3).
        highlight: see `highlights`, (m, 3).
        lens: what turns directions in the camera, as rows, into true ones, (m, 3, 3).
        pinhole: mm, (3,).
        centre: of each mirror's ball, mm, (m, 3).
        radius: of each, mm, (m,).

    Returns:
        mm, (m,); infinite where all rays miss the ball, zero where the outline does not go round
        the point of the ball that shows the object's middle.
    """
    found, line = np.zeros(len(radius)), np.empty((2, 3))
    seen, way, frame = np.empty((2, 2)), np.empty(3), np.empty((2, 3))
    for i in range(len(radius)):
        line[0], line[1] = pinhole, centre[i]
        _true(across[i], lens[i], way)
        _square(highlight[i], way, frame)
        least, passes = inf, 0
        for e in range(first[i], first[i + 1]):
            for k in range(0, side.shape[1], COARSE):
                _true(side[e, k], lens[i], way)
                here = seen[(k // COARSE) % 2]
                for j in range(2):
                    here[j] = way[0] * frame[j, 0] + way[1] * frame[j, 1] + way[2] * frame[j, 2]
                if k > 0 and _passes(seen[0], seen[1]):
                    passes += 1
            least = min(least, _lowest(side[e], lens[i], line, radius[i]))
        found[i] = sqrt(least) if passes % 2 == 1 else 0.0
    return found


@compiled
def highlights(pinhole: Floats, centre: Floats, radius: Floats) -> Floats:
    """Unit directions (m, 3) in which a camera sees the object's middle in balls.

    There the way to the object makes the same angle with the normal as that to the camera. The
    normal lies between the directions of both from the ball's centre, and is found by false
    position (Illinois).

    Args:
        pinhole: mm, (3,).
        centre: of the balls, mm, (m, 3).
        radius: of the balls, mm, (m,).
    """
    way = np.empty((len(radius), 3))
    to_object, to_camera = np.empty(3), np.empty(3)
    for i in range(len(radius)):
        point = way[i]
        to_object[:], to_camera[:] = -centre[i], pinhole - centre[i]
        _shorten(to_object)
        _shorten(to_camera)
        low, high, last = 0.0, 1.0, 0.0
        below = _slant(to_object, to_camera, 0.0, pinhole, centre[i], radius[i], point)
        above = _slant(to_object, to_camera, 1.0, pinhole, centre[i], radius[i], point)
        for _ in range(STEPS):
            share = (low * above - high * below) / (above - below)
            here = _slant(to_object, to_camera, share, pinhole, centre[i], radius[i], point)
            if abs(here) < NEAR_ENOUGH:
                break
            if here > 0:
                low, below, above = share, here, above / 2 if last > 0 else above
            else:
                high, above, below = share, here, below / 2 if last < 0 else below
            last = here
        point -= pinhole
        _shorten(point)
    return way


@compiled
def _slant(
    to_object: Floats,
    to_camera: Floats,
    share: float,
    pinhole: Floats,
    centre: Floats,
    radius: float,
    point: Floats,
) -> float:
    """Fill in the point of a ball in a direction between two.

    Returns:
        The cosine between its normal and the way to the object, less that for the camera.
    """
    size, here, there = 0.0, 0.0, 0.0
    for j in range(3):
        point[j] = (1 - share) * to_object[j] + share * to_camera[j]
        size += point[j] * point[j]
    size = sqrt(size)
    near, far = 0.0, 0.0
    for j in range(3):
        normal = point[j] / size
        point[j] = centre[j] + radius * normal
        away = pinhole[j] - point[j]
        here -= normal * point[j]
        there += normal * away
        near += point[j] * point[j]
        far += away * away
    return here / sqrt(near) - there / sqrt(far)


@compiled
def _true(way: Floats, lens: Floats, result: Floats) -> None:
    """Fill in the true unit direction of one in the camera."""
    for j in range(3):
        result[j] = way[0] * lens[0, j] + way[1] * lens[1, j] + way[2] * lens[2, j]
    _shorten(result)


@compiled
def _shorten(vector: Floats) -> None:
    size = sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
    for j in range(3):
        vector[j] /= size


@compiled
def _square(way: Floats, beside: Floats, frame: Floats) -> None:
    """Fill in two unit vectors square to a direction, the first on a given other's side."""
    along = way[0] * beside[0] + way[1] * beside[1] + way[2] * beside[2]
    for j in range(3):
        frame[0, j] = beside[j] - along * way[j]
    _shorten(frame[0])
    for j in range(3):
        a, b = (j + 1) % 3, (j + 2) % 3
        frame[1, j] = way[a] * frame[0, b] - way[b] * frame[0, a]


@compiled
def _passes(a: Floats, b: Floats) -> bool:
    """Whether the line from a to b (2,) passes the first axis on its positive side."""
    if (a[1] > 0) == (b[1] > 0):
        return False
    return bool(a[0] + (b[0] - a[0]) * a[1] / (a[1] - b[1]) > 0)


@compiled
def _lowest(side: Floats, lens: Floats, line: Floats, radius: float) -> float:
    """Least distance squared of the rays along one side (n, 3).

    Of every COARSE-th the least, from there half as far again and again to the least of all, and
    the parabola through its neighbours.
    """
    last = len(side) - 1
    best, least = 0, inf
    for k in range(0, last + 1, COARSE):
        value = _miss(side[k], lens, line, radius)
        if value < least:
            best, least = k, value
    step = COARSE // 2
    while step > 0:
        middle = best
        for k in (middle - step, middle + step):
            if 0 <= k <= last:
                value = _miss(side[k], lens, line, radius)
                if value < least:
                    best, least = k, value
        step //= 2
    middle = min(max(best, 1), last - 1)
    before, here = (
        _miss(side[middle - 1], lens, line, radius),
        _miss(side[middle], lens, line, radius),
    )
    after = _miss(side[middle + 1], lens, line, radius)
    bend, slope = before - 2 * here + after, after - before
    if 0 < bend < inf and abs(slope) <= 2 * bend:
        least = max(min(least, here - slope * slope / (8 * bend)), 0.0)
    return least


@compiled
def _miss(side: Floats, lens: Floats, line: Floats, radius: float) -> float:
    """Distance squared from the origin of a ray after a ball; infinite where it misses the ball.

    The same where the ray goes away from the object, as in ball_miss_distances of tbcad.optics.
    """
    x = side[0] * lens[0, 0] + side[1] * lens[1, 0] + side[2] * lens[2, 0]
    y = side[0] * lens[0, 1] + side[1] * lens[1, 1] + side[2] * lens[2, 1]
    z = side[0] * lens[0, 2] + side[1] * lens[1, 2] + side[2] * lens[2, 2]
    size = sqrt(x * x + y * y + z * z)
    x, y, z = x / size, y / size, z / size
    ax, ay, az = line[0, 0] - line[1, 0], line[0, 1] - line[1, 1], line[0, 2] - line[1, 2]
    along = -(ax * x + ay * y + az * z)
    root = radius * radius - (ax * ax + ay * ay + az * az) + along * along
    if root < 0:
        return inf
    reach = along - sqrt(root)
    nx, ny, nz = (ax + reach * x) / radius, (ay + reach * y) / radius, (az + reach * z) / radius
    slope = 2 * (nx * x + ny * y + nz * z)
    px, py, pz = line[0, 0] + reach * x, line[0, 1] + reach * y, line[0, 2] + reach * z
    ahead = px * (x - slope * nx) + py * (y - slope * ny) + pz * (z - slope * nz)
    return inf if ahead > 0 else px * px + py * py + pz * pz - ahead * ahead

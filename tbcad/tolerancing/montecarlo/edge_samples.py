"""Rays through evenly spaced points of an edge, all of an edge at once: compiled.

The samples lie side by side in one array, quantity after quantity, so that the loops over them
become vector instructions of the processor. The points are those of both mirrors at the edge.
"""

from math import sqrt

from tbcad.common.compiled import compiled_part
from tbcad.core.geometry.loop_vectors import Vector, cross, dot, minus, plus_scaled, vector
from tbcad.tolerancing.montecarlo.visible_edges import (
    APEX,
    BEND,
    CURVATURE,
    NORMAL,
    OUTWARD,
    START,
    TANGENT,
)
from tbcad.types import Floats

# Samples of an edge, and places from one quantity of the samples to the next.
SAMPLES = 9
STRIDE = 16
# Quantities of three numbers: the point before its shell is scaled, and after; the ray to it; the
# ray that is reflected there, and its moment about the object's centre.
POINT, SCALED, RAY, REFLECTED, MOMENT = (3 * k * STRIDE for k in range(5))
# Quantities of one number: the reflected ray's distance squared from the object's centre, its
# place on the screen.
DISTANCE, SCREEN_X, SCREEN_Y = (k * STRIDE for k in range(15, 18))
# Of each of an edge's faces: its normal at the point, of three numbers, and its waviness there.
FIRST_NORMAL, SECOND_NORMAL = 18 * STRIDE, 21 * STRIDE
FIRST_HEIGHT, SECOND_HEIGHT = 24 * STRIDE, 25 * STRIDE
PLACES = 26 * STRIDE
# Rows of a view; axes of a screen.
PINHOLE, OBJECT, SCALE = 0, 1, 2
VALLEY = 3  # radius of the fillets in the valleys, and nothing in its other two places
FIRST_AXIS, SECOND_AXIS, FACING = 0, 1, 2
# A parabola falls below its minimum sample by an eighth of the rise to the samples beside it at
# most. The distance squared along an edge is smooth; four times as much is certain.
MAX_FALL = 0.5


@compiled_part
def get_sample(samples: Floats, quantity: int, s: int) -> Vector:
    """A quantity of three numbers at a sample."""
    first = quantity + s
    return samples[first], samples[first + STRIDE], samples[first + 2 * STRIDE]


@compiled_part
def put_sample(samples: Floats, quantity: int, s: int, value: Vector) -> None:
    """Fill in a quantity of three numbers at a sample."""
    first = quantity + s
    samples[first], samples[first + STRIDE], samples[first + 2 * STRIDE] = value


@compiled_part
def sample_points(edge: Floats, low: float, high: float, view: Floats, samples: Floats) -> None:
    """Fill in points of an edge (`find_edge`), and rays to them, from parameter low to high."""
    start, tangent, outward = vector(edge, START), vector(edge, TANGENT), vector(edge, OUTWARD)
    bend, scale, pinhole = edge[BEND], vector(view[SCALE]), vector(view[PINHOLE])
    for s in range(SAMPLES):
        t = low + (high - low) * s / (SAMPLES - 1)
        w = 1 + bend * bend * t * t / 4
        chord = plus_scaled(start, t / w, tangent)
        point = plus_scaled(chord, -bend * t * t / 2 / w, outward)
        put_sample(samples, POINT, s, point)
        point = (point[0] * scale[0], point[1] * scale[1], point[2] * scale[2])
        put_sample(samples, SCALED, s, point)
        put_sample(samples, RAY, s, minus(point, pinhole))


@compiled_part
def touch_samples(surface: Floats, view: Floats, samples: Floats) -> None:
    """Fill in where a ball about each point touches the mirror that a surface (7,) is beside.

    The points are centres of a ball as large as the valleys' fillets, and the surface is the
    mirror's, moved out by the ball's radius. Points stay; rays are to where the ball touches.
    """
    apex, normal, curvature = vector(surface, APEX), vector(surface, NORMAL), surface[CURVATURE]
    radius, scale, pinhole = view[VALLEY, 0], vector(view[SCALE]), vector(view[PINHOLE])
    for s in range(SAMPLES):
        centre = get_sample(samples, POINT, s)
        gradient = plus_scaled(normal, curvature, minus(centre, apex))
        point = plus_scaled(centre, -radius / sqrt(dot(gradient, gradient)), gradient)
        point = (point[0] * scale[0], point[1] * scale[1], point[2] * scale[2])
        put_sample(samples, SCALED, s, point)
        put_sample(samples, RAY, s, minus(point, pinhole))


@compiled_part
def reflect_samples(surface: Floats, view: Floats, samples: Floats) -> None:
    """Fill in the rays that a surface (7,) reflects at the points, their moments and distances."""
    apex, normal, curvature = vector(surface, APEX), vector(surface, NORMAL), surface[CURVATURE]
    scale, middle = vector(view[SCALE]), vector(view[OBJECT])
    for s in range(SAMPLES):
        gradient = plus_scaled(normal, curvature, minus(get_sample(samples, POINT, s), apex))
        reflect_sample(gradient, scale, middle, samples, s)


@compiled_part
def reflect_sample(
    gradient: Vector, scale: Vector, middle: Vector, samples: Floats, s: int
) -> None:
    """Fill in the ray that is reflected at a sample with point and ray, its moment and distance.

    The gradient, of any length, is of the surface before its shell is scaled along each axis; the
    middle is the object's centre. Scale and middle are no arrays, which what is filled in might
    change: loops over samples would not become vectors.
    """
    across = (gradient[0] / scale[0], gradient[1] / scale[1], gradient[2] / scale[2])
    ray = get_sample(samples, RAY, s)
    # Neither the normal nor the ray has to be of unit length.
    out = plus_scaled(ray, -(2 * dot(ray, across) / dot(across, across)), across)
    moment = cross(minus(get_sample(samples, SCALED, s), middle), out)
    put_sample(samples, REFLECTED, s, out)
    put_sample(samples, MOMENT, s, moment)
    samples[DISTANCE + s] = dot(moment, moment) / dot(out, out)


@compiled_part
def screen_crossings(screen: Floats, samples: Floats) -> int:
    """How often the reflected line on a screen crosses the positive half of its first axis.

    A ray is not followed to the screen, which it may meet far away or never. It is turned about the
    object's centre, by the smallest angle, until it is square to the screen. That takes a moment
    M of a ray d to M + (M . u) / (|d| - d . u) (d - |d| u), with u the screen's normal; where the
    turned ray meets the screen is that moment turned by a right angle. Its scale does not matter.
    """
    facing = vector(screen[FACING])
    first, second = vector(screen[FIRST_AXIS]), vector(screen[SECOND_AXIS])
    for s in range(SAMPLES):
        out, moment = get_sample(samples, REFLECTED, s), get_sample(samples, MOMENT, s)
        against, along = sqrt(dot(out, out)) - dot(out, facing), dot(moment, facing)
        samples[SCREEN_X + s] = against * dot(moment, second) + along * dot(out, second)
        samples[SCREEN_Y + s] = -against * dot(moment, first) - along * dot(out, first)
    count = 0
    for s in range(SAMPLES - 1):
        a, b = SCREEN_X + s, SCREEN_Y + s
        count += crosses_half_axis(samples[a], samples[b], samples[a + 1], samples[b + 1])
    return count


@compiled_part
def crosses_half_axis(x: float, y: float, next_x: float, next_y: float) -> bool:
    """Whether the line between two points crosses the positive half of the first axis."""
    if (y > 0) == (next_y > 0):
        return False
    return bool(x + y / (y - next_y) * (next_x - x) > 0)


@compiled_part
def least_sample(samples: Floats) -> int:
    """Number of the sample with the minimum distance."""
    least = 0
    for s in range(1, SAMPLES):
        if samples[DISTANCE + s] < samples[DISTANCE + least]:
            least = s
    return least


@compiled_part
def lower_bound(samples: Floats, least: int) -> float:
    """Lower bound of the squared distance between the samples; `least`: see `least_sample`."""
    distances = samples[DISTANCE:]
    bound: float = distances[least] - MAX_FALL * rise_beside(distances, SAMPLES, least)
    return bound


@compiled_part
def rise_beside(values: Floats, count: int, least: int) -> float:
    """Rise from the minimum of even samples to the greater of the two samples nearest to it."""
    first = min(max(least - 1, 0), count - 3)
    rise: float = max(values[first], values[first + 1], values[first + 2]) - values[least]
    return rise


@compiled_part
def parabola_minimum(samples: Floats) -> float:
    """Minimum of the distances squared, on the parabola through its neighbours."""
    best = least_sample(samples)
    minimum: float = samples[DISTANCE + best]
    if best in (0, SAMPLES - 1):
        return minimum
    before, after = samples[DISTANCE + best - 1], samples[DISTANCE + best + 1]
    bend, slope = before - 2 * minimum + after, after - before
    return max(minimum - (slope * slope / (8 * bend) if bend > 0 else 0.0), 0.0)

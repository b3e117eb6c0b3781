"""Form errors within a mirror: waviness as Zernike terms over its cell, and what it costs.

The terms have the orders 2 to 4 (defocus, astigmatism; coma, trefoil; spherical aberration and the
rest), each with a root mean square of 1 over the unit disc (Noll, J. Opt. Soc. Am. 66 (1976) 207).
The disc about the apex that holds a mirror's cell is the unit disc. Orders 0 and 1 move and turn a
mirror; that is what errors of its sphere do.

The surface of a mirror with waviness is where the value of its sphere (tbcad.core.optics.surfaces),
whose gradient is of unit length there, equals the height h of the waviness. An edge of two mirrors
whose spheres have the unit normals g and g' at a point is thus displaced by a g + b g' with

    a + b (g . g') = h,    a (g . g') + b = h',

to first order in the heights, and a mirror's normal is turned by its height's gradient.
"""

from math import sqrt
from typing import TypeAlias

import numpy as np

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.core.geometry.loop_vectors import Vector, dot, minus, plus_scaled, vector
from tbcad.core.optics.sphere_forms import FIRST, HEIGHT, PER_MM, SECOND
from tbcad.core.optics.zernike import ORDERS, TERMS
from tbcad.tolerancing.montecarlo.edge_samples import (
    FIRST_HEIGHT,
    FIRST_NORMAL,
    OBJECT,
    PINHOLE,
    POINT,
    RAY,
    SAMPLES,
    SCALE,
    SCALED,
    SECOND_HEIGHT,
    SECOND_NORMAL,
    get_sample,
    put_sample,
    reflect_sample,
)
from tbcad.tolerancing.montecarlo.visible_edges import APEX, CURVATURE, NORMAL
from tbcad.types import Floats

VARIANCE_RATIO = 0.5  # from order to order of waviness, which falls with frequency: a judgement

ASTIGMATISM = tuple(k for k, (n, m) in enumerate(TERMS) if (n, abs(m)) == (2, 2))
Form: TypeAlias = tuple[float, ...]
SMALLEST_SINE_SQUARED = 1e-4  # surfaces that meet at a smaller angle have no edge to be found


def term_shares() -> Floats:
    """Share of each term in the variance of the waviness, (t,); they add up to 1."""
    orders = np.array([n for n, _ in TERMS])
    of_order = VARIANCE_RATIO ** (orders - ORDERS[0]) / (orders + 1)
    return np.asarray(of_order / of_order.sum())


def mean_square_slope() -> float:
    """Mean over the unit disc of the squared slope of a waviness whose root mean square is 1.

    Of a term it is (n + 1) (n (n + 2) - m^2), by Green's first identity: the term's Laplacian is
    orthogonal to it, and its radial part is 1 at the rim, with a slope of (n (n + 2) - m^2) / 2.
    Each of the n + 1 terms of an order has the same share of the order's variance.
    """
    variance = {n: VARIANCE_RATIO ** (n - ORDERS[0]) for n in ORDERS}
    total = sum(variance[n] * (n * (n + 2) - m * m) for n, m in TERMS)
    return total / sum(variance.values())


def ray_spread(waviness: float, cell_radius: Floats, distance: Floats, incidence: Floats) -> Floats:
    """RMS over a mirror (m,) of how far waviness displaces its rays at the object, mm.

    A normal that is turned by e turns the ray by 2 e in the plane of incidence and by 2 e cos i
    across it; both have half of the squared slope. Cells lie in a disc of a radius; distances are
    from the object's centre; angles of incidence are those at the apices.
    """
    slope = waviness * sqrt(mean_square_slope()) / cell_radius
    turned: Floats = 2 * slope * np.sqrt((1 + np.cos(incidence) ** 2) / 2)
    return turned * distance


@compiled_loop
def form_numbers(form: Floats) -> Form:
    """The columns of one mirror's form: read once, so that loops over samples become vectors."""
    f = form
    return (
        f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8], f[9], f[10],
        f[11], f[12], f[13], f[14], f[15], f[16], f[17], f[18], f[19], f[20], f[21],
    )  # fmt: skip


@compiled_part
def _axes(form: Form) -> tuple[Vector, Vector]:
    first = form[FIRST], form[FIRST + 1], form[FIRST + 2]
    return first, (form[SECOND], form[SECOND + 1], form[SECOND + 2])


@compiled_part
def place_in_cell(form: Form, offset: Vector) -> tuple[float, float]:
    """Coordinates x and y of a point at an offset from the apex."""
    unit = form[PER_MM]
    first, second = _axes(form)
    return unit * dot(first, offset), unit * dot(second, offset)


@compiled_loop
def height(form: Form, offset: Vector) -> float:
    """Height of the waviness, mm."""
    x, y = place_in_cell(form, offset)
    f = form[HEIGHT:]
    fourth = (((f[10] * x + f[11] * y) * x + f[12] * y * y) * x + f[13] * y * y * y) * x
    third = ((f[6] * x + f[7] * y) * x + f[8] * y * y) * x + f[9] * y * y * y
    second = (f[3] * x + f[4] * y) * x + f[5] * y * y
    value: float = f[0] + f[1] * x + f[2] * y + second + third + fourth + f[14] * y * y * y * y
    return value


@compiled_loop
def slope(form: Form, offset: Vector) -> Vector:
    """Gradient of the height in space."""
    x, y = place_in_cell(form, offset)
    f = form[HEIGHT:]
    along = f[1] + 2 * f[3] * x + f[4] * y + (3 * f[6] * x + 2 * f[7] * y) * x + f[8] * y * y
    along += ((4 * f[10] * x + 3 * f[11] * y) * x + 2 * f[12] * y * y) * x + f[13] * y * y * y
    across = f[2] + f[4] * x + 2 * f[5] * y + (f[7] * x + 2 * f[8] * y) * x + 3 * f[9] * y * y
    across += ((f[11] * x + 2 * f[12] * y) * x + 3 * f[13] * y * y) * x + 4 * f[14] * y * y * y
    unit, (first, second) = form[PER_MM], _axes(form)
    return (
        unit * (along * first[0] + across * second[0]),
        unit * (along * first[1] + across * second[1]),
        unit * (along * first[2] + across * second[2]),
    )


@compiled_part
def displace_samples(
    view: Floats, surfaces: Floats, forms: Floats, faces: tuple[int, int], samples: Floats
) -> None:
    """Displace points of an edge of two faces, and rays to them, by the faces' forms."""
    scale, pinhole = vector(view[SCALE]), vector(view[PINHOLE])
    _put_face(surfaces[faces[0]], forms[faces[0]], samples, FIRST_NORMAL, FIRST_HEIGHT)
    _put_face(surfaces[faces[1]], forms[faces[1]], samples, SECOND_NORMAL, SECOND_HEIGHT)
    for s in range(SAMPLES):
        first, second = get_sample(samples, FIRST_NORMAL, s), get_sample(samples, SECOND_NORMAL, s)
        above, other_above = samples[FIRST_HEIGHT + s], samples[SECOND_HEIGHT + s]
        cosine = dot(first, second)
        sine_squared = max(1 - cosine * cosine, SMALLEST_SINE_SQUARED)
        point = get_sample(samples, POINT, s)
        point = plus_scaled(point, (above - cosine * other_above) / sine_squared, first)
        point = plus_scaled(point, (other_above - cosine * above) / sine_squared, second)
        put_sample(samples, POINT, s, point)
        point = (point[0] * scale[0], point[1] * scale[1], point[2] * scale[2])
        put_sample(samples, SCALED, s, point)
        put_sample(samples, RAY, s, minus(point, pinhole))


@compiled_part
def _put_face(surface: Floats, form: Floats, samples: Floats, normals: int, heights: int) -> None:
    apex, normal, curvature = vector(surface, APEX), vector(surface, NORMAL), surface[CURVATURE]
    numbers = form_numbers(form)
    for s in range(SAMPLES):
        offset = minus(get_sample(samples, POINT, s), apex)
        put_sample(samples, normals, s, plus_scaled(normal, curvature, offset))
        samples[heights + s] = height(numbers, offset)


@compiled_part
def reflect_formed_samples(surface: Floats, form: Floats, view: Floats, samples: Floats) -> None:
    """As `reflect_samples`, for a mirror with waviness."""
    apex, normal, curvature = vector(surface, APEX), vector(surface, NORMAL), surface[CURVATURE]
    scale, middle = vector(view[SCALE]), vector(view[OBJECT])
    numbers = form_numbers(form)
    for s in range(SAMPLES):
        offset = minus(get_sample(samples, POINT, s), apex)
        gradient = plus_scaled(normal, curvature, offset)
        reflect_sample(minus(gradient, slope(numbers, offset)), scale, middle, samples, s)

"""Form errors within a mirror: waviness as Zernike terms over its cell, and what it costs.

The terms have the orders 2 to 4 (defocus, astigmatism; coma, trefoil; spherical aberration and the
rest), each with a root mean square of 1 over the unit disc (Noll, J. Opt. Soc. Am. 66 (1976) 207).
The disc about the apex that holds a mirror's cell is the unit disc. Orders 0 and 1 move and turn a
mirror; that is what errors of its sphere do.
"""

from math import factorial, sqrt

import numpy as np

from tbcad.types import Floats

ORDERS = (2, 3, 4)
# A surface's waviness falls with its frequency; judgement: by half in variance from order to order.
VARIANCE_RATIO = 0.5
DEGREE = ORDERS[-1]
# Powers of x and y, in the order of the columns of a polynomial.
MONOMIALS = tuple((d - j, j) for d in range(DEGREE + 1) for j in range(d + 1))
# Orders and azimuthal numbers of the terms: cosines have positive numbers, sines negative ones.
TERMS = tuple((n, m) for n in ORDERS for m in range(-n, n + 1, 2))

ASTIGMATISM = tuple(k for k, (n, m) in enumerate(TERMS) if (n, abs(m)) == (2, 2))


def term_shares() -> Floats:
    """Share of each term in the variance of the waviness, (t,); they add up to 1."""
    orders = np.array([n for n, _ in TERMS])
    of_order = VARIANCE_RATIO ** (orders - ORDERS[0]) / (orders + 1)
    return np.asarray(of_order / of_order.sum())


def term_polynomials() -> Floats:
    """Coefficients of each term, (t, monomials)."""
    return np.array([_row(_term(n, m)) for n, m in TERMS])


def monomials(x: Floats, y: Floats) -> Floats:
    """Powers of places (p,) in the unit disc, (p, monomials)."""
    return np.stack([x**i * y**j for i, j in MONOMIALS], axis=-1)


def _term(n: int, m: int) -> Floats:
    """Coefficients of x^i y^j of one Zernike polynomial, (degree + 1, degree + 1)."""
    size, result = abs(m), np.zeros((DEGREE + 1, DEGREE + 1))
    around = np.zeros_like(result)
    for j in range(size + 1):  # real or imaginary part of (x + i y)^|m|
        power = factorial(size) // (factorial(j) * factorial(size - j)) * 1j**j
        around[size - j, j] = power.real if m >= 0 else power.imag
    for k in range((n - size) // 2 + 1):
        radial = (-1) ** k * factorial(n - k) / factorial(k)
        radial /= factorial((n + size) // 2 - k) * factorial((n - size) // 2 - k)
        result += radial * _times_radius(around, (n - size) // 2 - k)
    return np.asarray(result * sqrt((n + 1) * (1 if m == 0 else 2)))


def _times_radius(polynomial: Floats, times: int) -> Floats:
    """A polynomial times (x^2 + y^2)^times."""
    for _ in range(times):
        product = np.zeros_like(polynomial)
        product[2:] += polynomial[:-2]
        product[:, 2:] += polynomial[:, :-2]
        polynomial = product
    return polynomial


def _row(table: Floats) -> Floats:
    return np.array([table[i, j] for i, j in MONOMIALS])


def mean_square_slope() -> float:
    """Mean over the unit disc of the squared slope of a waviness whose root mean square is 1.

    Of one term it is 2 pi times the integral of (R' r)^2 / r ..., summed in closed form: the mean
    of x^i y^j over the disc is (i - 1)!! (j - 1)!! 2 / ((i + j + 2) (i + j)!!) for even i and j.
    """
    total = 0.0
    for share, row in zip(term_shares(), term_polynomials(), strict=True):
        for axis in range(2):
            total += share * _mean_square(_derivative(row, axis))
    return total


def _derivative(row: Floats, axis: int) -> dict[tuple[int, int], float]:
    result: dict[tuple[int, int], float] = {}
    for powers, factor in zip(MONOMIALS, row, strict=True):
        if powers[axis]:
            lower = (powers[0] - 1, powers[1]) if axis == 0 else (powers[0], powers[1] - 1)
            result[lower] = float(powers[axis] * factor)
    return result


def _mean_square(polynomial: dict[tuple[int, int], float]) -> float:
    return sum(
        a * b * _mean_power(i + k, j + n)
        for (i, j), a in polynomial.items()
        for (k, n), b in polynomial.items()
    )


def _mean_power(i: int, j: int) -> float:
    """Mean of x^i y^j over the unit disc."""
    if i % 2 or j % 2:
        return 0.0
    double = _double_factorial(i - 1) * _double_factorial(j - 1) / _double_factorial(i + j)
    return 2 * double / (i + j + 2)


def _double_factorial(n: int) -> int:
    return 1 if n < 2 else n * _double_factorial(n - 2)


def ray_spread(waviness: float, cell_radius: Floats, distance: Floats, incidence: Floats) -> Floats:
    """RMS over a mirror (m,) of how far waviness displaces its rays at the object, mm.

    A normal that is turned by e turns the ray by 2 e in the plane of incidence and by 2 e cos i
    across it; both have half of the squared slope. Cells lie in a disc of a radius; distances are
    from the object's centre; angles of incidence are those at the apices.
    """
    slope = waviness * sqrt(mean_square_slope()) / cell_radius
    turned: Floats = 2 * slope * np.sqrt((1 + np.cos(incidence) ** 2) / 2)
    return turned * distance

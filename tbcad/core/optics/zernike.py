"""Zernike polynomials of the orders 2 to 4 as polynomials of x and y in the unit disc.

Each has a root mean square of 1 over the disc (Noll, J. Opt. Soc. Am. 66 (1976) 207).
"""

from math import comb, factorial, sqrt

import numpy as np

from tbcad.types import Floats

ORDERS = (2, 3, 4)
DEGREE = ORDERS[-1]
# Powers of x and y, in the order of the columns of a polynomial.
MONOMIALS = tuple((d - j, j) for d in range(DEGREE + 1) for j in range(d + 1))
# Orders and azimuthal numbers of the terms: cosines have positive numbers, sines negative ones.
TERMS = tuple((n, m) for n in ORDERS for m in range(-n, n + 1, 2))


def term_polynomials() -> Floats:
    """Coefficients of each term, (t, monomials)."""
    tables = (_term(n, m) for n, m in TERMS)
    return np.array([[table[powers] for powers in MONOMIALS] for table in tables])


def monomials(x: Floats, y: Floats) -> Floats:
    """Powers of places (p,) in the unit disc, (p, monomials)."""
    return np.stack([x**i * y**j for i, j in MONOMIALS], axis=-1)


def _term(n: int, m: int) -> Floats:
    """Coefficients of x^i y^j of one Zernike polynomial, (degree + 1, degree + 1)."""
    size, result = abs(m), np.zeros((DEGREE + 1, DEGREE + 1))
    for k in range((n - size) // 2 + 1):
        squares = (n - size) // 2 - k  # power of x^2 + y^2
        radial = (-1) ** k * factorial(n - k) / factorial(k)
        radial /= factorial((n + size) // 2 - k) * factorial(squares)
        for j in range(size + 1):  # real or imaginary part of (x + i y)^|m|
            around = comb(size, j) * 1j**j
            for i in range(squares + 1):
                place = size - j + 2 * (squares - i), j + 2 * i
                part = around.real if m >= 0 else around.imag
                result[place] += radial * comb(squares, i) * part
    return np.asarray(result * sqrt((n + 1) * (1 if m == 0 else 2)))

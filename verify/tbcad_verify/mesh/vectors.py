"""Arithmetic on columns of vectors, shape (3, N), without BLAS: same bits for any thread count."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tbcad_verify.types import Floats


def dot(a: Floats, b: Floats) -> Floats:
    """(N,) scalar products of columns."""
    return np.asarray(np.einsum("in,in->n", a, b))


def norm(a: Floats) -> Floats:
    """(N,) lengths of columns."""
    return np.asarray(np.sqrt(dot(a, a)))


def unit(a: Floats) -> Floats:
    """(3, N) columns at unit length; zero stays zero."""
    return np.asarray(a / np.maximum(norm(a), np.finfo(np.float64).tiny))


def cross(a: Floats, b: Floats) -> Floats:
    """(3, N) vector products of columns."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def chunks(count: int, step: int = 1 << 17) -> Iterator[slice]:
    """Consecutive pieces of `count` columns, so that intermediate results stay small."""
    return (slice(k, min(k + step, count)) for k in range(0, count, step))


def tangent_basis(n: Floats) -> tuple[Floats, Floats]:
    """Two unit columns at right angles to unit columns n and to each other.

    Source: T. Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017.
    """
    sign = np.copysign(1.0, n[2])
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    first = np.stack([1 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]])
    return first, np.stack([b, sign + n[1] ** 2 * a, -n[1]])

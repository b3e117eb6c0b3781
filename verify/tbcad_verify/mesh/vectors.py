"""Columns of vectors, shape (3, N), without BLAS: same bits for any thread count."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.types import Floats

Columns = TypeVar("Columns")


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


def take(columns: Columns, index: NDArray[Any]) -> Columns:
    """Some columns of a dataclass of arrays (..., N), and of those within it, by number or mask."""

    def some(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return np.take(value, numbers, axis=-1)
        return type(value)(*(some(getattr(value, field.name)) for field in fields(value)))

    numbers = np.flatnonzero(index) if index.dtype == np.bool_ else index
    return cast(Columns, some(columns))


def joined(parts: Sequence[Columns]) -> Columns:
    """The columns of several dataclasses of arrays (..., N), end to end."""

    def end_to_end(values: Sequence[Any]) -> Any:
        if isinstance(values[0], np.ndarray):
            return np.concatenate(values, axis=-1)
        names = [field.name for field in fields(values[0])]
        columns = (end_to_end([getattr(value, name) for value in values]) for name in names)
        return type(values[0])(*columns)

    return cast(Columns, end_to_end(parts))


def tangent_basis(n: Floats) -> tuple[Floats, Floats]:
    """Two unit columns at right angles to unit columns n and to each other.

    Source: T. Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017.
    """
    sign = np.copysign(1.0, n[2])
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    first = np.stack([1 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]])
    return first, np.stack([b, sign + n[1] ** 2 * a, -n[1]])


def nearest_on_lines(
    point: Floats, direction: Floats, first: float | Floats = -np.inf, last: float | Floats = np.inf
) -> Floats:
    """(3, N) the points of lines point + t direction that are nearest to the origin.

    `point`: (3, N) or (3, 1).
    `direction`: (3, N) of any length.
    `first`: smallest t, (N,) or one for all.
    """
    t = -dot(point, direction) / dot(direction, direction)
    return np.asarray(point + np.clip(t, first, last) * direction)


def crossings(point: Floats, direction: Floats, normal: Floats) -> Floats:
    """(3, N) the points where lines cross the planes through the origin with these normals."""
    return np.asarray(point - dot(point, normal) / dot(direction, normal) * direction)


def distances_to_segments(x: Floats, start: Floats, end: Floats) -> Floats:
    """(N,) distances of points x from segments start - end, (3, N) each."""
    edge = end - start
    t = dot(x - start, edge) / np.maximum(dot(edge, edge), np.finfo(np.float64).tiny)
    return norm(x - start - np.clip(t, 0, 1) * edge)


def rotation_angles(axis: Floats, start: Floats, end: Floats) -> Floats:
    """(N,) angles by which `end` is rotated from `start` about unit axes, -pi ... pi.

    Over a closed path about the axis they add up to 2 pi times its winding number.
    """
    first, second = tangent_basis(axis)
    before, after = (np.arctan2(dot(x, second), dot(x, first)) for x in (start, end))
    return wrapped(after - before)


def wrapped(angle: Floats) -> Floats:
    """Angles in -pi ... pi."""
    return np.asarray(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


def axis_frame(pinhole: Floats) -> Floats:
    """(3, 3) rows: unit axis from the origin to the pinhole, azimuth zero (the zenith's), third."""
    axis = pinhole / np.sqrt((pinhole**2).sum())
    up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    up /= np.sqrt((up**2).sum())
    return np.stack([axis, up, np.cross(axis, up)])


def polar_and_azimuth(frame: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Polar angles and azimuths (N,) of directions d (3, N), radians."""
    along, zero, third = (dot(np.broadcast_to(row[:, None], d.shape), d) for row in frame)
    return np.arctan2(np.hypot(zero, third), along), np.arctan2(third, zero)

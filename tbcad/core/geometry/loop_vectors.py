"""Vectors of three as tuples in compiled loops, where small arrays would be slow."""

from math import sqrt
from typing import TypeAlias

from tbcad.common.compiled import compiled_part
from tbcad.types import Floats

Vector: TypeAlias = tuple[float, float, float]


@compiled_part
def vector(row: Floats, first: int = 0) -> Vector:
    """Three numbers of a row, from a column on."""
    return row[first], row[first + 1], row[first + 2]


@compiled_part
def dot(a: Vector, b: Vector) -> float:
    """A . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled_part
def cross(a: Vector, b: Vector) -> Vector:
    """A x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled_part
def minus(a: Vector, b: Vector) -> Vector:
    """A - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled_part
def plus_scaled(a: Vector, factor: float, b: Vector) -> Vector:
    """A + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@compiled_part
def scaled(factor: float, a: Vector) -> Vector:
    """Factor a."""
    return factor * a[0], factor * a[1], factor * a[2]


@compiled_part
def divided(a: Vector, by: float) -> Vector:
    """A / by."""
    return a[0] / by, a[1] / by, a[2] / by


@compiled_part
def unit(a: Vector) -> Vector:
    """A / |a|."""
    return divided(a, sqrt(dot(a, a)))


@compiled_part
def reflect(ray: Vector, normal: Vector) -> Vector:
    """A ray of any length after a mirror with a unit normal."""
    return plus_scaled(ray, -2 * dot(ray, normal), normal)

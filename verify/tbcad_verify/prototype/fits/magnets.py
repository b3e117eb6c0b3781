"""Pull of a disc magnet on a steel ball or on another disc magnet, by rings of magnetic charge.

The faces of a magnet are discs of charge of density Br / mu0; each is divided into rings. What a
steel ball answers to a ring is its image in the ball, a smaller ring of the opposite charge, and
the same charge at the centre: Kelvin's inversion. The field of a ring is a complete elliptic
integral.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import ellipe

from tbcad_verify.types import Floats

MU_0 = 4e-7 * np.pi
REMANENCE_T = 1.29  # least of the grade N42
DERATING = 0.75  # catalogues have 0.78 to 0.99 of the ideal pull on steel plate
RINGS_PER_GAP, MIN_RINGS, MAX_RINGS = 8.0, 48, 400
PASCAL_MM2 = 1e-6

Rings = tuple[Floats, Floats, Floats]
"""Radii, places along the axis, charges over the density, of n rings, mm, mm, mm^2."""


def pull_on_ball(ball: float, gap: float, magnet: float, height: float) -> float:
    """Pull, N, between a ball of a radius and a magnet of a radius and height at a gap, mm."""
    faces = _magnet(magnet, height, ball + gap, gap)
    return DERATING * _force(_images(faces, ball), faces)


def pull_of_pair(one: float, two: float, gap: float, heights: tuple[float, float]) -> float:
    """Pull, N, between two magnets of radii and heights at a gap, mm."""
    first = _magnet(one, heights[0], -heights[0], gap)
    second = _magnet(two, heights[1], gap, gap)
    return DERATING * _force(first, second)


def _magnet(radius: float, height: float, start: float, gap: float) -> Rings:
    """Both faces of a magnet that begins at a place on the axis: positive in front."""
    count = int(np.clip(RINGS_PER_GAP * radius / gap, MIN_RINGS, MAX_RINGS))
    node, weight = _quadrature(count)
    out = radius * (node + 1) / 2
    charge = weight * radius / 2 * 2 * np.pi * out
    place = np.concatenate([np.full(count, start), np.full(count, start + height)])
    return np.tile(out, 2), place, np.concatenate([charge, -charge])


@cache
def _quadrature(count: int) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss and Legendre: eigenvalues, slow for hundreds of nodes."""
    node, weight = np.polynomial.legendre.leggauss(count)
    return node, weight


def _images(rings: Rings, ball: float) -> Rings:
    """What a ball about the origin answers: images of the rings, and their charge at its centre."""
    radius, place, charge = rings
    away = np.hypot(radius, place)
    share = (ball / away) ** 2
    image = -charge * ball / away
    return (
        np.append(radius * share, 0.0),
        np.append(place * share, 0.0),
        np.append(image, -image.sum()),
    )


def _force(source: Rings, rings: Rings) -> float:
    """Force on rings toward the source's side of the axis, downward, N."""
    (b, low, p), (a, high, q) = ([one[:, None] for one in source], rings)
    rise = high - low
    near, far = (a - b) ** 2 + rise**2, (a + b) ** 2 + rise**2
    field = rise * ellipe(4 * a * b / far) / (near * np.sqrt(far)) / (2 * np.pi**2)
    total = float((p * q * field).sum())
    return -total * REMANENCE_T**2 / MU_0 * PASCAL_MM2

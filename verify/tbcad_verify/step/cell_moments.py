"""Integrals over cells as line integrals along their arcs, the same for spheres and planes.

With d = x - p, n = N + k d and m = |d|^2 = -2 N.d / k, by Stokes on the surface:

    integral of d_x dA = 1 / 2 loop integral of m dd_y,   and -dd_x for d_y.

For the rest, with w = 1 - k^2 m / 4 and the map's polar angle theta about the apex, integrate
along the radius of the map (Green); with tau = d_x dd_y - d_y dd_x = (w |y|)^2 dtheta:

    area: tau / 2w,   m: m tau / 4w.

Nothing divides by k, so nearly flat mirrors lose no digits.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tbcad_verify.mesh.vectors import chunks
from tbcad_verify.step.map_arcs import MapArcs
from tbcad_verify.step.stereographic import SurfaceMaps
from tbcad_verify.types import Floats

NODES = 20
MAX_PIECES = 64


def cell_moments(maps: SurfaceMaps, arcs: MapArcs) -> tuple[Floats, Floats]:
    """Integrals over the cells of M maps by Gauss-Legendre quadrature along their arcs.

    Returns:
        Area (M,), mm^2, and first moment (3, M) of d = x - p about each mirror's apex p, in its own
        axes right, up, normal, mm^3.
    """
    k = maps.surfaces.curvature
    total = np.zeros((4, len(k)))
    for part in chunks(len(arcs.mirror), 1 << 13):
        pieces = _pieces(arcs.take(np.arange(len(arcs.mirror))[part]), k)
        values = _line_integrals(pieces, k[pieces.mirror])
        total += [np.bincount(pieces.mirror, value, minlength=len(k)) for value in values]
    area, x, y, m = total
    return area, np.stack([x, y, -k / 2 * m])


def _pieces(arcs: MapArcs, k: Floats) -> MapArcs:
    """Arcs cut so that each turns by 90 degrees at most and is short where the integrands vary."""
    nearest = np.clip(0, *arcs.s)
    square = (arcs.point(nearest) ** 2).sum(axis=0)
    pole = np.hypot(2, k[arcs.mirror] * np.sqrt(square))  # k times the distance to the pole of w
    share = arcs.length * np.maximum(np.abs(arcs.bend) * 2 / np.pi, k[arcs.mirror] / pole)
    count = np.clip(np.ceil(share), 1, MAX_PIECES).astype(np.intp)
    index = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    start = arcs.s[0, index] + arcs.length[index] * step / count[index]
    end = arcs.s[0, index] + arcs.length[index] * (step + 1) / count[index]
    cut = arcs.take(index)
    return replace(cut, s=np.stack([start, end]))


def _line_integrals(pieces: MapArcs, k: Floats) -> Floats:
    """(4, N): area, and integrals of x, y, m."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    total = np.zeros((4, len(k)))
    for node, weight in zip(nodes.tolist(), weights.tolist(), strict=True):
        s = pieces.s[0] + pieces.length * (1 + node) / 2
        total += weight / 2 * pieces.length * _integrands(pieces.point(s), pieces.direction(s), k)
    return total


def _integrands(y: Floats, along: Floats, k: Floats) -> Floats:
    """(4, N) per mm of the map's arcs, at points y (2, N) that move along `along` (2, N)."""
    square = y[0] ** 2 + y[1] ** 2
    w = 1 / (1 + k**2 * square / 4)
    crossed = y[0] * along[1] - y[1] * along[0]
    growth = -(k**2) / 2 * w**2 * (y[0] * along[0] + y[1] * along[1])
    step, m = w * along + growth * y, w * square
    return np.stack([w * crossed / 2, m * step[1] / 2, -m * step[0] / 2, m * w * crossed / 4])

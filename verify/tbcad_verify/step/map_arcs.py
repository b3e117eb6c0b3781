"""The arcs on a map that bound what is left of a mirror.

On each circle every other circle covers an interval, in closed form. The arcs are what no interval
covers; their ends are the corners. Nothing is assumed about the number of loops of a cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.vectors import joined, take
from tbcad_verify.step.stereographic import MapCircles
from tbcad_verify.types import Floats, Ints

SAME_CIRCLE = 1e-11


@dataclass(frozen=True)
class MapArcs:
    """N arcs on maps, with the uncovered side to their left.

    A circle is followed from its point nearest the apex; an arc that passes the farthest point is
    two arcs.
    """

    mirror: Ints  # (N,) number of the map
    circle: Ints  # (N,) column of the circle
    near: Floats  # (2, N) mm, the circle's nearest point
    inward: Floats  # (2, N) unit, there, toward the uncovered side
    bend: Floats  # (N,) 1/mm, the circle's signed curvature; 0 for lines
    # (2, N) both ends, mm: twice the tangent of half the angle from `near`, over the bend
    t: Floats
    s: Floats  # (2, N) both ends, mm of arc length from `near`

    def take(self, index: NDArray[np.generic]) -> MapArcs:
        """The arcs with these numbers, or for which a mask holds."""
        return take(self, index)

    @property
    def length(self) -> Floats:
        """(N,) mm on the map."""
        return np.asarray(self.s[1] - self.s[0])

    def point(self, s: Floats) -> Floats:
        """(2, N) points of the map at arc lengths s (N,), mm."""
        ahead, aside = _turn(self.bend, s)
        return np.asarray(self.near + ahead * self.forward - aside * self.inward)

    def direction(self, s: Floats) -> Floats:
        """(2, N) unit tangents at arc lengths s (N,)."""
        angle = self.bend * s
        return np.asarray(np.cos(angle) * self.forward - np.sin(angle) * self.inward)

    @property
    def forward(self) -> Floats:
        """(2, N) unit tangents at the nearest points."""
        return np.stack([self.inward[1], -self.inward[0]])


def _turn(bend: Floats, s: Floats) -> tuple[Floats, Floats]:
    """Sin(bend s) / bend and (1 - cos(bend s)) / bend, also for bend = 0."""
    half = np.sinc(bend * s / (2 * np.pi))
    return s * np.sinc(bend * s / np.pi), bend * s**2 / 2 * half**2


def arc_length(bend: Floats, t: Floats) -> Floats:
    """Arc length for the rational parameter t, which may be infinite."""
    safe = np.where(bend == 0, 1.0, bend)
    return np.where(bend == 0, t, 2 / safe * np.arctan(safe * t / 2))


def joined_arcs(parts: list[MapArcs]) -> MapArcs:
    """All arcs of several maps in one list, which may be empty."""
    none, no = np.zeros((2, 0)), np.zeros(0, dtype=np.intp)
    return joined([MapArcs(no, no, none, none, none[0], none, none), *parts])


def free_arcs(circles: MapCircles, spread: float) -> MapArcs:
    """The arcs that no circle covers, of all maps."""
    near = _near(circles)
    inward = circles.beta + 2 * circles.alpha * near
    low, high = _covered(circles, near, inward, spread)
    start, end = _gaps(low, high)
    cut = circles.real & ~np.any(circles.covers, axis=1, keepdims=True)
    free = (end > start) & cut[..., None]
    mirror, circle, gap = np.nonzero(free)
    bend = 2 * circles.alpha[mirror, circle]
    t = np.stack([start[mirror, circle, gap], end[mirror, circle, gap]])
    pick = (slice(None), mirror, circle)
    return MapArcs(mirror, circle, near[pick], inward[pick], bend, t, arc_length(bend, t))


def _near(circles: MapCircles) -> Floats:
    """(2, M, K) the point of each circle that is nearest the apex; any if all are equally near."""
    size = np.hypot(*circles.beta)
    tiny = size < np.finfo(np.float64).eps
    toward = np.where(tiny, np.array([1.0, 0.0])[:, None, None], circles.beta)
    return np.asarray(-2 * circles.gamma / (size + 1) * toward / np.where(tiny, 1.0, size))


def form_along_circles(
    near: Floats, inward: Floats, bend: Floats, form: tuple[Floats, Floats, Floats]
) -> Floats:
    """(3, ...) alpha |y|^2 + beta . y + gamma along circles, as c0 + c1 t + c2 t^2.

    The parameter is that of `Arcs`; a factor 1 + bend^2 t^2 / 4 > 0 is left out.
    """
    alpha, beta, gamma = form
    slope = beta + 2 * alpha * near
    c0 = alpha * _dot(near, near) + _dot(beta, near) + gamma
    c1 = slope[0] * inward[1] - slope[1] * inward[0]
    c2 = c0 * bend**2 / 4 - bend / 2 * _dot(slope, inward) + alpha
    return np.stack([c0, c1, c2 + 0.0])  # + 0.0: no negative zero, whose inverse is -inf


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[0] * b[0] + a[1] * b[1])


def _covered(
    circles: MapCircles, near: Floats, inward: Floats, spread: float
) -> tuple[Floats, Floats]:
    """(M, K, 2 K) intervals of t on each circle that the others cover; none: (inf, inf)."""
    form = (circles.alpha[:, None], circles.beta[:, :, None], circles.gamma[:, None])
    c = form_along_circles(near[..., None], inward[..., None], 2 * circles.alpha[..., None], form)
    first, last = quadratic_roots(c)
    whole, free = _uncrossed(circles, inward, c, spread)
    outer = (c[2] < 0) & ~whole & ~free
    low = np.where(free, np.inf, np.where(whole | outer, -np.inf, first))
    high = np.where(free | whole, np.inf, np.where(outer, first, last))
    second = np.where(outer, last, np.inf)
    return (
        np.concatenate([low, second], axis=2),
        np.concatenate([high, np.full_like(high, np.inf)], axis=2),
    )


def _uncrossed(
    circles: MapCircles, inward: Floats, c: Floats, spread: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(M, K, K) circles that another covers completely, and those that it does not cover at all.

    Of a circle drawn twice the first keeps the arcs, and none does if only the circle is left.
    """
    index = np.arange(circles.alpha.shape[1])
    absent = ~circles.real[:, None] | (index[:, None] == index)
    size = np.abs(c) * np.array([1 / spread, 1, spread])[:, None, None, None]
    same = size.max(axis=0) < SAME_CIRCLE
    keeps = (_dot(inward[..., None], inward[:, :, None]) > 0) & (index[:, None] < index)
    none = ~(c[1] ** 2 - 4 * c[0] * c[2] > 0) & ~same
    below = c[0] / spread + c[2] * spread < 0
    free = absent | (same & keeps) | (none & ~below)
    return ~free & (same | none), free


def quadratic_roots(c: Floats) -> tuple[Floats, Floats]:
    """Both roots of c0 + c1 t + c2 t^2 (3, ...), the lesser first, infinite ones too; or NaN."""
    square = c[1] ** 2 - 4 * c[0] * c[2]
    with np.errstate(invalid="ignore", divide="ignore"):
        half = -(c[1] + np.copysign(np.sqrt(square), c[1])) / 2
        one, other = half / c[2], c[0] / half
    none = ~(square > 0)
    return (
        np.where(none, np.nan, np.minimum(one, other)),
        np.where(none, np.nan, np.maximum(one, other)),
    )


def _gaps(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """(M, K, L + 1) starts and ends of the gaps that intervals (M, K, L) leave on the line."""
    order = np.argsort(low, axis=2, kind="stable")
    low = np.take_along_axis(low, order, axis=2)
    high = np.maximum.accumulate(
        np.where(low == np.inf, -np.inf, np.take_along_axis(high, order, axis=2)), axis=2
    )
    edge = np.full((*low.shape[:2], 1), np.inf)
    start = np.concatenate([-edge, high], axis=2)
    end = np.concatenate([low, edge], axis=2)
    # Absent intervals (inf, inf) all end the last gap; only the first of them may.
    end[..., 1:] = np.where(end[..., :-1] == np.inf, -np.inf, end[..., 1:])
    return start, end

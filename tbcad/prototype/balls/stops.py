"""The plan of rotation: the fewest stops of the base at which every mirror gets its ball.

Base angle b brings ball k to azimuth alpha_k + b, so mirror i asks for b = phi_i - alpha_k. It may
be off by an angle that keeps its error of direction within the spec's limit, which gives each
mirror an interval of base angles. The fewest stops that hit all intervals are found exactly by
going through their upper ends in order.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.prototype.balls.groups import MirrorGroups
from tbcad.prototype.balls.placement import PlacementProblem
from tbcad.types import Floats, Ints

# Azimuths tried for a ball are this many to its tolerance; the balls are gone through this often.
TRIES = 4
ROUNDS = 3


@dataclass(frozen=True)
class StopRequests:
    """Base angles at which each of m mirrors may be served, apart from its ball's azimuth.

    Attributes:
        ball: that stands in, (m,).
        azimuth: of the mirror, radians, (m,).
        tolerance: by which the ball may be beside it, radians, (m,).
    """

    ball: Ints
    azimuth: Floats
    tolerance: Floats

    def low(self, k: int) -> Floats:
        """Least azimuth (k,) at which each of k balls must stand, tolerance used."""
        result = np.full(k, np.inf)
        np.minimum.at(result, self.ball, self.azimuth + self.tolerance)
        return result

    def high(self, k: int) -> Floats:
        """Largest azimuth (k,) at which each of k balls must stand, tolerance used."""
        result = np.full(k, -np.inf)
        np.maximum.at(result, self.ball, self.azimuth - self.tolerance)
        return result


@dataclass(frozen=True)
class StopPlan:
    """Stops of the base in ascending order, over s stops and m mirrors.

    Attributes:
        angle: base angle at each stop, radians, (s,).
        stop: at which each mirror is served, (m,).
        azimuth_error: azimuth of the ball less that of the mirror, radians, (m,).
        polar_error: polar angle of the ball less that of the mirror, radians, (m,).
        error: angle between the ball's direction and the mirror's, radians, (m,).
    """

    angle: Floats
    stop: Ints
    azimuth_error: Floats
    polar_error: Floats
    error: Floats

    def __len__(self) -> int:
        """Number of stops."""
        return len(self.angle)

    def mirrors(self, stop: int) -> Ints:
        """Mirrors that the balls stand in for at a stop."""
        return np.flatnonzero(self.stop == stop)


def stop_requests(groups: MirrorGroups, azimuth: Floats, error: float) -> StopRequests:
    """What the mirrors ask for.

    Args:
        groups: of the m mirrors.
        azimuth: of the mirrors, radians, (m,).
        error: of direction that a shared stop may cause, radians.
    """
    share = np.sin(error / 2) / np.maximum(np.sin(groups.polar), 1e-12)
    tolerance = 2 * np.arcsin(np.minimum(share, 1))
    return StopRequests(groups.of, azimuth, tolerance[groups.of])


def min_stabbing_points(low: Floats, high: Floats) -> tuple[Floats, Ints]:
    """The fewest points that hit all intervals [low, high] (m,).

    Returns:
        The largest place for each point, ascending, (s,), and the point that hits each interval.
    """
    order = np.argsort(high, kind="stable")
    points: list[float] = []
    which = np.empty(len(high), dtype=np.int64)
    last = -np.inf
    for i, (start, end) in zip(
        order.tolist(), zip(low[order].tolist(), high[order].tolist(), strict=True), strict=True
    ):
        if start > last:
            last = end
            points.append(end)
        which[i] = len(points) - 1
    return np.array(points), which


def azimuths_for_fewer_stops(
    task: PlacementProblem, wanted: StopRequests, azimuth: Floats
) -> Floats:
    """Azimuths (k,) moved where they are free to, so that fewer stops do; the swing stays.

    Ball after ball, each is tried at small steps over all that the others, the swing and the
    outermost azimuth leave it.
    """
    reach, far = task.reach(azimuth), task.outermost(azimuth)
    azimuth = azimuth.copy()
    step = np.zeros(len(task))
    np.maximum.at(step, wanted.ball, wanted.tolerance / TRIES)
    for _ in range(ROUNDS):
        before = azimuth.copy()
        for ball in range(len(task)):
            tried = _tried(task, azimuth, ball, step[ball], (reach, far))
            counts = np.array([_count(wanted, azimuth, ball, place) for place in tried.tolist()])
            best = np.lexsort((tried, np.round(np.abs(tried - azimuth[ball]), 9), counts))[0]
            azimuth[ball] = tried[best]
        if np.array_equal(before, azimuth):
            break
    return azimuth


def _tried(
    task: PlacementProblem, azimuth: Floats, ball: int, step: float, limits: tuple[float, float]
) -> Floats:
    """Azimuths that a ball may have while the others stay, its present one first."""
    reach, far = limits
    room = far - reach - task.edge[ball]
    low = max(task.high[ball] - reach, task.floor[ball] + reach, -room)
    high = min(task.low[ball] + reach, task.ceiling[ball] - reach, room)
    tried = np.concatenate([azimuth[[ball]], np.arange(low, high, step)])
    away = np.abs(tried[:, None] - np.delete(azimuth, ball))
    clear = (away >= np.delete(task.apart[ball], ball)).all(axis=1)
    clear[0] = True
    result: Floats = tried[clear]
    return result


def _count(wanted: StopRequests, azimuth: Floats, ball: int, place: float) -> int:
    moved = azimuth.copy()
    moved[ball] = place
    return len(min_stabbing_points(*_intervals(wanted, moved))[0])


def _intervals(wanted: StopRequests, azimuth: Floats) -> tuple[Floats, Floats]:
    """Base angles (m,) between which each mirror may be served."""
    angle = wanted.azimuth - azimuth[wanted.ball]
    return angle - wanted.tolerance, angle + wanted.tolerance


def plan_stops(
    groups: MirrorGroups, polar: Floats, wanted: StopRequests, azimuth: Floats
) -> StopPlan:
    """The stops for balls at azimuths (k,), each mirror at the one that suits it best.

    Args:
        groups: of the mirrors.
        polar: of the mirrors, radians, (m,).
        wanted: what they ask for.
        azimuth: of the balls on the base, radians, (k,).
    """
    exact = wanted.azimuth - azimuth[wanted.ball]
    angle = _middles(exact, *_intervals(wanted, azimuth))
    stop = np.abs(angle - exact[:, None]).argmin(axis=1)
    across, along = angle[stop] - exact, groups.polar[groups.of] - polar
    return StopPlan(
        angle, stop, across, along, angle_between(polar, groups.polar[groups.of], across)
    )


def _middles(exact: Floats, low: Floats, high: Floats) -> Floats:
    """The fewest stops, each in the middle of what its mirrors ask for, as far as they allow.

    No stop lies outside of the swing that the first and the last mirror need.
    """
    _, which = min_stabbing_points(low, high)
    ends = [_each(np.minimum, exact, which), _each(np.maximum, exact, which)]
    least = np.maximum(_each(np.maximum, low, which), high.min())
    most = np.minimum(_each(np.minimum, high, which), low.max())
    most = np.maximum(least, most)  # equal but for rounding where one stop suits all
    angle: Floats = np.clip((ends[0] + ends[1]) / 2, least, most)
    return angle


def _each(extreme: np.ufunc, values: Floats, which: Ints) -> Floats:
    """Least or greatest of the values (m,) at each point."""
    start = -np.inf if extreme is np.maximum else np.inf
    result = np.full(int(which.max()) + 1, start)
    extreme.at(result, which, values)
    return result


def angle_between(polar: Floats, other: Floats, azimuth: Floats) -> Floats:
    """Angles (m,) between directions at two polar angles and a difference of azimuth, radians."""
    half = np.sin((polar - other) / 2) ** 2
    half += np.sin(polar) * np.sin(other) * np.sin(azimuth / 2) ** 2
    angle: Floats = 2 * np.arcsin(np.sqrt(np.clip(half, 0, 1)))
    return angle

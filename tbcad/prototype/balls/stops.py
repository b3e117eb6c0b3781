"""The plan of rotation: the fewest stops of the base at which every mirror gets its ball.

Base angle b brings ball k to azimuth alpha_k + b, so mirror i requests b = phi_i - alpha_k. The
angle may deviate as far as the error of direction stays within the spec's limit, which gives each
mirror an interval of base angles. The fewest stops that hit all intervals are found exactly by
going through their upper ends in order.
"""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.prototype.balls.placement import PlacementProblem
from tbcad.prototype.balls.selection import MirrorGroups
from tbcad.types import Bools, Floats, Ints

TRIES_PER_TOLERANCE = 4  # azimuths tried for a ball within its tolerance
ROUNDS = 3  # how often all balls are gone through
DECIMALS = 9  # to which distances of azimuths are compared, radians
MIN_SINE = 1e-12  # of a polar angle, against division by zero


@dataclass(frozen=True)
class StopRequests:
    """Base angles at which each of m mirrors may be served, relative to its ball's azimuth."""

    ball: Ints  # that replaces the mirror, (m,)
    azimuth: Floats  # of the mirror, radians, (m,)
    tolerance: Floats  # maximum difference of the ball's azimuth from the mirror's, radians, (m,)

    def low(self, k: int) -> Floats:
        """Minimum azimuth (k,) that each of k balls must reach, tolerance used."""
        return _extremes(np.minimum, self.azimuth + self.tolerance, self.ball, k)

    def high(self, k: int) -> Floats:
        """Maximum azimuth (k,) that each of k balls must reach, tolerance used."""
        return _extremes(np.maximum, self.azimuth - self.tolerance, self.ball, k)

    def base_angles(self, azimuth: Floats) -> Floats:
        """Base angles (m,) that balls at azimuths (k,) serve the mirrors at without error."""
        return np.asarray(self.azimuth - azimuth[self.ball])

    def intervals(self, azimuth: Floats) -> tuple[Floats, Floats]:
        """Minimum and maximum base angles (m,) at which each mirror may be served."""
        angle = self.base_angles(azimuth)
        return angle - self.tolerance, angle + self.tolerance


@dataclass(frozen=True)
class StopPlan:
    """Stops of the base in ascending order, s stops and m mirrors."""

    angle: Floats  # base angle at each stop, radians, (s,)
    stop: Ints  # at which each mirror is served, (m,)
    azimuth_error: Floats  # azimuth of the ball less that of the mirror, radians, (m,)
    polar_error: Floats  # polar angle of the ball less that of the mirror, radians, (m,)
    error: Floats  # angle between the ball's direction and the mirror's, radians, (m,)

    def __len__(self) -> int:
        return len(self.angle)

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest base angle, radians."""
        return float(self.angle[0]), float(self.angle[-1])

    def mirrors(self, stop: int) -> Ints:
        """Mirrors that the balls replace at a stop."""
        return np.flatnonzero(self.stop == stop)


def stop_requests(groups: MirrorGroups, azimuth: Floats, error: float) -> StopRequests:
    """The base angles that mirrors at azimuths (m,) request; error: most that a stop may cause."""
    share = np.sin(error / 2) / np.maximum(np.sin(groups.polar), MIN_SINE)
    tolerance = 2 * np.arcsin(np.minimum(share, 1))
    return StopRequests(groups.group_of, azimuth, tolerance[groups.group_of])


def min_stabbing_points(low: Floats, high: Floats) -> tuple[Floats, Ints]:
    """The fewest points that hit all intervals [low, high] (m,).

    The maximum of each point, ascending, (s,), and the point that hits each interval, (m,).
    """
    order = np.argsort(high, kind="stable")
    new = _new_points(low[order], high[order])
    which = np.empty(len(high), dtype=np.int64)
    which[order] = np.cumsum(new) - 1
    return high[order][new], which


@compiled_loop
def _new_points(low: Floats, high: Floats) -> Bools:
    """Which intervals, by rising high, no earlier point hits, where each such one ends in a point.

    Compiled: it runs for thousands of places that balls are tried in.
    """
    last, new = -math.inf, np.zeros(len(low), dtype=np.bool_)
    for k in range(len(low)):
        if low[k] > last:
            last, new[k] = high[k], True
    return new


def azimuths_for_fewer_stops(
    problem: PlacementProblem, requests: StopRequests, azimuth: Floats
) -> Floats:
    """Azimuths (k,) moved where they are free to, so that fewer stops are needed.

    Ball after ball, each is tried at small steps over all that the others, the swing and the
    outermost azimuth leave it; swing and outermost azimuth do not grow.
    """
    limits = problem.half_swing(azimuth), problem.outermost(azimuth)
    azimuth = azimuth.copy()
    step = np.zeros(len(problem))
    np.maximum.at(step, requests.ball, requests.tolerance / TRIES_PER_TOLERANCE)
    for _ in range(ROUNDS):
        before = azimuth.copy()
        for ball in range(len(problem)):
            tried = _free_azimuths(problem, azimuth, ball, step[ball], limits)
            moves = np.where(np.arange(len(azimuth)) == ball, tried[:, None], azimuth)
            limits_of = (requests.intervals(one) for one in moves)
            counts = np.array([len(min_stabbing_points(*both)[0]) for both in limits_of])
            moved = np.round(np.abs(tried - azimuth[ball]), DECIMALS)
            azimuth[ball] = tried[np.lexsort((tried, moved, counts))[0]]
        if np.array_equal(before, azimuth):
            break
    return azimuth


def _free_azimuths(
    problem: PlacementProblem, azimuth: Floats, ball: int, step: float, limits: tuple[float, float]
) -> Floats:
    """Azimuths that a ball may have while the others stay, its present one first."""
    half_swing, outermost = limits
    room = outermost - half_swing - problem.seat_half_angle[ball]
    window_low, window_high = problem.window(half_swing)
    low, high = max(window_low[ball], -room), min(window_high[ball], room)
    tried = np.concatenate([azimuth[[ball]], np.arange(low, high, step)])
    separation = np.abs(tried[:, None] - np.delete(azimuth, ball))
    clear = (separation >= np.delete(problem.min_separation[ball], ball)).all(axis=1)
    clear[0] = True
    return np.asarray(tried[clear])


def plan_stops(
    groups: MirrorGroups, polar: Floats, requests: StopRequests, azimuth: Floats
) -> StopPlan:
    """The stops for balls at azimuths (k,), each mirror at that of its smallest error."""
    exact = requests.base_angles(azimuth)
    angle = _stop_angles(exact, *requests.intervals(azimuth))
    stop = np.abs(angle - exact[:, None]).argmin(axis=1)
    azimuth_error, ball_polar = angle[stop] - exact, groups.polar[groups.group_of]
    error = angle_between(polar, ball_polar, azimuth_error)
    return StopPlan(angle, stop, azimuth_error, ball_polar - polar, error)


def _stop_angles(exact: Floats, low: Floats, high: Floats) -> Floats:
    """The fewest stops, each as near as allowed to the middle of the angles its mirrors request.

    No stop is outside of the swing that the first and the last mirror need.
    """
    _, which = min_stabbing_points(low, high)
    count = int(which.max()) + 1
    first, last = (_extremes(by, exact, which, count) for by in (np.minimum, np.maximum))
    minimum = np.maximum(_extremes(np.maximum, low, which, count), high.min())
    maximum = np.minimum(_extremes(np.minimum, high, which, count), low.max())
    maximum = np.maximum(minimum, maximum)  # equal but for rounding where one stop suits all
    return np.asarray(np.clip((first + last) / 2, minimum, maximum))


def _extremes(extreme: np.ufunc, values: Floats, group_of: Ints, count: int) -> Floats:
    """Minimum or maximum (count,) in each group of values (m,)."""
    result = np.full(count, np.inf if extreme is np.minimum else -np.inf)
    extreme.at(result, group_of, values)
    return result


def angle_between(polar: Floats, other: Floats, azimuth: Floats) -> Floats:
    """Angles (m,) between directions at two polar angles and a difference of azimuth, radians."""
    half = np.sin((polar - other) / 2) ** 2
    half += np.sin(polar) * np.sin(other) * np.sin(azimuth / 2) ** 2
    return np.asarray(2 * np.arcsin(np.sqrt(np.clip(half, 0, 1))))

"""Where the balls stand on the base: azimuths with which it swings least.

Camera, object and ellipsoid look the same from every azimuth. So whether one ball touches another,
or stands in its light, depends only on the difference of their azimuths, and it must not be less
than one angle for each pair. What is left is to choose which of the two goes first in each pair:
a mixed integer linear program.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

from tbcad.spec.errors import SpecError
from tbcad.types import Floats, Ints

# Nodes of the search, not seconds, so that every machine finds the same.
NODES = 2000
# The solver keeps what it is told to about 1e-6, radians here; clearance.BETWEEN is far more.
SLACK = 1e-5
STEP = np.radians(0.25)  # by which the greedy layout's half swing grows


@dataclass(frozen=True)
class PlacementProblem:
    """What azimuths must keep, over k balls, radians.

    Attributes:
        apart: least difference of two balls' azimuths, (k, k); zero where any will do.
        low: least azimuth at which the ball must stand in for a mirror, (k,).
        high: largest one, (k,).
        floor: azimuth the ball must never go below, (k,).
        ceiling: azimuth it must never go above, (k,).
        edge: angle from a ball's centre to the edge of its seat, seen from the axis, (k,).
        most: largest swing allowed.
    """

    apart: Floats
    low: Floats
    high: Floats
    floor: Floats
    ceiling: Floats
    edge: Floats
    most: float

    def __len__(self) -> int:
        """Number of balls."""
        return len(self.low)

    def reach(self, azimuth: Floats) -> float:
        """Half the swing that azimuths (k,) need, the base turning as far to either side."""
        return float(max((self.high - azimuth).max(), (azimuth - self.low).max()))

    def outermost(self, azimuth: Floats) -> float:
        """Largest azimuth to either side that the edge of any ball's seat reaches."""
        return float((np.abs(azimuth) + self.edge).max() + self.reach(azimuth))

    def kept(self, azimuth: Floats) -> bool:
        """Whether azimuths (k,) keep all of it."""
        away = np.abs(azimuth[:, None] - azimuth)
        reach = self.reach(azimuth)
        inside = np.minimum(azimuth - reach - self.floor, self.ceiling - azimuth - reach) >= -SLACK
        return bool(
            inside.all() and (away >= self.apart - SLACK).all() and 2 * reach <= self.most + SLACK
        )


@dataclass(frozen=True)
class Placement:
    """Azimuths of the balls on the base at base angle zero, and what they need, radians.

    Attributes:
        azimuth: (k,).
        swing: angle that the base turns through, half of it to either side.
        bound: swing below which no azimuths are possible, as far as was proved.
        outermost: largest azimuth, to either side of zero, that the edge of a seat ever reaches.
    """

    azimuth: Floats
    swing: float
    bound: float
    outermost: float


def greedy_placement(task: PlacementProblem) -> Placement:
    """Balls one after the other, the widest group first, each as near to azimuth 0 as it can.

    Where post or camera rule that out: those with least room first, for a swing that grows until
    all find a place. For comparison, and as the first bound of the program.
    """
    width, anywhere = task.high - task.low, np.full(len(task), np.inf)
    plain = _filled(task, -anywhere, anywhere, -width)
    assert plain is not None  # beyond all other balls there is always room
    # Turned as a whole so that the base swings as far to either side.
    plain += ((task.high - plain).max() - (plain - task.low).max()) / 2
    if task.kept(plain):
        return _placement(task, plain, 0.0)
    for reach in np.arange(width.max() / 2, task.most / 2 + STEP, STEP):
        low, high = _windows(task, float(reach))
        azimuth = _filled(task, low, high, high - low)
        if azimuth is not None and task.kept(azimuth):
            return _placement(task, azimuth, 0.0)
    return _placement(task, plain, 0.0)


def _windows(task: PlacementProblem, reach: float) -> tuple[Floats, Floats]:
    """Azimuths (k,) between which each ball must stand for half a swing."""
    low = np.maximum(task.high - reach, task.floor + reach)
    return low, np.minimum(task.low + reach, task.ceiling - reach)


def _filled(task: PlacementProblem, low: Floats, high: Floats, rank: Floats) -> Floats | None:
    """Azimuths (k,) found in one go by rising rank; None when a ball has no place left."""
    azimuth = np.zeros(len(task))
    placed: list[int] = []
    for ball in np.lexsort((np.arange(len(task)), np.round(rank, 9))).tolist():
        gap = task.apart[ball, placed]
        ends = np.concatenate([azimuth[placed] + gap, azimuth[placed] - gap])
        near = np.concatenate([np.clip([0.0], low[ball], max(low[ball], high[ball])), ends])
        near = near[(near >= low[ball]) & (near <= high[ball])]
        near = near[(np.abs(near[:, None] - azimuth[placed]) >= gap - 1e-12).all(axis=1)]
        if not len(near):
            return None
        azimuth[ball] = near[np.lexsort((near, np.round(np.abs(near), 9)))[0]]
        placed.append(ball)
    return azimuth


def min_swing_placement(task: PlacementProblem) -> Placement:
    """Azimuths with the least swing, and of those with that swing the least outermost azimuth.

    The search stops at NODES nodes with the best found.

    Raises:
        SpecError: when there are none.
    """
    first = greedy_placement(task)
    found = _least_swing(task, first)
    if found is None:
        raise SpecError(_not_placed(task))
    azimuth, bound = found
    closer = _solved(task, task.reach(azimuth) + SLACK, outermost=True)
    options = [azimuth] if closer is None else [azimuth, closer[0]]
    return _placement(task, min(options, key=task.outermost), 2 * bound)


def _least_swing(task: PlacementProblem, first: Placement) -> tuple[Floats, float] | None:
    """Azimuths (k,) and the bound on half the swing; None when there are none.

    A tight first bound makes the search short, so the greedy layout's is tried although the post
    or the camera may rule that layout itself out.
    """
    most = min(task.most, 2 * np.pi) / 2
    tight = min(first.swing / 2 + SLACK, most)
    for limit in (tight, most):
        if found := _solved(task, limit, outermost=False):
            return found
        if task.kept(first.azimuth):
            return first.azimuth, 0.0
    return None


def _placement(task: PlacementProblem, azimuth: Floats, bound: float) -> Placement:
    return Placement(azimuth, 2 * task.reach(azimuth), bound, task.outermost(azimuth))


def _not_placed(task: PlacementProblem) -> str:
    return (
        f"found no place for {len(task)} balls on one base within a swing of "
        f"{np.degrees(task.most):.0f} degrees, clear of each other, the post and the camera: make "
        "prototype.k, prototype.ball_wall_mm, prototype.largest_ball_mm or "
        "prototype.post_diameter_mm smaller, or prototype.max_swing_deg larger"
    )


def _solved(task: PlacementProblem, most: float, outermost: bool) -> tuple[Floats, float] | None:
    """Azimuths (k,) and a bound on the objective: half the swing, or the outermost azimuth.

    Variables: k azimuths, half the swing, the outermost azimuth, and for each pair that must stay
    apart 1 where the first has the larger azimuth.
    """
    k = len(task)
    first, second = np.nonzero(np.triu(task.apart, 1))
    lowest, highest = task.high - most, task.low + most
    if np.any(lowest > highest):
        return None
    matrix, least = _rows(task, first, second, highest, lowest)
    goal = np.zeros(matrix.shape[1])
    goal[k + outermost] = 1
    pairs = np.zeros(len(first))
    answer = milp(
        goal,
        constraints=LinearConstraint(matrix, least, np.inf),
        bounds=Bounds(
            np.concatenate([lowest, [0, 0], pairs]),
            np.concatenate([highest, [most, np.inf], pairs + 1]),
        ),
        integrality=np.concatenate([np.zeros(k + 2), pairs + 1]),
        options={"node_limit": NODES, "mip_rel_gap": 0.0},
    )
    if answer.x is None or not task.kept(azimuth := _settled(answer.x[:k])):
        return None
    bound = answer.mip_dual_bound  # none when there is nothing whole to choose
    return azimuth, float(answer.fun if bound is None else bound)


def _settled(azimuth: Floats) -> Floats:
    """Azimuths without the solver's last digits, which may differ between machines."""
    result: Floats = np.round(azimuth, 9) + 0.0
    return result


def _rows(
    task: PlacementProblem, first: Ints, second: Ints, highest: Floats, lowest: Floats
) -> tuple[coo_array, Floats]:
    """All constraints as rows (matrix, least value)."""
    k, ball, pair = len(task), np.arange(len(task)), np.arange(len(first))
    half, far, order = np.full(k, k), np.full(k, k + 1), k + 2 + pair
    gap = task.apart[first, second]
    loose = gap + np.maximum(highest[first] - lowest[second], highest[second] - lowest[first])
    one, each = np.ones(k), np.ones(len(first))
    blocks = [
        # The swing reaches both ends of each group.
        ([(ball, one), (half, one)], task.high),
        ([(ball, -one), (half, one)], -task.low),
        # No ball leaves what is free.
        ([(ball, -one), (half, -one)], -task.ceiling),
        ([(ball, one), (half, -one)], task.floor),
        # The outermost edge.
        ([(ball, -one), (half, -one), (far, one)], task.edge),
        ([(ball, one), (half, -one), (far, one)], task.edge),
        # Of each pair one goes first; the other row is then loose.
        ([(first, each), (second, -each), (order, -loose)], gap - loose),
        ([(first, -each), (second, each), (order, loose)], gap),
    ]
    return _matrix(blocks, k + 2 + len(first)), np.concatenate([least for _, least in blocks])


def _matrix(blocks: list[tuple[list[tuple[Ints, Floats]], Floats]], columns: int) -> coo_array:
    rows, cells, values, start = [], [], [], 0
    for terms, least in blocks:
        for column, value in terms:
            rows.append(start + np.arange(len(least)))
            cells.append(column)
            values.append(value)
        start += len(least)
    places = (np.concatenate(rows), np.concatenate(cells))
    return coo_array((np.concatenate(values), places), shape=(start, columns))

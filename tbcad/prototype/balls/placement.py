"""Azimuths of the balls on the base with which the base swings least, clear of each other.

What each ball must keep clear of, other balls, their light, the post and the camera, becomes an
angle about the axis, in closed form (geometry/round_cones.py). Whether one ball touches another, or
blocks its light, depends only on the difference of their azimuths, which must be at least one angle
for each pair. What remains is to choose which of the two goes first in each pair: a mixed integer
linear program (docs/prototype.md).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import block_array, coo_array, csr_array, eye_array
from scipy.sparse.csgraph import minimum_spanning_tree

from tbcad.core.geometry.round_cones import RoundCones, contact_angle, spheres
from tbcad.core.optics.ball_light import light_hulls
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.balls.selection import Balls
from tbcad.types import Floats, Ints

# Added to each minimum angle, radians: far more than the solver's rounding and far less than
# matters, so that balls keep their distance in spite of that rounding.
SOLVER_MARGIN = 1e-4
# Minimum distance of a ball from the axis, mm, against division by zero.
NEAR_AXIS_MM = 1e-9


@dataclass(frozen=True)
class Obstacle:
    """Something that does not rotate with the base."""

    cone: RoundCones  # its hull, (1,)
    azimuth: float  # of the half-plane that contains it, radians in (0, 2 pi)


def min_separations(
    balls: Balls, spec: PrototypeSpec, pinhole: float, capture: float
) -> tuple[Floats, Floats]:
    """Minimum differences of azimuth so that no balls touch, and so that light passes, (k, k) each.

    pinhole is its distance along the axis and capture the radius of the capture sphere, mm.
    """
    centre, radius = balls.body_centre[:, :2], balls.body_radius
    touching = contact_angle(centre, radius, spheres(centre, radius).grown(spec.ball_wall_mm))
    to_object, to_camera = light_hulls(balls.outline, pinhole, capture)
    blocking = np.maximum(
        contact_angle(centre, radius, to_object.grown(spec.light_margin_mm)),
        contact_angle(centre, radius, to_camera.grown(spec.light_margin_mm)),
    )
    # Neither ball of a pair may block the other's light.
    return _with_margin(touching), _with_margin(np.maximum(blocking, blocking.T))


def _with_margin(angle: Floats) -> Floats:
    result = np.where(angle > 0, angle + SOLVER_MARGIN, 0.0)
    np.fill_diagonal(result, 0.0)
    return result


def obstacles(spec: PrototypeSpec, frame: Floats, view: Camera, length: float) -> list[Obstacle]:
    """The post below the object, and the camera behind its pinhole; of diameter zero left out.

    The post's length reaches beyond all balls, mm; frame (3, 3): rows of the ellipsoid's frame.
    """
    post = _capsule(np.zeros(3), frame @ [0.0, 0.0, -length], spec.post_diameter_mm / 2)
    start = frame @ view.pinhole
    end = start - spec.camera_length_mm * (frame @ view.forward)
    camera = _capsule(start, end, spec.camera_diameter_mm / 2)
    return [obstacle for obstacle in (post, camera) if obstacle.cone.start_radius[0] > 0]


def _capsule(start: Floats, end: Floats, radius: float) -> Obstacle:
    """A capsule from a point on the axis to another point."""
    azimuth = float(np.arctan2(end[2], end[1])) % (2 * np.pi)
    first, second = (np.array([[point[0], np.hypot(*point[1:])]]) for point in (start, end))
    size = np.array([radius])
    return Obstacle(RoundCones(first, second, size, size), azimuth)


def allowed_azimuths(
    balls: Balls, spec: PrototypeSpec, obstacles: Iterable[Obstacle]
) -> tuple[Floats, Floats]:
    """Minimum and maximum azimuth (k,) of each ball between which it is clear of all obstacles.

    SpecError when a ball meets an obstacle at every azimuth.
    """
    lowest, highest = np.full(len(balls), -np.pi), np.full(len(balls), np.pi)
    for obstacle in obstacles:
        cone = obstacle.cone.grown(spec.ball_wall_mm)
        half = contact_angle(balls.body_centre[:, :2], balls.body_radius, cone)[0]
        if half.max() >= np.pi:
            raise SpecError(
                f"ball {int(half.argmax()) + 1} meets the post or the camera at every angle of "
                "the base: make prototype.post_diameter_mm or prototype.camera_diameter_mm smaller"
            )
        met = half > 0
        highest[met] = np.minimum(highest, obstacle.azimuth - half)[met]
        lowest[met] = np.maximum(lowest, obstacle.azimuth - 2 * np.pi + half)[met]
    return lowest, highest


def seat_half_angles(balls: Balls, wall: float) -> Floats:
    """Angle at the axis between a ball's centre and the edge of its seat, radians, (k,)."""
    out = np.maximum(balls.body_centre[:, 1], NEAR_AXIS_MM)
    return np.asarray(np.arcsin(np.minimum((balls.body_radius + wall) / out, 1)))


# Nodes of the search, not seconds, so that every computer finds the same.
MAX_NODES = 2000
# The solver keeps constraints to about 1e-6, radians here; SOLVER_MARGIN is far more.
SLACK = 1e-5
GREEDY_STEP = np.radians(0.25)  # by which the greedy layout's half swing grows
# Azimuths are rounded to so many decimals: the solver's last digits differ between computers.
DECIMALS = 9
# Limits are rounded to so many, a tenth of SLACK: of equally good azimuths, the last digits of the
# limits, which differ between computers too, would decide which ones the solver finds.
LIMIT_DECIMALS = 6
ROUNDING = 1e-12  # of a difference of two azimuths, radians


@dataclass(frozen=True)
class PlacementProblem:
    """Limits of the azimuths of k balls, radians."""

    # minimum difference of two balls' azimuths, (k, k); zero where any will do
    min_separation: Floats
    served_low: Floats  # minimum azimuth at which the ball replaces a mirror, (k,)
    served_high: Floats  # maximum azimuth at which the ball replaces a mirror, (k,)
    min_azimuth: Floats  # azimuth the ball must never go below, (k,)
    max_azimuth: Floats  # azimuth it must never go above, (k,)
    # from a ball's centre to the edge of its seat, seen from the axis, (k,)
    seat_half_angle: Floats
    max_swing: float  # maximum angle that the base may turn through

    def __len__(self) -> int:
        return len(self.served_low)

    def half_swing(self, azimuth: Floats) -> float:
        """Half the swing that azimuths (k,) need, the base turning as far to either side."""
        return float(max((self.served_high - azimuth).max(), (azimuth - self.served_low).max()))

    def outermost(self, azimuth: Floats) -> float:
        """Largest azimuth to either side that the edge of any ball's seat reaches."""
        return float((np.abs(azimuth) + self.seat_half_angle).max() + self.half_swing(azimuth))

    def window(self, half_swing: float) -> tuple[Floats, Floats]:
        """Azimuths (k,) between which each ball must be, for half a swing."""
        low = np.maximum(self.served_high - half_swing, self.min_azimuth + half_swing)
        return low, np.minimum(self.served_low + half_swing, self.max_azimuth - half_swing)

    def rounded(self) -> "PlacementProblem":
        """The same limits to LIMIT_DECIMALS."""
        limits = {field.name: getattr(self, field.name) for field in fields(self)}
        return PlacementProblem(**{k: np.round(v, LIMIT_DECIMALS) for k, v in limits.items()})

    def satisfied_by(self, azimuth: Floats) -> bool:
        """Whether azimuths (k,) keep all limits."""
        separation = np.abs(azimuth[:, None] - azimuth)
        half_swing = self.half_swing(azimuth)
        room = np.minimum(
            azimuth - half_swing - self.min_azimuth, self.max_azimuth - azimuth - half_swing
        )
        return bool(
            (room >= -SLACK).all()
            and (separation >= self.min_separation - SLACK).all()
            and 2 * half_swing <= self.max_swing + SLACK
        )


@dataclass(frozen=True)
class Placement:
    """Azimuths of the balls on the base at base angle zero, and what they need, radians."""

    azimuth: Floats  # (k,)
    swing: float  # angle that the base turns through, half of it to either side
    swing_bound: float  # lower bound of the swing of any azimuths, as far as the search showed
    # largest azimuth, to either side of zero, that the edge of a seat ever reaches
    outermost: float


def greedy_placement(problem: PlacementProblem) -> Placement:
    """Balls one after the other, the widest group first, each as near to azimuth 0 as possible.

    Where post or camera rule that out: those with the least room first, for a swing that grows
    until all find a place. For comparison, and as the first bound of the program.
    """
    width = problem.served_high - problem.served_low
    anywhere = np.full(len(problem), np.inf)
    azimuth = _placed_in_order(problem, -anywhere, anywhere, -width)
    assert azimuth is not None  # beyond all other balls there is always room
    # Turned as a whole so that the base swings as far to either side.
    azimuth += ((problem.served_high - azimuth).max() - (azimuth - problem.served_low).max()) / 2
    if problem.satisfied_by(azimuth):
        return _placement(problem, azimuth, 0.0)
    for half in np.arange(width.max() / 2, problem.max_swing / 2 + GREEDY_STEP, GREEDY_STEP):
        low, high = problem.window(float(half))
        inside = _placed_in_order(problem, low, high, high - low)
        if inside is not None and problem.satisfied_by(inside):
            return _placement(problem, inside, 0.0)
    return _placement(problem, azimuth, 0.0)


def _placed_in_order(
    problem: PlacementProblem, low: Floats, high: Floats, rank: Floats
) -> Floats | None:
    """Azimuths (k,) between limits, set by rising rank; None when a ball has no place left."""
    azimuth = np.zeros(len(problem))
    placed: list[int] = []
    for ball in np.lexsort((np.arange(len(problem)), np.round(rank, DECIMALS))).tolist():
        gap = problem.min_separation[ball, placed]
        start = np.clip([0.0], low[ball], max(low[ball], high[ball]))
        tried = np.concatenate([start, azimuth[placed] + gap, azimuth[placed] - gap])
        tried = tried[(tried >= low[ball]) & (tried <= high[ball])]
        separation = np.abs(tried[:, None] - azimuth[placed])
        tried = tried[(separation >= gap - ROUNDING).all(axis=1)]
        if not len(tried):
            return None
        azimuth[ball] = tried[np.lexsort((tried, np.round(np.abs(tried), DECIMALS)))[0]]
        placed.append(ball)
    return azimuth


def min_swing_placement(problem: PlacementProblem) -> Placement:
    """Azimuths with the minimum swing, and of those the ones with the minimum outermost azimuth.

    The search stops at MAX_NODES nodes with the best found. SpecError when there are none.
    """
    limits = problem.rounded()
    solution = None if _is_crowded(problem) else _min_swing(limits, greedy_placement(limits))
    if solution is None:
        raise SpecError(
            f"found no place for {len(problem)} balls on one base within a swing of "
            f"{np.degrees(problem.max_swing):.0f} degrees, clear of each other, the post and the "
            "camera: make prototype.k, prototype.ball_wall_mm, prototype.largest_ball_mm or "
            "prototype.post_diameter_mm smaller, or prototype.max_swing_deg larger"
        )
    azimuth, bound = solution
    closer = _solved(limits, limits.half_swing(azimuth) + SLACK, outermost=True)
    options = [azimuth] if closer is None else [azimuth, closer[0]]
    return _placement(problem, min(options, key=limits.outermost), 2 * bound)


def _is_crowded(problem: PlacementProblem) -> bool:
    """Whether some balls, each apart from each, need more room than the widest swing leaves.

    Sound, not complete: it spares a search that takes minutes with hundreds of balls. From the
    first ball of a group to the last is a path through all, no shorter than their minimum
    spanning tree.
    """
    half_swing, apart = min(problem.max_swing, 2 * np.pi) / 2, problem.min_separation
    low, high = problem.served_high - half_swing, problem.served_low + half_swing
    for group in _groups_apart(apart):
        tree = minimum_spanning_tree(csr_array(np.triu(apart[np.ix_(group, group)], 1)))
        if tree.sum() > high[group].max() - low[group].min() + SLACK * len(group):
            return True
    return False


def _groups_apart(separation: Floats) -> Iterator[Ints]:
    """Groups in which every ball needs a distance from every other, one for each ball."""
    for first in range(len(separation)):
        group, rest = [first], np.flatnonzero(separation[first] > 0)
        while len(rest):
            ball = int(rest[separation[np.ix_(np.array(group), rest)].min(axis=0).argmax()])
            group.append(ball)
            rest = rest[(separation[ball, rest] > 0) & (rest != ball)]
        yield np.array(group)


def _min_swing(problem: PlacementProblem, greedy: Placement) -> tuple[Floats, float] | None:
    """Azimuths (k,) and the bound on half the swing; None when there are none.

    A tight first limit makes the search short, so the greedy layout's is tried although the post
    or the camera may rule that layout itself out.
    """
    widest = min(problem.max_swing, 2 * np.pi) / 2
    tight = min(greedy.swing / 2 + SLACK, widest)
    for limit in (tight, widest):
        if solution := _solved(problem, limit, outermost=False):
            return solution
        if problem.satisfied_by(greedy.azimuth):
            return greedy.azimuth, 0.0
    return None


def _placement(problem: PlacementProblem, azimuth: Floats, bound: float) -> Placement:
    swing = 2 * problem.half_swing(azimuth)
    return Placement(azimuth, swing, bound, problem.outermost(azimuth))


def _solved(
    problem: PlacementProblem, max_half_swing: float, outermost: bool
) -> tuple[Floats, float] | None:
    """Azimuths (k,) and a bound on the objective: half the swing, or the outermost azimuth.

    Variables: k azimuths, half the swing, the outermost azimuth, and for each pair with a minimum
    separation 1 where the first has the larger azimuth.
    """
    k, max_half_swing = len(problem), round(max_half_swing, LIMIT_DECIMALS)
    first, second = np.nonzero(np.triu(problem.min_separation, 1))
    low, high = problem.served_high - max_half_swing, problem.served_low + max_half_swing
    if np.any(low > high):
        return None
    matrix, minimum = _constraints(problem, first, second, low, high)
    objective = np.zeros(matrix.shape[1])
    objective[k + outermost] = 1
    pairs = np.zeros(len(first))
    answer = milp(
        objective,
        constraints=LinearConstraint(matrix, minimum, np.inf),
        bounds=Bounds(
            np.concatenate([low, [0, 0], pairs]),
            np.concatenate([high, [max_half_swing, np.inf], pairs + 1]),
        ),
        integrality=np.concatenate([np.zeros(k + 2), pairs + 1]),
        options={"node_limit": MAX_NODES, "mip_rel_gap": 0.0},
    )
    if answer.x is None:
        return None
    azimuth = np.round(answer.x[:k], DECIMALS) + 0.0  # no negative zeros
    if not problem.satisfied_by(azimuth):
        return None
    bound = answer.mip_dual_bound  # None without integer variables
    return azimuth, float(answer.fun if bound is None else bound)


def _constraints(
    problem: PlacementProblem, first: Ints, second: Ints, low: Floats, high: Floats
) -> tuple[coo_array, Floats]:
    """All constraints as rows: matrix and minimum of each row's product with the variables."""
    k, pairs, pair = len(problem), len(first), np.arange(len(first))
    gap, each = problem.min_separation[first, second], np.ones(pairs)
    # With this much added or taken away a pair's row holds for all azimuths.
    loose = gap + np.maximum(high[first] - low[second], high[second] - low[first])
    ball, one = eye_array(k), np.ones((k, 1))
    balls = np.concatenate([pair, pair]), np.concatenate([first, second])
    apart = coo_array((np.concatenate([each, -each]), balls), shape=(pairs, k))
    order = coo_array((loose, (pair, pair)), shape=(pairs, pairs))
    blocks = [
        # The swing reaches both ends of each group.
        ([ball, one, None, None], problem.served_high),
        ([-ball, one, None, None], -problem.served_low),
        # No ball leaves its allowed azimuths.
        ([-ball, -one, None, None], -problem.max_azimuth),
        ([ball, -one, None, None], problem.min_azimuth),
        # The outermost edge, to either side.
        ([-ball, -one, one, None], problem.seat_half_angle),
        ([ball, -one, one, None], problem.seat_half_angle),
        # Of each pair one ball goes first; the other ball's row is then loose.
        ([apart, None, None, -order], gap - loose),
        ([-apart, None, None, order], gap),
    ]
    rows, minima = zip(*blocks, strict=True)
    return block_array(rows, format="coo"), np.concatenate(minima)

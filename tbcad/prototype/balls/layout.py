"""The prototype in numbers: balls, their places on the base, its swing and its stops."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tbcad.geometry.rotations import rotated_about_x
from tbcad.geometry.vectors import FLIP_X
from tbcad.mirrors.array import MirrorArray, MirrorDesign
from tbcad.prototype.balls.catalogue import Catalogue, Grade, load_catalogue, load_grades
from tbcad.prototype.balls.clearance import (
    allowed_azimuths,
    min_separations,
    obstacles,
    seat_half_angles,
)
from tbcad.prototype.balls.fit import BallFit, ball_fit
from tbcad.prototype.balls.groups import MirrorGroups, group_mirrors, max_groups
from tbcad.prototype.balls.placement import (
    Placement,
    PlacementProblem,
    min_swing_placement,
)
from tbcad.prototype.balls.selection import BallCandidates, Balls, ball_candidates, choose_balls
from tbcad.prototype.balls.stops import (
    StopPlan,
    StopRequests,
    azimuths_for_fewer_stops,
    plan_stops,
    stop_requests,
)
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import MOST_BALLS, PrototypeSpec
from tbcad.types import Floats, Ints

# Length of the post in semi-major axes: it reaches down beyond all balls.
POST_LENGTHS = 3
# With k auto: the largest number whose limits are examined, more than any base had room for, and
# the number of larger ones tried than the smallest within the limits.
MANY_BALLS, MORE_BALLS = 40, 4


@dataclass(frozen=True)
class PrototypeLayout:
    """Balls on a base that turns about the ellipsoid's axis, k balls for m mirrors.

    At base angle b ball j is at azimuth placement.azimuth[j] + b; positions are in the frame of
    the shell (z up), as are those of the mirrors.

    Attributes:
        array: camera a and its mirrors.
        grade: deviations that the balls' grade allows.
        groups: mirrors that share a ball.
        balls: in the half-plane of azimuth zero.
        fit: how well they replace the mirrors.
        problem: limits of their azimuths.
        placement: azimuths of the balls on the base, swing.
        stops: the plan of rotation.
        twin: mirror of camera b, by number, whose direction mirror i shows when the object is
            turned by 180 degrees about z, (m,).
    """

    array: MirrorArray
    grade: Grade
    groups: MirrorGroups
    balls: Balls
    fit: BallFit
    problem: PlacementProblem
    placement: Placement
    stops: StopPlan
    twin: Ints

    def __len__(self) -> int:
        """Number of balls."""
        return len(self.balls)

    def on_base(self, points: Floats, angle: float = 0.0) -> Floats:
        """Points (k, 3) given at azimuth zero, one a ball, on the base at an angle, mm."""
        return (
            rotated_about_x(points, self.placement.azimuth + angle) @ self.array.ellipsoid.frame()
        )

    def apices(self, angle: float = 0.0) -> Floats:
        """Apices of the balls with the base at an angle (radians), mm, (k, 3)."""
        return self.on_base(self.balls.poses.apex, angle)

    def normals(self, angle: float = 0.0) -> Floats:
        """Inward unit normals at the apices, (k, 3)."""
        return self.on_base(self.balls.poses.normal, angle)

    def centres(self, angle: float = 0.0) -> Floats:
        """Centres of the reflecting spheres, mm, (k, 3)."""
        return self.on_base(self.balls.centre, angle)

    def body_centres(self, angle: float = 0.0) -> Floats:
        """Centres of the spheres in the seats, mm, (k, 3); those of caps differ from centres."""
        return self.on_base(self.balls.body_centre, angle)

    @property
    def mass_g(self) -> float:
        """Mass of the bought balls, grams."""
        return float(self.balls.mass_g.sum())

    @property
    def span(self) -> float:
        """Azimuth between the outermost balls on the base, radians."""
        return float(np.ptp(self.placement.azimuth))


def prototype_layout(spec: Spec, design: MirrorDesign, count: int | None = None) -> PrototypeLayout:
    """Group the mirrors, choose the balls, place them, and plan the stops.

    Args:
        spec: the design.
        design: its mirrors.
        count: number of balls; None: the first that the spec permits.

    Raises:
        SpecError: when there is no such layout; it says what to change.
    """
    array = design.arrays[0]
    k = next(ball_counts(spec, design)) if count is None else count
    candidates, balls = _balls_for_groups(spec, array, k, _catalogue(spec.prototype))
    groups, stop_error = candidates.groups, float(np.radians(spec.prototype.stop_error_deg))
    requests = stop_requests(groups, array.azimuth, stop_error)
    problem = _placement_problem(spec, array, balls, requests)
    placement = min_swing_placement(problem)
    azimuth = azimuths_for_fewer_stops(problem, requests, placement.azimuth)
    return PrototypeLayout(
        array=array,
        grade=load_grades()[spec.prototype.grade],
        groups=groups,
        balls=balls,
        fit=ball_fit(candidates, balls, spec.prototype),
        problem=problem,
        placement=replace(placement, azimuth=azimuth, outermost=problem.outermost(azimuth)),
        stops=plan_stops(groups, array.polar, requests, azimuth),
        twin=_twins(array),
    )


def _check_suitable(spec: Spec, array: MirrorArray) -> None:
    """One camera photographs both halves only if a half turn of the object swaps the cameras."""
    if np.isnan(array.mirrors.radius).any():
        raise SpecError(
            "a prototype of balls needs curved mirrors, but mirrors.radius_rule is flat: set it "
            "to traced or paper"
        )
    if spec.optics.camera_mm[1] != 0:
        raise SpecError(
            f"a prototype needs cameras that a half turn about z swaps, but optics.camera_mm has "
            f"y = {spec.optics.camera_mm[1]:g}: set it to 0, or build --parts shell"
        )


def ball_counts(spec: Spec, design: MirrorDesign) -> Iterator[int]:
    """Numbers of balls that the spec permits, in the order in which layouts are tried.

    With prototype.k auto: the smallest number within the limits auto_..., a few more, then fewer.

    Raises:
        SpecError: no prototype of balls suits the mirrors.
    """
    array = design.arrays[0]
    _check_suitable(spec, array)
    if isinstance(spec.prototype.k, int):
        yield spec.prototype.k
        return
    distinct = max_groups(array.polar, array.mirrors.radius, spec.prototype.radius_weight_deg)
    most = min(distinct, MOST_BALLS)
    smallest = _smallest_count(spec, array, most)
    if smallest is not None:
        yield from range(smallest, min(smallest + MORE_BALLS, most) + 1)
    yield from range(min((smallest or MANY_BALLS + 1) - 1, most), 0, -1)


def _smallest_count(spec: Spec, array: MirrorArray, most: int) -> int | None:
    """The smallest number of balls within the limits of the spec, None when there is none."""
    limits, catalogue = spec.prototype, _catalogue(spec.prototype)
    for k in range(1, min(most, MANY_BALLS) + 1):
        if _directions_within_limits(limits, array, k):
            fit = ball_fit(*_balls_for_groups(spec, array, k, catalogue), limits)
            if 100 * (1 - fit.kept_share) <= limits.auto_lost_percent:
                return k
    return None


def _catalogue(spec: PrototypeSpec) -> Catalogue:
    """Balls that can be bought for a prototype."""
    return load_catalogue(spec.catalogues).available(spec.grade, spec.largest_ball_mm)


def _groups(spec: PrototypeSpec, array: MirrorArray, k: int) -> MirrorGroups:
    return group_mirrors(array.polar, array.mirrors.radius, k, spec.radius_weight_deg)


def _directions_within_limits(spec: PrototypeSpec, array: MirrorArray, k: int) -> bool:
    """Whether the polar errors of k groups are within the limits; this needs no balls."""
    groups = _groups(spec, array, k)
    error = np.degrees(np.abs(groups.polar[groups.group_of] - array.polar))
    return bool(
        error.max() <= spec.auto_direction_max_deg
        and np.median(error) <= spec.auto_direction_median_deg
    )


def _balls_for_groups(
    spec: Spec, array: MirrorArray, k: int, catalogue: Catalogue
) -> tuple[BallCandidates, Balls]:
    groups = _groups(spec.prototype, array, k)
    candidates = ball_candidates(array, groups, spec.optics.capture_diameter_mm)
    return candidates, choose_balls(candidates, spec.prototype, catalogue)


def _placement_problem(
    spec: Spec, array: MirrorArray, balls: Balls, requests: StopRequests
) -> PlacementProblem:
    limits, ellipsoid = spec.prototype, array.ellipsoid
    pinhole, capture = 2 * ellipsoid.linear_eccentricity, spec.optics.capture_diameter_mm / 2
    length = POST_LENGTHS * ellipsoid.semi_major
    fixed = obstacles(limits, ellipsoid.frame(), array.camera, length)
    lowest, highest = allowed_azimuths(balls, limits, fixed)
    return PlacementProblem(
        min_separation=np.maximum(*min_separations(balls, limits, pinhole, capture)),
        served_low=requests.low(len(balls)),
        served_high=requests.high(len(balls)),
        min_azimuth=lowest,
        max_azimuth=highest,
        seat_half_angle=seat_half_angles(balls, limits.ball_wall_mm),
        max_swing=float(np.radians(limits.max_swing_deg)),
    )


def _twins(array: MirrorArray) -> Ints:
    """Mirror (m,) that is each one's image in the plane y = 0.

    Turned by 180 degrees about z, direction (x, y, z) becomes (-x, -y, z): that of camera b's
    mirror with the number of (x, -y, z).
    """
    image = array.u * FLIP_X[[1, 0, 2]]
    return np.asarray((array.u @ image.T).argmax(axis=0))

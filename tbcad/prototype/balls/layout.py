"""The prototype in numbers: balls, their places on the base, its swing and its stops."""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.geometry.vectors import FLIP_X
from tbcad.mirrors.array import MirrorArray, MirrorDesign
from tbcad.optics.ball_light import turned
from tbcad.prototype.balls import selection as ball
from tbcad.prototype.balls.catalogue import Catalogue, Grade, load_catalogue, load_grades
from tbcad.prototype.balls.clearance import (
    allowed_azimuths,
    min_separations,
    obstacles,
    seat_half_angles,
)
from tbcad.prototype.balls.groups import MirrorGroups, group_mirrors, max_groups
from tbcad.prototype.balls.placement import (
    Placement,
    PlacementProblem,
    greedy_placement,
    min_swing_placement,
)
from tbcad.prototype.balls.selection import BallCandidates, BallFit, Balls
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

# The post is taken to reach this many semi-major axes down, beyond all balls.
POST_LENGTHS = 3


@dataclass(frozen=True)
class PrototypeLayout:
    """Balls on a base that turns about the ellipsoid's axis, over k balls and m mirrors.

    At base angle b ball j stands at azimuth placement.azimuth[j] + b; positions are in the frame
    of the shell (z up), the same as those of the mirrors.

    Attributes:
        half: camera a and its mirrors.
        grade: what the balls' grade promises.
        groups: mirrors that share a ball.
        balls: in the half-plane of azimuth zero.
        fit: how well they stand in for the mirrors.
        task: what their azimuths must keep.
        placement: azimuths of the balls on the base, swing.
        greedy: a plain layout of the same balls, for comparison.
        stops: the plan of rotation.
        twin: mirror of camera b, by number, whose direction mirror i shows when the object is
            turned by 180 degrees about z, (m,).
    """

    half: MirrorArray
    grade: Grade
    groups: MirrorGroups
    balls: Balls
    fit: BallFit
    task: PlacementProblem
    placement: Placement
    greedy: Placement
    stops: StopPlan
    twin: Ints

    def __len__(self) -> int:
        """Number of balls."""
        return len(self.balls)

    def at(self, points: Floats, angle: float = 0.0) -> Floats:
        """Points (k, 3) given at azimuth zero, one a ball, on the base at an angle, mm."""
        return turned(points, self.placement.azimuth + angle) @ self.half.ellipsoid.frame()

    def apices(self, angle: float = 0.0) -> Floats:
        """Apices of the balls with the base at an angle (radians), mm, (k, 3)."""
        return self.at(self.balls.at.apex, angle)

    def normals(self, angle: float = 0.0) -> Floats:
        """Inward unit normals at the apices, (k, 3)."""
        return self.at(self.balls.at.normal, angle)

    def centres(self, angle: float = 0.0) -> Floats:
        """Centres of the reflecting spheres, mm, (k, 3)."""
        return self.at(self.balls.centre, angle)

    def body_centres(self, angle: float = 0.0) -> Floats:
        """Centres of the spheres that sit in the seats, mm, (k, 3); a ball's own, if no cap."""
        return self.at(self.balls.body_centre, angle)

    @property
    def mass_g(self) -> float:
        """Mass of the bought balls, grams."""
        return float(self.balls.mass_g.sum())

    @property
    def span(self) -> float:
        """Azimuth between the outermost balls on the base, radians."""
        return float(np.ptp(self.placement.azimuth))


@dataclass(frozen=True)
class PlannedPicture:
    """One photograph for one mirror.

    Attributes:
        turn: of the object about z, radians: 0 for camera a's mirrors, pi for camera b's.
        stop: number of the stop, from 0.
        angle: of the base, radians.
        ball: that stands in, from 0.
        mirror: its id.
        azimuth_error: radians.
        polar_error: radians.
        error: of direction, radians.
    """

    turn: float
    stop: int
    angle: float
    ball: int
    mirror: str
    azimuth_error: float
    polar_error: float
    error: float


def prototype_layout(spec: Spec, design: MirrorDesign) -> PrototypeLayout:
    """Group the mirrors, choose the balls, place them, and plan the stops.

    Raises:
        SpecError: when no balls do, or they cannot be placed; it says what to change.
    """
    keys, half = spec.prototype, _curved(design.halves[0])
    _check_half_turn(spec)
    here, balls = _stand(spec, half)
    wanted = stop_requests(here.groups, half.azimuth, float(np.radians(keys.stop_error_deg)))
    task = _task(spec, half, balls, wanted)
    placed = min_swing_placement(task)
    azimuth = azimuths_for_fewer_stops(task, wanted, placed.azimuth)
    return PrototypeLayout(
        half=half,
        grade=load_grades()[keys.grade],
        groups=here.groups,
        balls=balls,
        fit=ball.ball_fit(here, balls, keys),
        task=task,
        placement=replace(placed, azimuth=azimuth, outermost=task.outermost(azimuth)),
        greedy=greedy_placement(task),
        stops=plan_stops(here.groups, half.polar, wanted, azimuth),
        twin=_twins(half),
    )


def planned_pictures(made: PrototypeLayout) -> list[PlannedPicture]:
    """All photographs in order: camera a's mirrors, then camera b's with the object turned.

    The base goes through its stops twice, both times upward, so that play in the drive has no
    effect. One stop shows several mirrors, so several entries share a photograph.
    """
    stops = made.stops
    order = np.lexsort((np.arange(len(made.half)), stops.stop)).tolist()
    names = made.half.ids, [f"b{i + 1:04d}" for i in made.twin.tolist()]
    return [
        PlannedPicture(
            turn,
            int(stops.stop[i]),
            float(stops.angle[stops.stop[i]]),
            int(made.fit.ball[i]),
            ids[i],
            float(stops.azimuth_error[i]),
            float(stops.polar_error[i]),
            float(stops.error[i]),
        )
        for turn, ids in zip((0.0, np.pi), names, strict=True)
        for i in order
    ]


def _check_half_turn(spec: Spec) -> None:
    """One camera photographs both halves only if a half turn of the object swaps the cameras."""
    if spec.optics.camera_mm[1] != 0:
        raise SpecError(
            f"a prototype needs cameras that a half turn about z swaps, but optics.camera_mm has "
            f"y = {spec.optics.camera_mm[1]:g}: set it to 0, or build --parts shell"
        )


def _curved(half: MirrorArray) -> MirrorArray:
    if np.isnan(half.mirrors.radius).any():
        raise SpecError(
            "a prototype of balls needs curved mirrors, but mirrors.radius_rule is flat: set it "
            "to traced or paper"
        )
    return half


def _stand(spec: Spec, half: MirrorArray) -> tuple[BallCandidates, Balls]:
    """The groups and their balls, for the number of them that the spec gives or asks for."""
    keys = spec.prototype
    catalogue = load_catalogue(keys.catalogues).available(keys.grade, keys.largest_ball_mm)
    if keys.k != "auto":
        return _grouped(spec, half, keys.k, catalogue)
    radius, weight = half.mirrors.radius, keys.radius_weight_deg
    most = min(max_groups(half.polar, radius, weight), MOST_BALLS)
    for k in range(1, most + 1):
        if _near(keys, half, k):
            here, balls = _grouped(spec, half, k, catalogue)
            if 100 * (1 - ball.ball_fit(here, balls, keys).kept) <= keys.auto_lost_percent:
                return here, balls
    raise SpecError(
        f"no number of balls up to {most} keeps prototype.auto_direction_max_deg, "
        "auto_direction_median_deg and auto_lost_percent: raise these, or set prototype.k"
    )


def _near(keys: PrototypeSpec, half: MirrorArray, k: int) -> bool:
    """Whether the errors of direction of k groups are within the limits, before all else."""
    groups = group_mirrors(half.polar, half.mirrors.radius, k, keys.radius_weight_deg)
    error = np.degrees(np.abs(groups.polar[groups.of] - half.polar))
    return bool(
        error.max() <= keys.auto_direction_max_deg
        and np.median(error) <= keys.auto_direction_median_deg
    )


def _grouped(
    spec: Spec, half: MirrorArray, k: int, catalogue: Catalogue
) -> tuple[BallCandidates, Balls]:
    keys = spec.prototype
    groups = group_mirrors(half.polar, half.mirrors.radius, k, keys.radius_weight_deg)
    here = ball.ball_candidates(half, groups, spec.optics.capture_diameter_mm)
    return here, ball.choose_balls(here, keys, catalogue)


def _task(spec: Spec, half: MirrorArray, balls: Balls, wanted: StopRequests) -> PlacementProblem:
    keys, ellipsoid = spec.prototype, half.ellipsoid
    pinhole, capture = 2 * ellipsoid.linear_eccentricity, spec.optics.capture_diameter_mm / 2
    length = POST_LENGTHS * ellipsoid.semi_major
    floor, ceiling = allowed_azimuths(
        balls, keys, obstacles(keys, ellipsoid.frame(), half.camera, length)
    )
    return PlacementProblem(
        apart=np.maximum(*min_separations(balls, keys, pinhole, capture)),
        low=wanted.low(len(balls)),
        high=wanted.high(len(balls)),
        floor=floor,
        ceiling=ceiling,
        edge=seat_half_angles(balls, keys.ball_wall_mm),
        most=float(np.radians(keys.max_swing_deg)),
    )


def _twins(half: MirrorArray) -> Ints:
    """Mirror (m,) that is each one's image in the plane y = 0.

    Turned by 180 degrees about z, direction (x, y, z) becomes (-x, -y, z): that of camera b's
    mirror with the number of (x, -y, z).
    """
    turned_by = half.u * FLIP_X[[1, 0, 2]]
    near = half.u @ turned_by.T
    result: Ints = near.argmax(axis=0)
    return result

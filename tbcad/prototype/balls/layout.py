"""The prototype in numbers: balls, what they show, their places on the base, swing and stops."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import FLIP_X
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.optics.ball_light import ball_poses, pixel_counts, used_outlines
from tbcad.core.spec.design import Spec
from tbcad.core.spec.prototype import MOST_BALLS
from tbcad.prototype.balls.catalogue import Catalogue, load_catalogue
from tbcad.prototype.balls.placement import (
    Placement,
    PlacementProblem,
    allowed_azimuths,
    min_separations,
    min_swing_placement,
    obstacles,
    seat_half_angles,
)
from tbcad.prototype.balls.selection import (
    COVERAGE_ROUNDING_MM,
    BallCandidates,
    Balls,
    MirrorGroups,
    ball_candidates,
    choose_balls,
    group_mirrors,
    max_groups,
)
from tbcad.prototype.balls.stops import (
    StopPlan,
    StopRequests,
    azimuths_for_fewer_stops,
    plan_stops,
    stop_requests,
)
from tbcad.prototype.suitable import check_suitable
from tbcad.records.prototype import Alternative
from tbcad.types import Floats, Ints

SELECTION_RULES: dict[str, dict[str, Any]] = {
    f"{snap}, {name}": {"snap": snap, "caps": caps}
    for snap in ("cover", "nearest")
    for name, caps in (("with caps", "printed"), ("balls only", "none"))
}


@dataclass(frozen=True)
class BallFit:
    """How well balls replace mirrors, m mirrors."""

    ball: Ints  # that replaces the mirror, (m,)
    coverage: Floats  # coverage diameter within the mirror's cell moved with the ball, mm, (m,)
    # the same within the cell left in its place; zero where the ball shows the origin outside of
    # it, mm, (m,)
    coverage_fixed: Floats
    pixels_shell: Floats  # pixels of the capture sphere in the shell's picture, (m,)
    pixels: Floats  # the same in the ball's picture, (m,)

    @property
    def kept_share(self) -> float:
        """Share of the shell's pixels that the balls keep."""
        return float(self.pixels.sum() / self.pixels_shell.sum())


def ball_fit(candidates: BallCandidates, balls: Balls, pixels_shell: Floats) -> BallFit:
    """Views of the balls in place of the mirrors; `shell_pixels` are those of any balls."""
    array, groups = candidates.array, candidates.groups
    return BallFit(
        ball=groups.group_of,
        coverage=candidates.coverage(balls.radius, moved=True),
        coverage_fixed=candidates.coverage(balls.radius, moved=False),
        pixels_shell=pixels_shell,
        pixels=_pixels(array, balls.outline[groups.group_of]),
    )


def shell_pixels(array: MirrorArray, capture: float) -> Floats:
    """Pixels of the capture sphere of a radius (mm) in the shell's picture, (m,)."""
    poses = ball_poses(array.ellipsoid, array.polar)
    pinhole = 2 * array.ellipsoid.linear_eccentricity
    return _pixels(array, used_outlines(poses, array.mirrors.radius, pinhole, capture))


def _pixels(array: MirrorArray, outline: Floats) -> Floats:
    """Pixels within outlines (m, s, 3); a mirror halved by the seam has half of them."""
    share = np.where(array.u[:, 0] == 0, 0.5, 1.0)
    return share * pixel_counts(array.camera, array.ellipsoid.frame(), outline, array.azimuth)


def ball_alternatives(
    spec: Spec, array: MirrorArray, groups: MirrorGroups, balls: Balls, fit: BallFit
) -> tuple[Alternative, ...]:
    """Cost of each rule for groups of camera a's mirrors; fit is by the spec's own rule.

    pixels are those kept of all mirrors together, coverage_mm is the minimum coverage diameter
    within the moved cells, and mirrors_below_target counts those whose coverage is less.
    """
    target = spec.optics.capture_diameter_mm
    candidates = ball_candidates(array, groups, target, spec.prototype.ball_margin_mm)

    alternatives = []
    for name, rule in SELECTION_RULES.items():
        ruled, chosen, shown = spec.prototype.model_copy(update=rule), balls, fit
        if ruled != spec.prototype:
            chosen = choose_balls(candidates, ruled, balls.catalogue)
            shown = ball_fit(candidates, chosen, fit.pixels_shell)
        alternatives.append(
            Alternative(
                name=name,
                pixels=float(shown.pixels.sum()),
                pixels_kept_share=shown.kept_share,
                coverage_mm=float(shown.coverage.min()),
                mirrors_below_target=int((shown.coverage < target - COVERAGE_ROUNDING_MM).sum()),
                balls_mass_g=float(chosen.mass_g.sum()),
                caps=int(chosen.cap.sum()),
            )
        )
    return tuple(alternatives)


# Length of the post in semi-major axes: it reaches down beyond all balls.
POST_LENGTHS = 3
# With k auto: the largest number whose limits are examined, more than any base had room for, and
# the number of larger ones tried than the smallest within the limits.
MANY_BALLS, MORE_BALLS = 40, 4


@dataclass(frozen=True)
class PrototypeLayout:
    """Balls on a base that turns about the ellipsoid's axis, k balls for m mirrors.

    At base angle b ball j is at azimuth placement.azimuth[j] + b; positions are in the frame of
    the shell (z up), as are those of the mirrors. They are those under weight, on the mean over the
    pictures of each ball.
    """

    spec: Spec  # of the design, with the number of balls
    array: MirrorArray  # camera a and its mirrors
    groups: MirrorGroups  # mirrors that share a ball
    balls: Balls  # in the half-plane of azimuth zero
    fit: BallFit  # how well they replace the mirrors
    problem: PlacementProblem  # limits of their azimuths
    placement: Placement  # azimuths of the balls on the base, swing
    stops: StopPlan  # the plan of rotation
    # mirror of camera b, by number, whose direction mirror i shows when the object is turned by 180
    # degrees about z, (m,)
    twin: Ints
    # displacement of the balls by weight on the mean over their pictures, with the base at angle
    # zero, mm, (k, 3); zero until it is known
    sag: Floats = field(default_factory=lambda: np.zeros(3))

    def __len__(self) -> int:
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

    def bought_grade(self, place: int) -> str:
        """The grade that a ball is bought in, by its place in the catalogue."""
        return self.balls.catalogue.balls[place].bought_grade(self.spec.prototype.grade) or ""

    def seated_centres(self) -> Floats:
        """Where the seats have these spheres as the base is made, without weight, mm, (k, 3)."""
        return self.body_centres() - self.sag

    @property
    def mass_g(self) -> float:
        """Mass of the bought balls, grams."""
        return float(self.balls.mass_g.sum())

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Cost of each rule to choose the balls, as of `ball_alternatives`."""
        return ball_alternatives(self.spec, self.array, self.groups, self.balls, self.fit)


@dataclass(frozen=True)
class BallChoices:
    """The balls of any number of groups, chosen once for each number."""

    spec: Spec  # the design; its number of balls does not matter
    array: MirrorArray  # camera a's mirrors
    _chosen: dict[int, tuple[MirrorGroups, Balls, BallFit]] = field(
        default_factory=dict, init=False, repr=False
    )

    def groups(self, k: int) -> MirrorGroups:
        """The mirrors in k groups."""
        weight = self.spec.prototype.radius_weight_deg
        return group_mirrors(self.array.polar, self.array.mirrors.radius, k, weight)

    def chosen(self, k: int) -> tuple[MirrorGroups, Balls, BallFit]:
        """The mirrors in k groups, the ball of each, and how well it replaces them."""
        if k not in self._chosen:
            limits, target = self.spec.prototype, self.spec.optics.capture_diameter_mm
            candidates = ball_candidates(self.array, self.groups(k), target, limits.ball_margin_mm)
            balls = choose_balls(candidates, limits, self._catalogue)
            fit = ball_fit(candidates, balls, self._pixels_shell)
            self._chosen[k] = candidates.groups, balls, fit
        return self._chosen[k]

    @cached_property
    def _pixels_shell(self) -> Floats:
        return shell_pixels(self.array, self.spec.optics.capture_diameter_mm / 2)

    @cached_property
    def _catalogue(self) -> Catalogue:
        limits = self.spec.prototype
        return load_catalogue(limits.catalogues).available(limits.grade, limits.largest_ball_mm)


def prototype_layout(
    spec: Spec, design: MirrorDesign, count: int | None = None, choices: BallChoices | None = None
) -> PrototypeLayout:
    """Group the mirrors, choose the balls, place them, and plan the stops.

    count None: the first number of balls that the spec permits. choices were looked at before.
    SpecError when there is no such layout says what to change.
    """
    array = design.arrays[0]
    choices = choices or BallChoices(spec, array)
    k = next(ball_counts(spec, design, choices)) if count is None else count
    groups, balls, fit = choices.chosen(k)
    stop_error = float(np.radians(spec.prototype.stop_error_deg))
    requests = stop_requests(groups, array.azimuth, stop_error)
    problem = _placement_problem(spec, array, balls, requests)
    placement = min_swing_placement(problem)
    azimuth = azimuths_for_fewer_stops(problem, requests, placement.azimuth)
    return PrototypeLayout(
        spec=spec,
        array=array,
        groups=groups,
        balls=balls,
        fit=fit,
        problem=problem,
        placement=replace(placement, azimuth=azimuth, outermost=problem.outermost(azimuth)),
        stops=plan_stops(groups, array.polar, requests, azimuth),
        # Turned by 180 degrees about z, direction (x, y, z) becomes (-x, -y, z): that of camera b's
        # mirror with the number of (x, -y, z).
        twin=(array.u @ (array.u * FLIP_X[[1, 0, 2]]).T).argmax(axis=0),
    )


def ball_counts(
    spec: Spec, design: MirrorDesign, choices: BallChoices | None = None
) -> Iterator[int]:
    """Numbers of balls that the spec permits, in the order in which layouts are tried.

    With prototype.k auto: the smallest number within the limits auto_..., a few more, then fewer.
    choices take the balls that are looked at. SpecError: no prototype of balls suits the mirrors.
    """
    array = design.arrays[0]
    check_suitable(spec)
    if isinstance(spec.prototype.k, int):
        yield spec.prototype.k
        return
    distinct = max_groups(array.polar, array.mirrors.radius, spec.prototype.radius_weight_deg)
    most = min(distinct, MOST_BALLS)
    smallest = _smallest_count(choices or BallChoices(spec, array), most)
    if smallest is not None:
        yield from range(smallest, min(smallest + MORE_BALLS, most) + 1)
    yield from range(min((smallest or MANY_BALLS + 1) - 1, most), 0, -1)


def _smallest_count(choices: BallChoices, most: int) -> int | None:
    """The smallest number of balls within the limits of the spec, None when there is none."""
    limits = choices.spec.prototype
    for k in range(1, min(most, MANY_BALLS) + 1):
        groups = choices.groups(k)
        error = np.degrees(np.abs(groups.polar[groups.group_of] - choices.array.polar))
        if (
            error.max() <= limits.auto_direction_max_deg
            and np.median(error) <= limits.auto_direction_median_deg
            and 100 * (1 - choices.chosen(k)[2].kept_share) <= limits.auto_lost_percent
        ):
            return k
    return None


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

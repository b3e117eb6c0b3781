"""The balls of the prototype: groups of mirrors by k-means, and the ball that replaces each."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.cluster.vq import ClusterError, kmeans2

from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.ball_light import BallPoses, ball_poses, field_angles, used_outlines
from tbcad.core.optics.windows import Windows, cell_windows
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.balls.catalogue import Catalogue
from tbcad.types import Bools, Floats, Ints

MAX_ITERATIONS = 200
# Mirrors closer together than this, in degrees of polar angle, are the same to k-means.
SAME_DEG = 1e-6


@dataclass(frozen=True)
class MirrorGroups:
    """Groups of m mirrors by rising polar angle, k of them."""

    group_of: Ints  # group of each mirror, (m,)
    polar: Floats  # mean polar angle of each group, radians, (k,)
    radius: Floats  # mean radius, mm, (k,)

    def __len__(self) -> int:
        return len(self.polar)

    def minimum(self, values: Floats) -> Floats:
        """Minimum (k,) in each group of values (m,)."""
        result = np.full(len(self), np.inf)
        np.minimum.at(result, self.group_of, values)
        return result


def _means(group_of: Ints, values: Floats, k: int) -> Floats:
    return np.asarray(np.bincount(group_of, values, k) / np.bincount(group_of))


def group_mirrors(polar: Floats, radius: Floats, k: int, radius_weight_deg: float) -> MirrorGroups:
    """Group mirrors by k-means (the paper, section 5.1): polar angles, rad, radii, mm, (m,).

    The starting points are spread evenly over polar angle instead of drawn at random: the result is
    the same every time, and its largest error of direction is nearly the minimum. 1 mm of radius
    counts as radius_weight_deg degrees. SpecError when there are too few mirrors, or too few that
    differ.
    """
    features = _features(polar, radius, radius_weight_deg)
    start = _start(features, k)
    try:
        found = kmeans2(features, start, iter=MAX_ITERATIONS, minit="matrix", missing="raise")
    except ClusterError:
        raise SpecError(f"k-means leaves a group empty: make prototype.k less than {k}") from None
    labels = found[1].astype(np.int64)
    order = np.argsort(_means(labels, polar, k), kind="stable")
    group_of = np.argsort(order)[labels]  # by rising polar angle
    return MirrorGroups(group_of, _means(group_of, polar, k), _means(group_of, radius, k))


def max_groups(polar: Floats, radius: Floats, radius_weight_deg: float) -> int:
    """Number of mirrors that differ, the maximum of k; arguments as of group_mirrors."""
    return len(_distinct(_features(polar, radius, radius_weight_deg)))


def _features(polar: Floats, radius: Floats, radius_weight_deg: float) -> Floats:
    return np.column_stack([np.degrees(polar), radius_weight_deg * radius])


def _distinct(features: Floats) -> Floats:
    return np.asarray(np.unique(np.round(features / SAME_DEG) * SAME_DEG, axis=0))


def _start(features: Floats, k: int) -> Floats:
    """Of the mirrors that differ, k with polar angles spread as evenly as possible, (k, 2)."""
    distinct = _distinct(features)
    if k > len(distinct):
        raise SpecError(
            f"prototype.k is {k}, but camera a has {len(features)} mirrors, of which "
            f"{len(distinct)} differ in radius or polar angle: make it {len(distinct)} or less"
        )
    low, high = distinct[[0, -1], 0]
    even = low + (high - low) * (np.arange(k) + 0.5) / k
    nearest = np.searchsorted(distinct[:, 0], even) - np.arange(k)
    chosen = np.clip(np.maximum.accumulate(nearest), 0, len(distinct) - k) + np.arange(k)
    return np.asarray(distinct[chosen])


BISECTION_STEPS = 40
# Coverages are equal up to this rounding, far below what the smallest step of stock changes.
COVERAGE_ROUNDING_MM = 1e-6
CAP_STEP_MM = 0.1  # radii of caps are multiples of this
CAP = -1  # in place of a place in the catalogue
# The radius of a cap is searched up to this multiple of the mean radius of its group.
MAX_CAP_RADIUS = 10


@dataclass(frozen=True)
class Balls:
    """Balls by rising polar angle, k of them, in the ellipsoid's frame at azimuth zero.

    A cap is a printed or turned part: a ball of body_radius, for the same seat, with a front of
    the larger reflecting radius. The front ends where the two spheres meet.
    """

    poses: BallPoses  # apices and normals; the apex is on the ellipsoid whatever the radius
    radius: Floats  # of the reflecting sphere, mm, (k,)
    stock: Ints  # place in the catalogue, CAP for a cap, (k,)
    catalogue: Catalogue  # balls that could be chosen
    outline: Floats  # of the part in use, mm, (k, s, 3)
    body_radius: Floats  # of the sphere that contains the whole part and touches the seat, mm, (k,)
    body_depth: Floats  # of that sphere's centre behind the apex along the normal, mm, (k,)

    def __len__(self) -> int:
        return len(self.radius)

    @property
    def cap(self) -> Bools:
        """Which are caps, not bought, (k,)."""
        return np.asarray(self.stock == CAP)

    @property
    def centre(self) -> Floats:
        """Centres of the reflecting spheres, mm, (k, 3)."""
        return self.poses.apex - self.radius[:, None] * self.poses.normal

    @property
    def body_centre(self) -> Floats:
        """Centres of the spheres in the seats, mm, (k, 3); for a ball its own centre."""
        return self.poses.apex - self.body_depth[:, None] * self.poses.normal

    @property
    def used_radius(self) -> Floats:
        """Largest distance of the part in use from the apex, mm, (k,)."""
        return np.asarray(norm(self.outline - self.poses.apex[:, None]).max(axis=1))

    @property
    def mass_g(self) -> Floats:
        """Mass of the bought balls, grams, (k,); zero for caps, which depend on the material."""
        return np.where(self.cap, 0.0, self.catalogue.mass_g[self.stock])

    @property
    def size(self) -> tuple[str, ...]:
        """Names of the sizes."""
        return tuple(
            f"cap R {radius:.1f} mm" if place == CAP else self.catalogue.balls[place].size
            for radius, place in zip(self.radius, self.stock, strict=True)
        )


@dataclass(frozen=True)
class BallCandidates:
    """Groups of camera a's mirrors, and what balls show in their places."""

    array: MirrorArray  # camera a's mirrors
    groups: MirrorGroups  # of them
    windows: Windows  # their cells as the camera sees them
    target: float  # coverage diameter that counts, mm
    margin: float  # by which what is required is larger, mm

    @property
    def required(self) -> float:
        """Least coverage diameter that passes, mm."""
        return self.target + self.margin - COVERAGE_ROUNDING_MM

    def coverage(self, radius: Floats, moved: bool) -> Floats:
        """Coverage diameter (m,) with reflecting radii (k,), in moved cells or fixed ones, mm."""
        array, group_of = self.array, self.groups.group_of
        poses = ball_poses(array.ellipsoid, self.groups.polar)
        centre = rotated_about_x(
            (poses.apex - radius[:, None] * poses.normal)[group_of], array.azimuth
        )
        across = rotated_about_x(np.broadcast_to([0.0, 0.0, 1.0], centre.shape), array.azimuth)
        frame = array.ellipsoid.frame()
        # Of each mirror's window about the pinhole, which takes its apex to the ball's.
        angle = field_angles(array.ellipsoid, self.groups.polar)[group_of]
        turned = field_angles(array.ellipsoid, array.polar) - angle
        rotation = turned if moved else np.zeros(len(array))
        covered = self.windows.coverage(centre @ frame, radius[group_of], across @ frame, rotation)
        return covered if moved else np.where(self._shows_origin(), covered, 0.0)

    def covers_groups(self, radius: Floats, ignored: Bools, moved: bool) -> Bools:
        """Whether radii (k,) show what is required for each group's mirrors but those ignored."""
        covered = np.where(ignored, np.inf, self.coverage(radius, moved))
        return np.asarray(self.groups.minimum(covered) >= self.required)

    def _shows_origin(self) -> Bools:
        """Whether the ball's apex, which shows the origin, is in the mirror's own cell, (m,)."""
        array = self.array
        apex = ball_poses(array.ellipsoid, self.groups.polar).apex[self.groups.group_of]
        sight = (
            rotated_about_x(apex, array.azimuth) @ array.ellipsoid.frame() - array.camera.pinhole
        )
        direction = sight / norm(sight)[:, None]
        return self.windows.contains(direction, direction, np.zeros(len(array)))

    def only(self, mirrors: Bools) -> "BallCandidates":
        """The same, computing coverage for some mirrors only; infinite for the others."""
        return replace(self, windows=self.windows.only(mirrors))


def ball_candidates(
    array: MirrorArray, groups: MirrorGroups, target: float, margin: float = 0.0
) -> BallCandidates:
    """Groups of mirrors whose places balls can be tried in; target and margin of coverage, mm."""
    windows = cell_windows(array.cells, array.camera.pinhole)
    return BallCandidates(array, groups, windows, target, margin)


def choose_balls(candidates: BallCandidates, spec: PrototypeSpec, catalogue: Catalogue) -> Balls:
    """The ball of each group, by the spec's rule; groups beyond stock get caps if it says so."""
    if spec.snap == "nearest":
        radius, stock = _nearest(candidates.groups.radius, catalogue, spec.caps != "none")
    else:
        radius, stock = _covering(candidates, spec, catalogue)
    return balls_with_radii(candidates, radius, stock, catalogue, spec.cap_rim_mm)


def balls_with_radii(
    candidates: BallCandidates, radius: Floats, stock: Ints, catalogue: Catalogue, rim: float
) -> Balls:
    """Balls with reflecting radii (k,) in the places of the groups, caps with a rim (mm)."""
    ellipsoid = candidates.array.ellipsoid
    poses = ball_poses(ellipsoid, candidates.groups.polar)
    pinhole, capture = 2 * ellipsoid.linear_eccentricity, candidates.target / 2
    outline = used_outlines(poses, radius, pinhole, capture)
    balls = Balls(poses, radius, stock, catalogue, outline, radius, radius)
    # The edge is at 45 degrees on the ball whose front a cap's sphere replaces, so that the ball's
    # widest part, and the seat behind it, stay whole.
    edge = np.minimum(balls.used_radius + rim, radius)
    body, depth = np.sqrt(2) * edge, radius - np.sqrt(radius**2 - edge**2) + edge
    smaller = balls.cap & (body < radius)
    return replace(
        balls,
        body_radius=np.where(smaller, body, radius),
        body_depth=np.where(smaller, depth, radius),
    )


def coverable(candidates: BallCandidates, catalogue: Catalogue, moved: bool) -> Bools:
    """Whether the smallest ball shows what is required in each mirror's cell, (m,).

    Where it does not, the mirror is too far from its group for any ball.
    """
    smallest = np.full(len(candidates.groups), catalogue.diameter[0] / 2)
    return np.asarray(candidates.coverage(smallest, moved) >= candidates.required)


def _nearest(radius: Floats, catalogue: Catalogue, caps: bool) -> tuple[Floats, Ints]:
    """Radius and place in stock (k,) nearest to radii (k,), caps beyond the largest ball."""
    stock = np.argmin(np.abs(catalogue.diameter / 2 - radius[:, None]), axis=1)
    beyond = caps & (radius > catalogue.diameter[-1] / 2)
    cap = np.round(radius / CAP_STEP_MM) * CAP_STEP_MM
    return np.where(beyond, cap, catalogue.diameter[stock] / 2), np.where(beyond, CAP, stock)


def _covering(
    candidates: BallCandidates, spec: PrototypeSpec, catalogue: Catalogue
) -> tuple[Floats, Ints]:
    """Largest stock ball, or cap, that shows the target for every mirror of its group.

    Mirrors that no ball covers are ignored; a group of nothing else gets the nearest ball.
    """
    groups, moved = candidates.groups, spec.picture == "moved"
    ignored = ~coverable(candidates, catalogue, moved)
    last = len(catalogue) - 1
    stock = _largest_place(
        lambda place: candidates.covers_groups(catalogue.diameter[place] / 2, ignored, moved),
        len(groups),
        last,
    )
    all_ignored = groups.minimum(ignored.astype(float)) == 1
    stock = np.where(all_ignored, _nearest(groups.radius, catalogue, False)[1], stock)
    radius = catalogue.diameter[stock] / 2
    beyond = ~all_ignored & (spec.caps != "none") & (stock == last)
    if not beyond.any():
        return radius, stock
    steps = _largest_cap(candidates.only(beyond[groups.group_of]), radius, ignored, moved)
    cap = steps * CAP_STEP_MM
    beyond &= cap > radius
    return np.where(beyond, cap, radius), np.where(beyond, CAP, stock)


def _largest_place(covers: Callable[[Ints], Bools], count: int, last: int) -> Ints:
    """Largest place (count,) up to last that covers, where smaller places cover too."""
    low, high = np.zeros(count, dtype=np.int64), np.full(count, last)
    while np.any(low < high):
        middle = (low + high + 1) // 2
        covered = covers(middle)
        low, high = np.where(covered, middle, low), np.where(covered, high, middle - 1)
    return low


def _largest_cap(candidates: BallCandidates, low: Floats, ignored: Bools, moved: bool) -> Floats:
    """Largest reflecting radius (k,) from low upward that shows the target, in whole steps."""
    high = np.maximum(low, MAX_CAP_RADIUS * candidates.groups.radius)
    for _ in range(BISECTION_STEPS):
        if np.array_equal(_steps(low), _steps(high)):
            break
        middle = (low + high) / 2
        covered = candidates.covers_groups(middle, ignored, moved)
        low, high = np.where(covered, middle, low), np.where(covered, high, middle)
    return _steps(low)


def _steps(radius: Floats) -> Floats:
    """Whole steps of a cap's radius in radii (k,), but for rounding."""
    return np.asarray(np.floor(radius / CAP_STEP_MM + COVERAGE_ROUNDING_MM))

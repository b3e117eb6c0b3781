"""The balls of the prototype: which one stands in for each group of mirrors, and what it shows."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tbcad.geometry.vectors import norm
from tbcad.mirrors.array import MirrorArray
from tbcad.optics.ball_light import (
    BallPoses,
    ball_poses,
    field_angles,
    pixel_counts,
    turned,
    used_outlines,
)
from tbcad.optics.windows import SubstituteBalls, Windows, cell_windows
from tbcad.prototype.balls.catalogue import Catalogue
from tbcad.prototype.balls.groups import MirrorGroups
from tbcad.spec.prototype import PrototypeSpec
from tbcad.types import Bools, Floats, Ints

HALVINGS = 40
# Of rounding only: far below what the least stock step changes.
SAME_MM = 1e-6
CAP_STEP_MM = 0.1
CAP = -1


@dataclass(frozen=True)
class Balls:
    """Balls by rising polar angle, over k of them, in the ellipsoid's frame at azimuth zero.

    A cap is a part made like a ball of body_radius, for the same seat, whose front is turned to
    the larger radius; the edge of that front is where both spheres meet.

    Attributes:
        at: apices and normals; the apex stays on the ellipsoid whatever the radius.
        radius: of the reflecting sphere, mm, (k,).
        stock: place in the catalogue, MADE for a cap, (k,).
        catalogue: what there was to choose from.
        outline: of the part in use, mm, (k, s, 3).
        body_radius: of the sphere that holds the whole part and touches the seat, mm, (k,).
        body_depth: of its centre behind the apex along the normal, mm, (k,).
    """

    at: BallPoses
    radius: Floats
    stock: Ints
    catalogue: Catalogue
    outline: Floats
    body_radius: Floats
    body_depth: Floats

    def __len__(self) -> int:
        """Number of balls."""
        return len(self.radius)

    @property
    def cap(self) -> Bools:
        """Which are made, not bought, (k,)."""
        made: Bools = self.stock == CAP
        return made

    @property
    def centre(self) -> Floats:
        """Centres of the reflecting spheres, mm, (k, 3)."""
        return self.at.apex - self.radius[:, None] * self.at.normal

    @property
    def body_centre(self) -> Floats:
        """Centres of the spheres in the seats, mm, (k, 3); for a ball its own centre."""
        return self.at.apex - self.body_depth[:, None] * self.at.normal

    @property
    def in_use(self) -> Floats:
        """Largest distance of the part in use from the apex, mm, (k,)."""
        result: Floats = norm(self.outline - self.at.apex[:, None]).max(axis=1)
        return result

    @property
    def mass_g(self) -> Floats:
        """Mass of the bought balls, grams, (k,); zero for caps, whose material is the maker's."""
        return np.where(self.cap, 0.0, self.catalogue.mass_g[self.stock])

    @property
    def size(self) -> tuple[str, ...]:
        """Names of the sizes."""
        return tuple(
            f"cap R {radius:.1f} mm" if made else self.catalogue.balls[place].size
            for radius, made, place in zip(self.radius, self.cap, self.stock, strict=True)
        )


@dataclass(frozen=True)
class BallFit:
    """How well balls stand in for mirrors, over m mirrors.

    Attributes:
        ball: that stands in, (m,).
        polar_error: polar angle of the ball less that of the mirror, radians, (m,).
        coverage: coverage diameter within the mirror's cell moved along with the ball, mm, (m,).
        coverage_fixed: the same within the cell left in its place; zero where the ball shows the
            origin outside of it, mm, (m,).
        possible: whether any stock ball shows the whole target with the pictures as the spec
            has them, (m,).
        pixels_shell: pixels of the capture sphere in the shell's picture, (m,).
        pixels: in the ball's, (m,).
    """

    ball: Ints
    polar_error: Floats
    coverage: Floats
    coverage_fixed: Floats
    possible: Bools
    pixels_shell: Floats
    pixels: Floats

    @property
    def kept(self) -> float:
        """Share of the shell's pixels that the balls keep."""
        return float(self.pixels.sum() / self.pixels_shell.sum())


@dataclass(frozen=True)
class BallCandidates:
    """Groups of camera a's mirrors, and balls tried in their places.

    Attributes:
        half: camera a's mirrors.
        groups: of them.
        windows: their cells as the camera sees them.
        target: coverage wanted, mm.
    """

    half: MirrorArray
    groups: MirrorGroups
    windows: Windows
    target: float

    def coverage(self, radius: Floats, moved: bool) -> Floats:
        """Coverage diameter (m,) with reflecting radii (k,), in moved cells or fixed ones, mm."""
        half, of = self.half, self.groups.of
        at = ball_poses(half.ellipsoid, self.groups.polar)
        centre = turned((at.apex - radius[:, None] * at.normal)[of], half.azimuth)
        across = turned(np.broadcast_to([0.0, 0.0, 1.0], centre.shape), half.azimuth)
        frame = half.ellipsoid.frame()
        turn = self._turn() if moved else np.zeros(len(half))
        pieces = SubstituteBalls(centre @ frame, radius[of], across @ frame, turn)
        covered = self.windows.coverage(pieces)
        return covered if moved else np.where(self._shown(), covered, 0.0)

    def _turn(self) -> Floats:
        """Turn of each mirror's window about the pinhole that brings its apex to the ball's."""
        angle = field_angles(self.half.ellipsoid, self.groups.polar)[self.groups.of]
        return field_angles(self.half.ellipsoid, self.half.polar) - angle

    def _shown(self) -> Bools:
        """Whether the ball's apex, which shows the origin, lies in the mirror's own cell, (m,)."""
        half = self.half
        frame = half.ellipsoid.frame()
        apex = ball_poses(half.ellipsoid, self.groups.polar).apex[self.groups.of]
        away = turned(apex, half.azimuth) @ frame - half.camera.pinhole
        direction = away / norm(away)[:, None]
        return self.windows.surround(direction, direction, np.zeros(len(half)))

    def only(self, mirrors: Bools) -> "BallCandidates":
        """The same, computing coverage for some mirrors only; infinite for the others."""
        return replace(self, windows=self.windows.only(mirrors))


def ball_candidates(half: MirrorArray, groups: MirrorGroups, target: float) -> BallCandidates:
    """Groups of mirrors ready to try balls in their places; target is a coverage in mm."""
    return BallCandidates(half, groups, cell_windows(half.cells, half.camera.pinhole), target)


def choose_balls(here: BallCandidates, keys: PrototypeSpec, catalogue: Catalogue) -> Balls:
    """The ball of each group, by the spec's rule; groups beyond stock get caps if it says so."""
    if keys.snap == "nearest":
        radius, stock = _nearest(here.groups.radius, catalogue, keys.caps)
    else:
        radius, stock = _covering(here, keys, catalogue)
    return balls_with_radii(here, radius, stock, catalogue, keys.cap_rim_mm)


def balls_with_radii(
    here: BallCandidates, radius: Floats, stock: Ints, catalogue: Catalogue, rim: float
) -> Balls:
    """Balls with reflecting radii (k,) in the places of the groups, caps with a rim (mm)."""
    ellipsoid = here.half.ellipsoid
    at = ball_poses(ellipsoid, here.groups.polar)
    outline = used_outlines(at, radius, 2 * ellipsoid.linear_eccentricity, here.target / 2)
    loose = Balls(at, radius, stock, catalogue, outline, radius, radius)
    body, depth = _bodies(radius, loose.in_use + rim)
    made = loose.cap & (body < radius)
    return replace(
        loose,
        body_radius=np.where(made, body, radius),
        body_depth=np.where(made, depth, radius),
    )


def _bodies(radius: Floats, edge: Floats) -> tuple[Floats, Floats]:
    """Radius and depth of the ball whose front, cut off by the cap's sphere, has this edge (k,).

    The edge stands at 45 degrees on the ball, so that the ball's widest part, and the seat behind
    it, is left whole.
    """
    edge = np.minimum(edge, radius)
    drop = radius - np.sqrt(radius**2 - edge**2)
    return np.sqrt(2) * edge, drop + edge


def coverable(here: BallCandidates, catalogue: Catalogue, moved: bool) -> Bools:
    """Whether the smallest ball shows the target in each mirror's cell, (m,).

    Where it does not, the mirror is too far from its group for any ball.
    """
    smallest = np.full(len(here.groups), catalogue.diameter[0] / 2)
    return here.coverage(smallest, moved) >= here.target - SAME_MM


def ball_fit(here: BallCandidates, balls: Balls, keys: PrototypeSpec) -> BallFit:
    """What the balls show in place of the mirrors."""
    half, groups = here.half, here.groups
    moved = keys.picture == "moved"
    shell = used_outlines(
        ball_poses(half.ellipsoid, half.polar),
        half.mirrors.radius,
        2 * half.ellipsoid.linear_eccentricity,
        here.target / 2,
    )
    return BallFit(
        ball=groups.of,
        polar_error=groups.polar[groups.of] - half.polar,
        coverage=here.coverage(balls.radius, moved=True),
        coverage_fixed=here.coverage(balls.radius, moved=False),
        possible=coverable(here, balls.catalogue, moved),
        pixels_shell=_counted(half, shell),
        pixels=_counted(half, balls.outline[groups.of]),
    )


def _counted(half: MirrorArray, outline: Floats) -> Floats:
    """Pixels within outlines (m, s, 3); a mirror halved by the seam has half of them."""
    share = np.where(half.u[:, 0] == 0, 0.5, 1.0)
    return share * pixel_counts(half.camera, half.ellipsoid.frame(), outline, half.azimuth)


def _nearest(radius: Floats, catalogue: Catalogue, caps: bool) -> tuple[Floats, Ints]:
    stock = np.argmin(np.abs(catalogue.diameter / 2 - radius[:, None]), axis=1)
    beyond = caps & (radius > catalogue.diameter[-1] / 2)
    made = np.round(radius / CAP_STEP_MM) * CAP_STEP_MM
    return np.where(beyond, made, catalogue.diameter[stock] / 2), np.where(beyond, CAP, stock)


def _covering(
    here: BallCandidates, keys: PrototypeSpec, catalogue: Catalogue
) -> tuple[Floats, Ints]:
    """Largest stock ball, or cap, that shows the target for every mirror of its group."""
    groups, moved = here.groups, keys.picture == "moved"
    hopeless = ~coverable(here, catalogue, moved)

    def covers(radius: Floats) -> Bools:
        covered = np.where(hopeless, np.inf, here.coverage(radius, moved))
        result: Bools = groups.least(covered) >= here.target - SAME_MM
        return result

    last = len(catalogue) - 1
    stock = _largest(lambda place: covers(catalogue.diameter[place] / 2), len(groups), last)
    none = groups.least(hopeless.astype(float)) == 1
    stock = np.where(none, _nearest(groups.radius, catalogue, False)[1], stock)
    radius = catalogue.diameter[stock] / 2
    beyond = ~none & keys.caps & (stock == last)
    if not beyond.any():
        return radius, stock
    made = _largest_radius(here.only(beyond[groups.of]), radius, hopeless, moved)
    made = np.floor(made / CAP_STEP_MM + SAME_MM) * CAP_STEP_MM
    beyond &= made > radius
    return np.where(beyond, made, radius), np.where(beyond, CAP, stock)


def _largest(holds: Callable[[Ints], Bools], count: int, last: int) -> Ints:
    """Largest place up to last, for each of count, at which something holds that ends once."""
    low, high = np.zeros(count, dtype=np.int64), np.full(count, last)
    while np.any(low < high):
        middle = (low + high + 1) // 2
        held = holds(middle)
        low, high = np.where(held, middle, low), np.where(held, high, middle - 1)
    return low


def _largest_radius(here: BallCandidates, low: Floats, hopeless: Bools, moved: bool) -> Floats:
    """Largest reflecting radius (k,) that shows the target for every mirror asked for, mm."""
    mirror = here.half.mirrors.radius
    high = np.maximum(low, 10 * here.groups.mean(mirror))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        covered = np.where(hopeless, np.inf, here.coverage(middle, moved))
        held = here.groups.least(covered) >= here.target - SAME_MM
        low, high = np.where(held, middle, low), np.where(held, high, middle)
    return low

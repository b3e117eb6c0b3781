"""Angles at which a ball that rotates about the axis meets an obstacle, in closed form.

Every obstacle is a hull of two spheres (a round cone) whose centres lie in a half-plane bounded by
the axis: a ball (both spheres the same), the light that a ball reflects, a post, a camera. A ball
whose centre rotates about the axis meets such a hull within some angle to either side of that
half-plane and nowhere else, so the forbidden angles are always one symmetric interval.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tbcad.types import Floats

MOST_STEPS = 1000
ROUNDING = 1e-12  # of the radius


@dataclass(frozen=True)
class RoundCones:
    """Hulls of two spheres each, centres in a half-plane at the axis, over m of them."""

    start: Floats  # centre of one sphere, along the axis and out from it (>= 0), mm, (m, 2)
    end: Floats  # centre of the other, mm, (m, 2)
    start_radius: Floats  # mm, (m,)
    end_radius: Floats  # mm, (m,)

    def __len__(self) -> int:
        """Number of hulls."""
        return len(self.start_radius)

    def grown(self, margin: float) -> "RoundCones":
        """The hulls with a margin (mm) all round."""
        return RoundCones(
            self.start, self.end, self.start_radius + margin, self.end_radius + margin
        )


def spheres(centre: Floats, radius: Floats) -> RoundCones:
    """Spheres about points (m, 2) as round cones."""
    return RoundCones(centre, centre, radius, radius)


def contact_angle(centre: Floats, radius: Floats, cones: RoundCones) -> Floats:
    """Angles within which balls that rotate about the axis meet round cones, radians, (m, k).

    Centres of balls (k, 2) are along the axis and out from it, mm; cones (m,) lie in the half-plane
    from which the angle counts. It is 0 where they never meet, pi where they meet at every angle.

    At angle t the ball meets the sphere at share s of the hull when |C|^2 + |c|^2 - 2 C_along
    c_along - 2 C_out c_out cos t <= (r(s) + radius)^2, so when cos t is at least a quadratic in s
    over a linear one, whose minimum is at an end or where its derivative is zero.
    """
    over, under = _quadratic(centre, radius, cones), _linear(centre, cones)
    with np.errstate(over="ignore"):  # next to the axis the ratio may be infinite
        shares = [np.zeros_like(under[0]), np.ones_like(under[0]), *_stationary(over, under)]
        cosine = np.min([_ratio(over, under, share) for share in shares], axis=0)
    return np.asarray(np.arccos(np.clip(cosine, -1, 1)))


def _quadratic(centre: Floats, radius: Floats, cones: RoundCones) -> tuple[Floats, Floats, Floats]:
    """Coefficients (m, k) of s^2, s and 1 of the squared distance in the plane less (r + R)^2."""
    offset = cones.start[:, None] - centre
    along = (cones.end - cones.start)[:, None]
    reach = cones.start_radius[:, None] + radius
    growth = (cones.end_radius - cones.start_radius)[:, None]
    # Distances with the ball in the cones' half-plane; the rotation out of it adds the rest.
    square = (along**2).sum(axis=-1) - growth**2
    slope = 2 * ((along * offset).sum(axis=-1) - growth * reach)
    constant = (offset**2).sum(axis=-1) - reach**2
    return square + 0 * constant, slope, constant


def _linear(centre: Floats, cones: RoundCones) -> tuple[Floats, Floats]:
    """Coefficients (m, k) of s and 1 of 2 C_out c_out."""
    slope = (cones.end - cones.start)[:, None, 1]
    return 2 * slope * centre[:, 1], 2 * cones.start[:, None, 1] * centre[:, 1]


def _ratio(over: tuple[Floats, ...], under: tuple[Floats, ...], share: Floats) -> Floats:
    """1 + quadratic / linear; on the axis minus or plus infinity by the numerator's sign."""
    top = (over[0] * share + over[1]) * share + over[2]
    bottom = under[0] * share + under[1]
    on_axis = np.where(top > 0, np.inf, -np.inf)
    return 1 + np.divide(top, bottom, out=on_axis, where=bottom > 0)


def _stationary(over: tuple[Floats, ...], under: tuple[Floats, ...]) -> list[Floats]:
    """Shares in [0, 1] where the ratio may be lowest between the ends; else an end."""
    (a, b, c), (m, n) = over, under
    square, half, constant = a * m, a * n, b * n - c * m
    root = np.sqrt(np.maximum(half**2 - square * constant, 0))
    # The form without cancellation; without a square term one of the two is the only root.
    larger = -(half + np.where(half >= 0, root, -root))
    first = np.divide(larger, square, out=np.zeros_like(larger), where=square != 0)
    second = np.divide(constant, larger, out=np.zeros_like(larger), where=larger != 0)
    # On the axis the ratio is infinite by the quadratic's sign, so the quadratic's vertex decides.
    vertex = np.divide(-b, 2 * a, out=np.zeros_like(larger), where=a > 0)
    return [np.clip(share, 0, 1) for share in (first, second, vertex)]


def smallest_sphere(points: Floats) -> tuple[Floats, float]:
    """Middle (3,) and radius of the smallest sphere that holds points (n, 3).

    Two to four of them lie on it. The farthest point outside of the smallest sphere about those
    few is added to them until there is none; the radius grows with each step.

    Source: E. Welzl, Smallest enclosing disks, LNCS 555, 1991.
    """
    few = points[:1]
    middle, radius = few[0], 0.0
    for _ in range(MOST_STEPS):
        distance = np.linalg.norm(points - middle, axis=1)
        farthest = int(distance.argmax())
        if distance[farthest] <= radius * (1 + ROUNDING):
            break
        few = np.vstack([few, points[farthest]])
        middle, radius, few = _smallest_of_few(few)
    return middle, float(np.linalg.norm(points - middle, axis=1).max())


def _smallest_of_few(points: Floats) -> tuple[Floats, float, Floats]:
    """Middle and radius for up to five points, and the fewest of them that it follows from."""
    best = points[0], np.inf, points[:1]
    for count in range(2, min(len(points), 4) + 1):
        for chosen in combinations(range(len(points)), count):
            on = points[list(chosen)]
            middle = _equally_far(on)
            reach = float(np.linalg.norm(points - middle, axis=1).max())
            if reach < best[1] * (1 - ROUNDING):
                best = middle, reach, on
    return best


def _equally_far(points: Floats) -> Floats:
    """The point equally far from points (k, 3), in the plane, line or space that they span."""
    along = points[1:] - points[0]
    square = (along**2).sum(axis=1) / 2
    weights = np.linalg.lstsq(along @ along.T, square, rcond=None)[0]
    return np.asarray(points[0] + weights @ along)

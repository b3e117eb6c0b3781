"""What the chosen balls show in place of the mirrors."""

from dataclasses import dataclass

import numpy as np

from tbcad.mirrors.array import MirrorArray
from tbcad.optics.ball_light import ball_poses, pixel_counts, used_outlines
from tbcad.prototype.balls.selection import BallCandidates, Balls, coverable
from tbcad.spec.prototype import PrototypeSpec
from tbcad.types import Bools, Floats, Ints


@dataclass(frozen=True)
class BallFit:
    """How well balls replace mirrors, m mirrors.

    Attributes:
        ball: that replaces the mirror, (m,).
        polar_error: polar angle of the ball less that of the mirror, radians, (m,).
        coverage: coverage diameter within the mirror's cell moved with the ball, mm, (m,).
        coverage_fixed: the same within the cell left in its place; zero where the ball shows the
            origin outside of it, mm, (m,).
        coverable: whether any ball on sale shows the whole target with the pictures as the spec
            has them, (m,).
        pixels_shell: pixels of the capture sphere in the shell's picture, (m,).
        pixels: the same in the ball's picture, (m,).
    """

    ball: Ints
    polar_error: Floats
    coverage: Floats
    coverage_fixed: Floats
    coverable: Bools
    pixels_shell: Floats
    pixels: Floats

    @property
    def kept_share(self) -> float:
        """Share of the shell's pixels that the balls keep."""
        return float(self.pixels.sum() / self.pixels_shell.sum())


def ball_fit(candidates: BallCandidates, balls: Balls, spec: PrototypeSpec) -> BallFit:
    """What the balls show in place of the mirrors."""
    half, groups = candidates.half, candidates.groups
    shell = used_outlines(
        ball_poses(half.ellipsoid, half.polar),
        half.mirrors.radius,
        2 * half.ellipsoid.linear_eccentricity,
        candidates.target / 2,
    )
    return BallFit(
        ball=groups.group_of,
        polar_error=groups.polar[groups.group_of] - half.polar,
        coverage=candidates.coverage(balls.radius, moved=True),
        coverage_fixed=candidates.coverage(balls.radius, moved=False),
        coverable=coverable(candidates, balls.catalogue, spec.picture == "moved"),
        pixels_shell=_pixels(half, shell),
        pixels=_pixels(half, balls.outline[groups.group_of]),
    )


def _pixels(half: MirrorArray, outline: Floats) -> Floats:
    """Pixels within outlines (m, s, 3); a mirror halved by the seam has half of them."""
    share = np.where(half.u[:, 0] == 0, 0.5, 1.0)
    return share * pixel_counts(half.camera, half.ellipsoid.frame(), outline, half.azimuth)

"""What the chosen balls show in place of the mirrors, and what each rule to choose them costs."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.ball_light import ball_poses, pixel_counts, used_outlines
from tbcad.core.spec.design import Spec
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.balls.groups import MirrorGroups
from tbcad.prototype.balls.selection import (
    COVERAGE_ROUNDING_MM,
    BallCandidates,
    Balls,
    ball_candidates,
    choose_balls,
    coverable,
)
from tbcad.records.prototype import Alternative
from tbcad.types import Bools, Floats, Ints

SELECTION_RULES: dict[str, dict[str, Any]] = {
    f"{snap}, {name}": {"snap": snap, "caps": caps}
    for snap in ("cover", "nearest")
    for name, caps in (("with caps", True), ("balls only", False))
}


@dataclass(frozen=True)
class BallFit:
    """How well balls replace mirrors, m mirrors."""

    ball: Ints  # that replaces the mirror, (m,)
    polar_error: Floats  # polar angle of the ball less that of the mirror, radians, (m,)
    coverage: Floats  # coverage diameter within the mirror's cell moved with the ball, mm, (m,)
    # the same within the cell left in its place; zero where the ball shows the origin outside of
    # it, mm, (m,)
    coverage_fixed: Floats
    # whether any ball on sale shows the whole target with the pictures as the spec has them, (m,)
    coverable: Bools
    pixels_shell: Floats  # pixels of the capture sphere in the shell's picture, (m,)
    pixels: Floats  # the same in the ball's picture, (m,)

    @property
    def kept_share(self) -> float:
        """Share of the shell's pixels that the balls keep."""
        return float(self.pixels.sum() / self.pixels_shell.sum())


def ball_fit(candidates: BallCandidates, balls: Balls, spec: PrototypeSpec) -> BallFit:
    """What the balls show in place of the mirrors."""
    array, groups = candidates.array, candidates.groups
    shell = used_outlines(
        ball_poses(array.ellipsoid, array.polar),
        array.mirrors.radius,
        2 * array.ellipsoid.linear_eccentricity,
        candidates.target / 2,
    )
    return BallFit(
        ball=groups.group_of,
        polar_error=groups.polar[groups.group_of] - array.polar,
        coverage=candidates.coverage(balls.radius, moved=True),
        coverage_fixed=candidates.coverage(balls.radius, moved=False),
        coverable=coverable(candidates, balls.catalogue, spec.picture == "moved"),
        pixels_shell=_pixels(array, shell),
        pixels=_pixels(array, balls.outline[groups.group_of]),
    )


def _pixels(array: MirrorArray, outline: Floats) -> Floats:
    """Pixels within outlines (m, s, 3); a mirror halved by the seam has half of them."""
    share = np.where(array.u[:, 0] == 0, 0.5, 1.0)
    return share * pixel_counts(array.camera, array.ellipsoid.frame(), outline, array.azimuth)


def ball_alternatives(
    spec: Spec, array: MirrorArray, groups: MirrorGroups, balls: Balls, fit: BallFit
) -> tuple[Alternative, ...]:
    """What each rule costs for groups of camera a's mirrors; fit is by the spec's own rule.

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
            shown = ball_fit(candidates, chosen, ruled)
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

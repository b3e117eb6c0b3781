"""What each rule for choosing the balls costs."""

from dataclasses import dataclass

from tbcad.mirrors.array import MirrorArray
from tbcad.prototype.balls.catalogue import Catalogue
from tbcad.prototype.balls.fit import ball_fit
from tbcad.prototype.balls.groups import MirrorGroups
from tbcad.prototype.balls.selection import (
    COVERAGE_ROUNDING_MM,
    BallCandidates,
    ball_candidates,
    choose_balls,
)
from tbcad.spec.design import Spec
from tbcad.spec.prototype import PrototypeSpec


@dataclass(frozen=True)
class BallAlternative:
    """What one rule for choosing the balls costs.

    Attributes:
        name: name of the rule.
        kept_share: share of the shell's pixels that is kept.
        pixels: pixels that are kept, of all mirrors of camera a together.
        min_coverage: minimum coverage diameter within the moved cells, mm.
        below_target: number of mirrors whose coverage there is below the target.
        mass_g: mass of the balls.
        caps: number of caps.
    """

    name: str
    kept_share: float
    pixels: float
    min_coverage: float
    below_target: int
    mass_g: float
    caps: int


SELECTION_RULES = {
    "cover, with caps": {"snap": "cover", "caps": True},
    "cover, balls only": {"snap": "cover", "caps": False},
    "nearest, with caps": {"snap": "nearest", "caps": True},
    "nearest, balls only": {"snap": "nearest", "caps": False},
}


def ball_alternatives(
    spec: Spec, half: MirrorArray, groups: MirrorGroups, catalogue: Catalogue
) -> list[BallAlternative]:
    """What each rule costs, for groups of camera a's mirrors."""
    candidates = ball_candidates(half, groups, spec.optics.capture_diameter_mm)
    return [
        _alternative(name, candidates, spec.prototype.model_copy(update=rule), catalogue)
        for name, rule in SELECTION_RULES.items()
    ]


def _alternative(
    name: str, candidates: BallCandidates, spec: PrototypeSpec, catalogue: Catalogue
) -> BallAlternative:
    balls = choose_balls(candidates, spec, catalogue)
    fit = ball_fit(candidates, balls, spec)
    return BallAlternative(
        name,
        fit.kept_share,
        float(fit.pixels.sum()),
        float(fit.coverage.min()),
        int((fit.coverage < candidates.target - COVERAGE_ROUNDING_MM).sum()),
        float(balls.mass_g.sum()),
        int(balls.cap.sum()),
    )

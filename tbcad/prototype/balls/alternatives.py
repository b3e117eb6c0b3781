"""What each rule for choosing the balls costs."""

from typing import Any

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

SELECTION_RULES = {
    "cover, with caps": {"snap": "cover", "caps": True},
    "cover, balls only": {"snap": "cover", "caps": False},
    "nearest, with caps": {"snap": "nearest", "caps": True},
    "nearest, balls only": {"snap": "nearest", "caps": False},
}


def ball_alternatives(
    spec: Spec, half: MirrorArray, groups: MirrorGroups, catalogue: Catalogue
) -> list[dict[str, Any]]:
    """What each rule costs, for groups of camera a's mirrors: records for prototype.json.

    pixels are those kept of all mirrors together, coverage_mm is the minimum coverage diameter
    within the moved cells, and mirrors_below_target counts those whose coverage is less.
    """
    candidates = ball_candidates(half, groups, spec.optics.capture_diameter_mm)
    return [
        _alternative(name, candidates, spec.prototype.model_copy(update=rule), catalogue)
        for name, rule in SELECTION_RULES.items()
    ]


def _alternative(
    name: str, candidates: BallCandidates, spec: PrototypeSpec, catalogue: Catalogue
) -> dict[str, Any]:
    balls = choose_balls(candidates, spec, catalogue)
    fit = ball_fit(candidates, balls, spec)
    return {
        "name": name,
        "pixels": float(fit.pixels.sum()),
        "pixels_kept_share": fit.kept_share,
        "coverage_mm": float(fit.coverage.min()),
        "mirrors_below_target": int(
            (fit.coverage < candidates.target - COVERAGE_ROUNDING_MM).sum()
        ),
        "balls_mass_g": float(balls.mass_g.sum()),
        "caps": int(balls.cap.sum()),
    }

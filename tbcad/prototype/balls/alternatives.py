"""Ways to choose the balls, and what each of them costs."""

from dataclasses import dataclass

from tbcad.mirrors.array import MirrorArray
from tbcad.prototype.balls.catalogue import Catalogue
from tbcad.prototype.balls.groups import MirrorGroups
from tbcad.prototype.balls.selection import (
    SAME_MM,
    BallCandidates,
    Balls,
    ball_candidates,
    ball_fit,
    choose_balls,
)
from tbcad.spec.design import Spec
from tbcad.spec.prototype import PrototypeSpec


@dataclass(frozen=True)
class BallAlternative:
    """What one way to choose the balls costs.

    Attributes:
        name: of the way.
        kept: share of the shell's pixels that is kept.
        pixels: that are kept, of all mirrors of camera a together.
        least_coverage: within the moved cells, mm.
        short: number of mirrors that show less than the target there.
        mass_g: of the balls.
        made: number of caps.
    """

    name: str
    kept: float
    pixels: float
    least_coverage: float
    short: int
    mass_g: float
    made: int


SELECTION_RULES = {
    "cover, with caps": {"snap": "cover", "caps": True},
    "cover, balls only": {"snap": "cover", "caps": False},
    "nearest, with caps": {"snap": "nearest", "caps": True},
    "nearest, balls only": {"snap": "nearest", "caps": False},
}


def ball_alternatives(
    spec: Spec, half: MirrorArray, groups: MirrorGroups, catalogue: Catalogue
) -> list[BallAlternative]:
    """What each way to choose the balls costs, for groups of camera a's mirrors."""
    here = ball_candidates(half, groups, spec.optics.capture_diameter_mm)
    keys = [(name, spec.prototype.model_copy(update=way)) for name, way in SELECTION_RULES.items()]
    return [_choice(name, here, choose_balls(here, way, catalogue), way) for name, way in keys]


def _choice(name: str, here: BallCandidates, balls: Balls, keys: PrototypeSpec) -> BallAlternative:
    found = ball_fit(here, balls, keys)
    short = found.coverage < here.target - SAME_MM
    return BallAlternative(
        name,
        found.kept,
        float(found.pixels.sum()),
        float(found.coverage.min()),
        int(short.sum()),
        float(balls.mass_g.sum()),
        int(balls.cap.sum()),
    )

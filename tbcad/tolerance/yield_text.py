"""The yield of a process in words."""

import numpy as np

from tbcad.tolerance.montecarlo.builds import YieldEstimate, estimate_yield
from tbcad.tolerance.process.process import Process
from tbcad.types import Floats


def yield_sentence(process: Process, worst: Floats, target: float) -> str:
    """How many builds are good, and what the worst camera of a build covers.

    Args:
        process: that makes the builds.
        worst: minimum coverage of each build, mm, (s,).
        target: minimum coverage of a good build, mm.
    """
    return (
        f"Built by {process.name} ({process.title}), "
        f"{percent(estimate_yield(worst, target))} of the builds "
        f"cover {target:g} mm with every virtual camera; the worst camera of a build "
        f"covers {np.median(worst):.2f} mm (median; 1 % cover less than "
        f"{np.quantile(worst, 0.01):.2f})."
    )


def percent(estimate: YieldEstimate) -> str:
    """A share with its interval."""
    return f"{estimate.share:.1%} ({estimate.low:.1%} to {estimate.high:.1%})"

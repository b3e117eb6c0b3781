"""Simulated builds of the prototype, with its windows fixed or calibrated."""

from dataclasses import dataclass

from tbcad.tolerance.montecarlo.builds import CoverageResult
from tbcad.tolerance.montecarlo.draws import Errors
from tbcad.tolerance.prototype.draws import draw_prototypes
from tbcad.tolerance.prototype.windows import PrototypeModel, coverage_and_offsets


@dataclass(frozen=True)
class PrototypeCase:
    """Simulates builds of the prototype; it can be sent to another process.

    Attributes:
        model: the prototype as designed.
        errors: of the process.
        seed: of all builds.
        calibrated: whether camera and balls are known, so that every window is moved to its ball.
    """

    model: PrototypeModel
    errors: Errors
    seed: int
    calibrated: bool = False

    def __call__(self, builds: range) -> CoverageResult:
        """Result of the builds of these numbers."""
        stops = len(self.model.plan.angle)
        draws = draw_prototypes(self.errors, self.seed, builds, self.model.is_cap, stops)
        return CoverageResult(*coverage_and_offsets(self.model, draws, self.calibrated))

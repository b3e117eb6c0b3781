"""Many prototypes as they might come out: what each shows, its windows fixed or moved along."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.simulate.parallel import in_threads
from tbcad.tolerance.montecarlo.builds import Covered, batches, joined
from tbcad.tolerance.montecarlo.draws import Errors
from tbcad.tolerance.prototype.draws import draw
from tbcad.tolerance.prototype.windows import Designed, seen
from tbcad.types import Floats


@dataclass(frozen=True)
class PrototypeResult(Covered):
    """What s prototypes see, and where 2 m mirrors point: a's mirrors, b's.

    Attributes:
        offset: pointing errors at the object, mm, (s, 2 m).
    """

    offset: Floats

    @property
    def offset_rms(self) -> Floats:
        """Root mean square of each machine's pointing errors, mm, (s,)."""
        result: Floats = np.sqrt((self.offset**2).mean(axis=1))
        return result

    @property
    def offset_worst(self) -> Floats:
        """Greatest of each machine's pointing errors, mm, (s,)."""
        result: Floats = self.offset.max(axis=1)
        return result


@dataclass(frozen=True)
class PrototypeWork:
    """Makes prototypes; it can be sent to another process.

    Attributes:
        at: the prototype as designed.
        errors: how exactly it is made.
        seed: of all machines.
        known: whether a calibration tells where camera and balls are, so that the software takes
            every window from where it really is.
    """

    at: Designed
    errors: Errors
    seed: int
    known: bool = False

    def __call__(self, machines: range) -> PrototypeResult:
        """What the machines of these numbers see."""
        at = self.at
        draws = draw(self.errors, self.seed, machines, at.cap, len(at.plan.angle))
        return PrototypeResult(*seen(at, draws, self.known))


Each = Callable[[PrototypeWork, Sequence[range]], list[PrototypeResult]]


def simulate(
    work: PrototypeWork, machines: int, each: Each = in_threads, first: int = 0
) -> PrototypeResult:
    """Make prototypes and see what they see; the same whoever works, and in what batches.

    Their yield is told by tbcad.tolerance.montecarlo.yielded(result.worst, target).

    Args:
        work: what to make.
        machines: how many, at least one.
        each: makes batches of machines, in order: threads, processes or a cluster.
        first: number of the first machine.
    """
    return joined(each(work, batches(machines, first)))

"""What a run came to."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Outcome:
    """What a run came to.

    Attributes:
        folder: of the run.
        wanted: number of photographs that are wanted in all.
        taken: number that are there.
        new: number that were taken now.
        missed: for each photograph that was tried in vain, why, by name.
        stopped: why the run ended before its end; empty if it did not.
        unsafe: what could not be switched off or held; empty if all was.
        seconds: that it took.
    """

    folder: Path
    wanted: int
    taken: int
    new: int
    missed: dict[str, str]
    stopped: str
    unsafe: str
    seconds: float

    @property
    def complete(self) -> bool:
        """Whether every photograph is there, and the machine is safe."""
        return self.taken == self.wanted and not self.unsafe

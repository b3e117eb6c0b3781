"""What a run would do and what it came to, as records and as printed."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tbcad.common.atomic_files import InFolder
from tbcad.rig.control.plan import ControlPlan
from tbcad.rig.control.selection import Shots, count, duration_text, size_text

NAMED = 5  # of the photographs that are missing
SHOWN_STOPS = 3


@dataclass(frozen=True)
class Outcome(InFolder):
    """What a run came to."""

    folder: Path
    wanted: int  # number of photographs that are wanted in all
    taken: int  # number that are there
    new: int  # number that were taken now
    missed: dict[str, str]  # for each photograph that was tried in vain, why, by name
    stopped: str  # why the run ended before its end; empty if it did not
    unsafe: str  # what could not be switched off or held; empty if all was
    seconds: float

    @property
    def complete(self) -> bool:
        """Whether every photograph is there, and the machine is safe."""
        return self.taken == self.wanted and not self.unsafe


@dataclass(frozen=True)
class DryRun:
    """What a run would do."""

    plan: ControlPlan
    remaining: list[Shots]
    seconds: float
    disk_bytes: int

    @property
    def photographs(self) -> int:
        """Number of photographs."""
        return count(self.remaining)


def outcome_lines(outcome: Outcome, resume: str) -> Iterator[str]:
    """A dozen lines at most, with the command that goes on with the run."""
    verdict = "COMPLETE" if outcome.complete else "NOT COMPLETE"
    yield (
        f"{verdict}: {outcome.taken} of {outcome.wanted} photographs in {outcome.folder}, "
        f"{outcome.new} of them now, in {duration_text(outcome.seconds)}"
    )
    if outcome.stopped:
        yield f"stopped: {outcome.stopped}"
    if outcome.unsafe:
        yield f"LOOK AT THE MACHINE: {outcome.unsafe}"
    for name, reason in [*outcome.missed.items()][:NAMED]:
        yield f"missing: {name}: {reason}"
    if (more := len(outcome.missed) - NAMED) > 0:
        yield f"missing: {more} more, in journal.jsonl"
    if outcome.taken < outcome.wanted:
        yield f"go on with: {resume}"


def preflight_lines(outcome: Outcome) -> Iterator[str]:
    """What a preflight that found nothing wrong came to."""
    yield "every exposure will do; no photograph was kept"
    if outcome.unsafe:
        yield f"LOOK AT THE MACHINE: {outcome.unsafe}"


def dry_run_record(found: DryRun) -> dict[str, object]:
    """What a run would do, for other programs."""
    positions = [{"title": shots.title, "phases": list(shots.phases)} for shots in found.remaining]
    return {
        "schema": "tbcad-run-plan/1",
        "photographs": found.photographs,
        "seconds": found.seconds,
        "disk_bytes": found.disk_bytes,
        "positions": positions,
    }


def dry_run_lines(found: DryRun) -> Iterator[str]:
    """What a run would do."""
    first = found.remaining[0] if found.remaining else None
    positions = len(found.remaining)
    yield f"{found.photographs} photographs at {positions} positions would be taken"
    if first is None:
        return
    yield f"phases at the first: {', '.join(first.phases)}"
    for shots in found.remaining[:SHOWN_STOPS]:
        yield f"  {shots.title}: {len(shots.phases)} photographs"
    if positions > SHOWN_STOPS:
        yield f"  ... to {found.remaining[-1].title}"
    yield (
        f"about {duration_text(found.seconds)} with 2 s for each photograph, and "
        f"{size_text(found.disk_bytes)} of disk with 1 byte for each pixel"
    )
    yield "both are measured on the camera's first photograph before a run starts"

"""Which stops and phases are photographed, in which order; what a run would do and came to."""

import re
import shutil
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path

from tbcad.common.atomic_files import InFolder
from tbcad.errors import InputError
from tbcad.records.prototype_drive import Phase
from tbcad.records.run import DARK_LIT, Frame, PhaseTimes, exposure_name
from tbcad.rig.control.base import travel_s
from tbcad.rig.control.plan import ControlPlan

_RANGE = re.compile(r"(\d+)(?:-(\d+))?$")
RUNS = {"a": (0,), "b": (180,), "ab": (0, 180)}
SIDECAR_BYTES = 8_192  # with the journal's line, as a disk's blocks count them
SPARE = 1.1  # of disk: a lit object takes more bytes than the dark
LEAST_BYTES_PER_PX = 0.3  # of a lit object as a JPEG: the first photograph may be a dark one
CAPTURE_S = 2.0  # of a camera that is not yet known, beyond its exposure
BYTES_PER_PX = 1.0  # likewise: a large JPEG; dark photographs take less
WRITE_S = 0.03  # a photograph to the disk
MINUTE, HOUR = 60, 3600
NAMED = 5  # of the photographs that are missing
SHOWN_STOPS = 3


@dataclass(frozen=True)
class RunSelection:
    """What is photographed, and how."""

    frames: tuple[Frame, ...]  # positions in order
    phases: tuple[Phase, ...]  # lights at each, in order
    size_px: tuple[int, int]  # columns and rows that photographs must have
    # of exposure, as far as the camera is told them
    times: PhaseTimes = field(default_factory=PhaseTimes)

    def left(self, taken: Collection[str] = ()) -> "list[Shots]":
        """Photographs that are not yet there by name, in the order of photographing."""
        names = [phase.name for phase in self.phases]
        left = (
            Shots(frame, tuple(name for name in names if exposure_name(frame, name) not in taken))
            for frame in self.frames
        )
        return [one for one in left if one.phases]

    @property
    def capture_times(self) -> dict[str, float | None]:
        """Exposure time of each phase, s; None: that which the camera has."""
        return {phase.name: self.times.of(phase.name) for phase in self.phases}


def chosen_phases(
    plan: ControlPlan, text: str | None, times: PhaseTimes | None = None
) -> tuple[Phase, ...]:
    """Phases by names with commas between, in the plan's order; `leds` for all LEDs, None for all.

    The dark one that exposure times ask for is added.
    """
    known = [phase.name for phase in plan.phases]
    named = known if text is None else [name.strip() for name in text.split(",")]
    if "leds" in named:
        named += [name for name in known if name.startswith("led_")]
    wrong = [name for name in named if name not in (*known, "leds")]
    if wrong:
        raise InputError(
            f"--phases names {wrong[0]!r:.40}, this build has {', '.join(known)}: name some of "
            "these, or leds for all LEDs"
        )
    chosen = {phase.name: phase for phase in plan.phases if phase.name in named}
    dark = Phase(name=DARK_LIT, output=None)
    return tuple(chosen.get(name, dark) for name in (times or PhaseTimes()).phases(tuple(chosen)))


def chosen_frames(plan: ControlPlan, stops: str | None, runs: str) -> tuple[Frame, ...]:
    """Frames of runs "a", "b" or "ab", at all stops or some, such as "1-10,40"."""
    if runs not in RUNS:
        raise InputError(f"--runs is {runs!r:.20}, allowed is a, b or ab: change it")
    last = len(plan.program.stops)
    wanted = set(range(1, last + 1)) if stops is None else set(_numbers(stops, last))
    return tuple(
        frame
        for frame in plan.frames
        if frame.stop in wanted and frame.object_turn_deg in RUNS[runs]
    )


def _numbers(text: str, last: int) -> Iterable[int]:
    for part in text.split(","):
        match = _RANGE.match(part.strip())
        first, end = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
        if not 1 <= first <= end <= last:
            raise InputError(
                f"--stops names {part!r:.40}, allowed are 1 to {last}, such as 1-10,40: change it"
            )
        yield from range(first, end + 1)


@dataclass(frozen=True)
class Shots:
    """Photographs that are still to be taken at one position."""

    frame: Frame
    phases: tuple[str, ...]  # names of their lights, in order

    @property
    def title(self) -> str:
        """The position in words."""
        run = "b" if self.frame.object_turn_deg else "a"
        return f"run {run}, stop {self.frame.stop} at {self.frame.base_angle_deg:.1f} degrees"


def expected_seconds(
    plan: ControlPlan, remaining: Iterable[Shots], capture_s: float
) -> dict[str, float]:
    """Expected duration of each position, s, by its title."""
    each = plan.motion.light_s + capture_s + WRITE_S
    seconds = {}
    for _, run in groupby(remaining, lambda shots: shots.frame.object_turn_deg):
        at = plan.program.start.angle_deg
        for shots in run:
            there = shots.frame.base_angle_deg
            still = plan.motion.settle_s + len(shots.phases) * each
            seconds[shots.title] = travel_s(abs(there - at), plan) + still
            at = there
    return seconds


def count(remaining: Iterable[Shots]) -> int:
    """Number of photographs."""
    return sum(len(shots.phases) for shots in remaining)


def disk_bytes(photographs: int, each: float) -> int:
    """Room that photographs need on the disk."""
    return round(photographs * (SPARE * each + SIDECAR_BYTES))


def bytes_each(first: int, width_px: int, height_px: int) -> float:
    """Size of a photograph by that of the first."""
    return max(float(first), LEAST_BYTES_PER_PX * width_px * height_px)


def free_bytes(folder: Path) -> int:
    """Free room where a folder is or will be."""
    absolute = folder.absolute()
    existing = next(path for path in (absolute, *absolute.parents) if path.exists())
    return shutil.disk_usage(existing).free


def check_disk(folder: Path, needed: int) -> None:
    """Refuse a disk with too little room."""
    if (free := free_bytes(folder)) < needed:
        raise InputError(
            f"{folder}: the photographs need about {size_text(needed)}, {size_text(free)} are "
            "free: make room, or name a folder on another disk"
        )


def duration_text(seconds: float) -> str:
    """A duration in hours and minutes, or in seconds if it is short."""
    if seconds < MINUTE:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / MINUTE), HOUR // MINUTE)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def size_text(size: float) -> str:
    """A number of bytes in MB or GB."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"


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
        "photographs": count(found.remaining),
        "seconds": found.seconds,
        "disk_bytes": found.disk_bytes,
        "positions": positions,
    }


def dry_run_lines(found: DryRun) -> Iterator[str]:
    """What a run would do."""
    first = found.remaining[0] if found.remaining else None
    positions = len(found.remaining)
    yield f"{count(found.remaining)} photographs at {positions} positions would be taken"
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

"""Which stops and phases of a plan are photographed, and in which order."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

from tbcad.control.plan import Plan
from tbcad.errors import InputError
from tbcad.records.exposure import DARK_LIT, Frame, PhaseTimes
from tbcad.records.prototype_drive import Phase

_RANGE = re.compile(r"(\d+)(?:-(\d+))?$")
RUNS = {"a": (0,), "b": (180,), "ab": (0, 180)}
Preflight = Literal["first", "only", "off"]
"""Whether one stop is looked at before a run, and whether the run follows."""


@dataclass(frozen=True)
class RunOptions:
    """What is photographed, and how.

    Attributes:
        frames: positions in order.
        phases: lights at each, in order.
        size_px: columns and rows that photographs must have.
        send_settings: whether the controller's settings are sent to it where they differ.
        times: of exposure, as far as the camera is told them.
    """

    frames: tuple[Frame, ...]
    phases: tuple[Phase, ...]
    size_px: tuple[int, int]
    send_settings: bool = False
    times: PhaseTimes = field(default_factory=PhaseTimes)

    @property
    def capture_times(self) -> dict[str, float | None]:
        """Exposure time of each phase, s; None: that which the camera has."""
        return {phase.name: self.times.of(phase.name) for phase in self.phases}


def chosen_phases(
    plan: Plan, text: str | None, times: PhaseTimes | None = None
) -> tuple[Phase, ...]:
    """Phases by their names, in the plan's order, and the dark one that exposure times ask for.

    Args:
        plan: of the export.
        text: names with commas between; `leds` for all LEDs; None for all phases.
        times: of exposure.

    Raises:
        InputError: a name is none of the export's phases.
    """
    known = [phase.name for phase in plan.phases]
    named = known if text is None else [name.strip() for name in text.split(",")]
    if "leds" in named:
        named += [name for name in known if name.startswith("led_")]
    wrong = [name for name in named if name not in (*known, "leds")]
    if wrong:
        raise InputError(
            f"--phases names {wrong[0]!r:.40}, this export has {', '.join(known)}: name some of "
            "these, or leds for all LEDs"
        )
    chosen = {phase.name: phase for phase in plan.phases if phase.name in named}
    dark = Phase(name=DARK_LIT, output=None)
    return tuple(chosen.get(name, dark) for name in (times or PhaseTimes()).phases(tuple(chosen)))


def chosen_frames(plan: Plan, stops: str | None, runs: str) -> tuple[Frame, ...]:
    """Frames of both runs, or of one, at all stops or some.

    Args:
        plan: of the export.
        stops: numbers and ranges with commas between, such as "1-10,40"; None for all.
        runs: "a", "b" or "ab".

    Raises:
        InputError: a stop is not of the plan, or there is no such run.
    """
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

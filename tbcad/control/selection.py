"""Which stops and phases of a plan are photographed, and in which order."""

import re
from collections.abc import Iterable

from tbcad.control.plan import Phase, Plan
from tbcad.errors import InputError
from tbcad.runs.exposure import Frame

_RANGE = re.compile(r"(\d+)(?:-(\d+))?$")
RUNS = {"a": (0,), "b": (180,), "ab": (0, 180)}


def chosen_phases(plan: Plan, text: str | None) -> tuple[Phase, ...]:
    """Phases by their names, in the plan's order.

    Args:
        plan: of the export.
        text: names with commas between; `leds` for all LEDs; None for all phases.

    Raises:
        InputError: a name is none of the export's phases.
    """
    if text is None:
        return plan.phases
    known = [phase.name for phase in plan.phases]
    named = [name.strip() for name in text.split(",")]
    if "leds" in named:
        named += [name for name in known if name.startswith("led_")]
    wrong = [name for name in named if name not in (*known, "leds")]
    if wrong:
        raise InputError(
            f"--phases names {wrong[0]!r:.40}, this export has {', '.join(known)}: name some of "
            "these, or leds for all LEDs"
        )
    return tuple(phase for phase in plan.phases if phase.name in named)


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

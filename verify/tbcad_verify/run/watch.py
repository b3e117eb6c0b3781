"""Running the stages in another process, with a limit on how long each may take."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from tbcad_verify.report.checks import Check, unknown
from tbcad_verify.run.processes import ProcessEnded, Processes
from tbcad_verify.run.results import CollectedResults

STAGE_LIMIT_S = 600.0


def watch(
    titles: Sequence[str],
    results: CollectedResults,
    seconds: float,
    stages: Callable[..., None],
    *arguments: Any,
) -> None:
    """Do stages in a process, which sends their results; those that it does not end are unknown.

    Args:
        titles: of all stages, in order.
        results: are added to.
        seconds: time limit of one stage.
        stages: function of a module; takes the arguments, and what receives results.
        arguments: of it.

    Raises:
        BadExport: the folder is not a readable export.
    """
    with Processes(1, seconds) as processes:
        try:
            processes.call(stages, *arguments, heard=results.add)
        except ProcessEnded as end:
            results.checks += _unknown_stages(titles, results.stages, str(end))


def _unknown_stages(titles: Sequence[str], begun: Sequence[str], reason: str) -> list[Check]:
    """The stage that was under way, and those that were not reached."""
    broken = begun[-1] if begun else titles[0]
    later = [title for title in titles if title not in begun and title != broken]
    return [
        unknown((broken, "", ""), reason),
        *(unknown((title, "", ""), f"not reached: {broken!r} {reason}") for title in later),
    ]

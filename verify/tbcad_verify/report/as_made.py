"""What manufacturing errors leave of a design: simulated by others, shown with the verification."""

from __future__ import annotations

from dataclasses import dataclass

COMMAND = "tbcad tolerance FOLDER"
NOT_MODELLED = "cutter (99 % holds for 0.1 mm), sag 1.8 mm, lens 2 mm, shadows, caps"
"""Figures of the paper's design, milled as turtleback-cnc: docs/tolerance.md has them all."""
NOT_SIMULATED = f"As made: {COMMAND} simulates builds with manufacturing errors"


@dataclass(frozen=True)
class ProcessYield:
    """Simulated builds by one manufacturing process."""

    process: str  # its name
    share: float  # of the builds whose every virtual camera sees the whole object
    coverage_mm: float  # median of the builds' minimum coverage


@dataclass(frozen=True)
class AsMade:
    """Simulated builds of one design, without any new search for its margin."""

    builds: int = 0  # number of simulated builds by each process
    # the largest coverage first; empty if they could not be simulated
    processes: tuple[ProcessYield, ...] = ()
    reason: str = ""  # why not


def as_made_lines(as_made: AsMade | None) -> list[str]:
    """The same in words; without simulated builds, the command that makes them."""
    if as_made is None:
        return [NOT_SIMULATED]
    if not as_made.processes:
        return [f"As made: not simulated, {as_made.reason}"]
    figures = [f"{one.process} {one.share:.0%} {one.coverage_mm:.3g}" for one in as_made.processes]
    return [
        f"As made ({as_made.builds} simulated builds): yield, and median minimum coverage in mm",
        f"  {', '.join(figures)}",
        f"  larger yield: tbcad build --for-process NAME; causes: {COMMAND}",
        f"  left out: {NOT_MODELLED}",
    ]

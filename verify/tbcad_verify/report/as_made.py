"""Yields by manufacturing errors: simulated by others, shown with the verification."""

from __future__ import annotations

from dataclasses import dataclass

NOT_MODELLED = "lens 2 mm, shadows"
"""By no simulated build; the figure is of the paper's design: docs/tolerance.md has them all."""
MOST, NEAREST = 3, 2  # processes that can, and that cannot, of which the verdict tells
GOOD = 0.95  # share of few builds that stands for a process that can make a design
NOT_SIMULATED = "Can be made: tbcad tolerance FOLDER simulates builds with manufacturing errors"


@dataclass(frozen=True)
class ProcessYield:
    """Simulated builds by one manufacturing process."""

    process: str  # its name
    share: float  # of the builds whose every virtual camera sees the whole object
    coverage_mm: float  # median of the builds' minimum coverage
    builds: int  # as many as asked for, or fewer where enough had failed


@dataclass(frozen=True)
class AsMade:
    """Simulated builds of one design, without any new search for its margin."""

    builds: int = 0  # by each process at most: `enough_bad` ones end them
    # the largest coverage first; empty if they could not be simulated
    processes: tuple[ProcessYield, ...] = ()
    reason: str = ""  # why not


def enough_bad(builds: int) -> int:
    """Bad builds with which a process is not good, however the others of so many are."""
    return int(builds * (1 - GOOD) + 1e-9) + 1


def as_made_lines(as_made: AsMade | None, valleys: bool) -> list[str]:
    """The same in words, and what the solids have not, where mirrors meet in valleys.

    Without simulated builds: the command that makes them.
    """
    fillets = ["Left out of the solids: a cutter's fillets, rounding of ridges"] * valleys
    if as_made is None:
        return [NOT_SIMULATED, *fillets]
    if not as_made.processes:
        return [f"Can be made: not simulated, {as_made.reason}", *fillets]
    good: list[str] = []
    others: list[str] = []
    for one in as_made.processes:
        is_good, count = one.share >= GOOD, f"{one.share * one.builds:.0f}/{one.builds}"
        words = f"{one.process} {f'{one.share:.0%}' if is_good else count} {one.coverage_mm:.3g}"
        (good if is_good else others).append(words)
    return [
        f"Can be made ({as_made.builds} simulated builds, or until "
        f"{enough_bad(as_made.builds)} fail: yield, median minimum in mm)",
        f"  by: {', '.join(good[:MOST]) or 'none of the built-in processes'}",
        *([f"  not by: {', '.join(others[:NEAREST])}; more: --for-process"] if others else []),
        f"  left out: {NOT_MODELLED}{'; fillets, ridges not in solids' * valleys}",
    ]

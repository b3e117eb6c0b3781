"""Yields by manufacturing errors: simulated by others, shown with the verification."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

NOT_MODELLED = "lens 2 mm, shadows"
"""By no simulated build; the figure is of the paper's design: docs/tolerance.md has them all."""
MOST, NEAREST = 3, 2  # processes that can, and that cannot, of which the verdict tells
GOOD = 0.95  # share of few builds: a process with this yield can make a design
NOT_SIMULATED = "tbcad tolerance FOLDER simulates builds with manufacturing errors"
FILLETS = "a cutter's fillets, rounding of ridges"
WIDEST = 80  # columns of a line
FEW = 50


@dataclass(frozen=True)
class ProcessYield:
    """Simulated builds by one manufacturing process."""

    process: str  # its name
    share: float  # of the builds whose every virtual camera sees the whole object
    coverage_mm: float  # median of the builds' minimum coverage
    builds: int  # as many as asked for, or fewer where enough had failed

    @property
    def is_good(self) -> bool:
        """Whether the process can make the design."""
        return self.share >= GOOD

    @property
    def text(self) -> str:
        """The yield in words: as a percentage where all builds were simulated, else counted."""
        if self.is_good:
            return f"{self.share:.0%}"
        return f"{self.share * self.builds:.0f}/{self.builds}"


@dataclass(frozen=True)
class AsMade:
    """Simulated builds of one design, without any new search for its margin."""

    builds: int = FEW  # by each process at most: `enough_bad` ones end them
    # of both shells, the largest coverage first; empty if they could not be simulated
    processes: tuple[ProcessYield, ...] = ()
    reason: str = ""  # why not
    prototype: ProcessYield | None = None  # of printed and calibrated prototypes


def enough_bad(builds: int) -> int:
    """Failed builds with which the yield is too small, however the others of so many are."""
    return int(builds * (1 - GOOD) + 1e-9) + 1


def shells_line(as_made: AsMade | None) -> str:
    """Which chains make the shells, and at what yield."""
    if as_made is None:
        return f"Shells: {NOT_SIMULATED}"
    if not as_made.processes:
        return f"Shells: yield not simulated: {as_made.reason or 'the record cannot be read'}"
    good = [f"{one.text} by {one.process}" for one in as_made.processes if one.is_good]
    if good:
        more = f" and {len(good) - MOST} more" if len(good) > MOST else ""
        return f"Shells: yield {', '.join(good[:MOST])}{more}"
    best = max(as_made.processes, key=lambda one: (one.share, one.coverage_mm))
    return f"Shells: no built-in process yields {GOOD:.0%}; best: {best.text} by {best.process}"


def prototype_line(as_made: AsMade | None, parts: int, unprintable: int) -> str:
    """The yield of calibrated prototypes, and how many of its parts its printer cannot make."""
    printer = f"all {parts} parts can be made"
    if unprintable:
        printer = f"{unprintable} of {parts} parts cannot be made"
    made = as_made.prototype if as_made else None
    if made is None:
        return f"Prototype: yield not simulated; {printer}"
    return f"Prototype: yield {made.text}, printed by {made.process.upper()}, calibrated; {printer}"


def as_made_lines(as_made: AsMade | None, target_mm: float, valleys: bool) -> Iterator[str]:
    """Yield and median coverage of each, and what the solids lack where mirrors meet in valleys."""
    if as_made is None or not (as_made.processes or as_made.prototype):
        yield from [f"Left out of the solids: {FILLETS}"] * valleys
        return
    fail = enough_bad(as_made.builds)
    yield (
        f"Yield of {as_made.builds} simulated builds, or until {fail} fail, at {target_mm:g} mm; "
        "median coverage:"
    )
    yield _medians(as_made)
    yield f"  left out: {NOT_MODELLED}{'; fillets, ridges not in solids' * valleys}"


def _medians(as_made: AsMade) -> str:
    """As many processes as a line has room for, those of the verdict first, and the prototype."""
    good = [one for one in as_made.processes if one.is_good][:MOST]
    others = [one for one in as_made.processes if not one.is_good][:NEAREST]
    shown = [*good, *others]
    ends = [f"prototype {_median(made)}"] if (made := as_made.prototype) else []
    for count in range(len(shown), -1, -1):
        shells = ", ".join(f"{one.process} {_median(one)}" for one in shown[:count])
        line = "  " + "; ".join(filter(None, [shells, *ends]))
        if len(line) <= WIDEST:
            break
    return line


def _median(made: ProcessYield) -> str:
    return f"{made.text} {made.coverage_mm:.3g}"

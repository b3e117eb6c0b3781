"""Designs that differ from one in a few keys, made in threads."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from tbcad.common.results import Table
from tbcad.common.schedule import run_units
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.spec.design import Spec, spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.errors import InputError
from tbcad.types import Floats, Progress

Result = TypeVar("Result")

MAX_N = 60


@dataclass(frozen=True)
class DesignAttempt:
    """A design, or why there is none."""

    design: MirrorDesign | None  # None where the spec was refused
    reason: str = ""  # what the refusal says, else ""

    @property
    def array(self) -> MirrorArray | None:
        """Camera a with its mirrors."""
        return self.design.arrays[0] if self.design else None


def try_design(spec: Spec, **sections: dict[str, object]) -> DesignAttempt:
    """The design of a spec with other values of some keys, or why there is none."""
    try:
        return DesignAttempt(design(spec_with(spec, **sections)))
    except SpecError as error:
        return DesignAttempt(None, str(error))


def n_range(first: int, last: int) -> range:
    """The subdivisions of a sweep, both ends included.

    Raises:
        InputError: there are none, or no design may have them.
    """
    if not 1 <= first <= last <= MAX_N:
        raise InputError(
            f"n from {first} to {last}: allowed is 1 to {MAX_N}, the first no more than the "
            "last: change --from or --to"
        )
    return range(first, last + 1)


def for_each_n(
    work: Callable[[int], Result],
    ns: range,
    progress: Progress,
    scheduler: str | None = None,
) -> list[Result]:
    """Work for every n, results in the order of n.

    Args:
        work: for one n; with a scheduler it must be fit for pickling.
        ns: subdivisions.
        progress: called with each n that is done.
        scheduler: address of a Dask scheduler; None for this machine's cores.
    """
    # The largest take longest, so they are begun first.
    return run_units(work, list(reversed(ns)), scheduler, lambda n: progress(f"n = {n}"))[::-1]


def megapixels(table: Table) -> Floats:
    """Millions of pixels of the sensors in a table's columns width_px and height_px, (k,)."""
    return table.numbers("width_px") * table.numbers("height_px") / 1e6

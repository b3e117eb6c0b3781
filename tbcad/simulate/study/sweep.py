"""Designs that differ from one in a few keys, made in threads."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.schedule import run
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.types import Progress

Result = TypeVar("Result")

MAX_N = 60


@dataclass(frozen=True)
class DesignAttempt:
    """A design, or why there is none.

    Attributes:
        made: the design; None where it was refused.
        reason: what the refusal says, else "".
    """

    made: MirrorDesign | None
    reason: str = ""


def try_design(spec: Spec) -> DesignAttempt:
    """The design of a spec, or why there is none: a study goes on without it."""
    try:
        return DesignAttempt(design(spec))
    except SpecError as error:
        return DesignAttempt(None, str(error))


def spec_with(
    spec: Spec, n: int | None = None, rule: str | None = None, margin_mm: float | None = None
) -> Spec:
    """The spec with another subdivision, radius rule or margin."""
    optics = _with(spec.optics, n=n)
    mirrors = _with(spec.mirrors, radius_rule=rule, margin_mm=margin_mm)
    return spec.model_copy(update={"optics": optics, "mirrors": mirrors})


def _with(section: Any, **keys: object) -> Any:
    return section.model_copy(update={k: v for k, v in keys.items() if v is not None})


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
        progress: told of each n that is done.
        scheduler: address of a Dask scheduler; None for this machine's cores.
    """
    # The largest take longest, so they are begun first.
    return run(work, list(reversed(ns)), scheduler, lambda n: progress(f"n = {n}"))[::-1]

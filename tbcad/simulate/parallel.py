"""Compiled loops: numba, without the interpreter's lock, so that threads share the work."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from typing import TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])
Item = TypeVar("Item")
Result = TypeVar("Result")

THREADS = min(cpu_count() or 1, 8)


def compiled(function: Function) -> Function:
    """The function, compiled when first called and kept for the next process."""
    try:
        made: Function = njit(nogil=True, cache=True)(function)
    except RuntimeError:  # no folder that may be written: compile in every process
        made = njit(nogil=True)(function)
    return made


def in_threads(work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Results in the items' order, whatever the threads do."""
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(work, items))

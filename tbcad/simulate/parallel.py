"""Work in threads, and loops compiled by numba, which release the interpreter's lock."""

from collections.abc import Callable, Iterable, Iterator, Sequence
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
    return _compiled(function)


def compiled_loop(function: Function) -> Function:
    """The same, but a division by zero gives infinity or NaN, as in numpy, and no error.

    Without that test a loop can become vector instructions of the processor, with the same bits.
    """
    return _compiled(function, error_model="numpy")


def _compiled(function: Function, **options: str) -> Function:
    try:
        result: Function = njit(nogil=True, cache=True, **options)(function)
    except RuntimeError:  # no folder that may be written: compile in every process
        result = njit(nogil=True, **options)(function)
    return result


def in_threads(work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Results in the items' order."""
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(work, items))


def first_then_threads(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The same, but the first item alone, before any thread.

    So loops are compiled by one thread: once, two threads that called a loop which was not
    compiled yet have ended the process.
    """
    return [work(item) for item in items[:1]] + in_threads(work, items[1:])


def in_batches(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    begin: Callable[[Item], object] = lambda _: None,
) -> Iterator[Result]:
    """Results in the items' order, of which few are in memory at a time.

    Args:
        work: run in threads.
        items: what to work on.
        begin: called with the first item of each batch before the batch.
    """
    for batch in chunks(len(items), 2 * THREADS):
        begin(items[batch.start])
        yield from in_threads(work, items[batch])


def chunks(count: int, size: int) -> list[slice]:
    """Slices of at most `size` that cover `count` items."""
    return [slice(first, min(first + size, count)) for first in range(0, count, size)]

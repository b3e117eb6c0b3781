"""Work in threads."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Item = TypeVar("Item")
Result = TypeVar("Result")

THREADS = min(cpu_count() or 1, 8)


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


def over_chunks(work: Callable[[slice], NDArray[Any]], count: int, size: int) -> NDArray[Any]:
    """Arrays of what is in slices of at most `size` of `count` items, one after the other.

    First that of no item, whose shape and kind all others have: loops are compiled before threads.
    """
    parts = first_then_threads(work, [slice(0, 0), *chunks(count, size)])
    return np.concatenate(parts)


def in_batches(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    begin: Callable[[Item], object] = lambda _: None,
) -> Iterator[Result]:
    """Results in the items' order, of which few are in memory at a time.

    `begin` is called with the first item of each batch before the batch.
    """
    for batch in chunks(len(items), 2 * THREADS):
        begin(items[batch.start])
        yield from in_threads(work, items[batch])


def chunks(count: int, size: int) -> list[slice]:
    """Slices of at most `size` that cover `count` items."""
    return [slice(first, min(first + size, count)) for first in range(0, count, size)]

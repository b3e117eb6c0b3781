"""Loops compiled by numba, which release the interpreter's lock.

Machine code is kept for the next process. numba compiles again where the loop's own module has
changed; here also where one has that it brings loops or numbers from, and where a file is damaged.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """The function, compiled when first called and kept for the next process."""
    return _compiled(function)


def compiled_loop(function: Function) -> Function:
    """The same, but a division by zero gives infinity or NaN, as in numpy, and no error.

    Without that test a loop can become vector instructions of the processor, with the same bits.
    """
    return _compiled(function, error_model="numpy")


def compiled_part(function: Function) -> Function:
    """The same for what other compiled loops alone call, and Python cannot.

    It has neither a wrapper for Python nor a file: a quarter of the first compiling.
    """
    result: Function = njit(
        nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
    )(function)
    return result


def compiled_sum(function: Function) -> Function:
    """The same, and sums may be taken in another order: equal bits on equal processors only."""
    return _compiled(function, error_model="numpy", fastmath=True)


def _compiled(function: Function, **options: str | bool) -> Function:
    result: Any = njit(nogil=True, **options)(function)
    with suppress(RuntimeError):  # no folder that may be written: compile in every process
        result._cache = _MachineCode(function)
    kept: Function = result
    return kept


class _MachineCode(FunctionCache):  # type: ignore[misc]
    """Files of a loop's machine code."""

    def __init__(self, function: Callable[..., object]) -> None:
        super().__init__(function)
        own = self._cache_file._source_stamp
        self._cache_file._source_stamp = own, _stamp(function.__globals__)

    def load_overload(self, *arguments: Any) -> Any:
        """None where there is none, or none that can be read."""
        with suppress(Exception):  # whatever pickle makes of a damaged file
            return super().load_overload(*arguments)
        with suppress(OSError):
            self.flush()  # or what is compiled now could not be added
        return None

    def save_overload(self, *arguments: Any) -> None:
        """Nothing is kept on a full disk."""
        with suppress(OSError):
            super().save_overload(*arguments)


def _stamp(names: dict[str, Any]) -> str:
    """Digest of what loops of a module follow from: modules that they are from, and numbers."""
    found = sha256()
    for module in _modules(names, {}).values():
        found.update(_content(module["__file__"]))
        found.update(repr(list(_numbers(module))).encode())
    return found.hexdigest()


def _modules(names: dict[str, Any], found: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """The names of a module, and of all that it has loops from, by module."""
    if names["__name__"] not in found:
        found[names["__name__"]] = names
        for one in tuple(names.values()):
            if isinstance(one, Dispatcher):
                _modules(one.py_func.__globals__, found)
    return found


def _numbers(names: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Numbers of a module, of which loops have the values that they were compiled with."""
    for name, value in names.items():
        if isinstance(value, np.ndarray):
            yield name, value.tolist()
        elif _is_of_numbers(value):
            yield name, value


def _is_of_numbers(value: object) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_of_numbers, value))
    return isinstance(value, (int, float))


@cache
def _content(file: str) -> bytes:
    return Path(file).read_bytes()

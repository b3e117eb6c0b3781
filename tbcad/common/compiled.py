"""Loops compiled by numba, which release the interpreter's lock."""

from collections.abc import Callable
from typing import TypeVar

from numba import njit

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
    try:
        result: Function = njit(nogil=True, cache=True, **options)(function)
    except RuntimeError:  # no folder that may be written: compile in every process
        result = njit(nogil=True, **options)(function)
    return result

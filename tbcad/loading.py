"""Loading of libraries that bring very many objects."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

from tbcad.own_process import is_own_process


@contextmanager
def large_libraries() -> Iterator[None]:
    """Load libraries in this block without looking for garbage among their objects, then or later.

    The CAD kernel brings several hundred thousand: searching them again and again while they grow
    takes a quarter of the time of loading them. In a user's process this does nothing: the user's
    garbage would be kept for ever.
    """
    if not is_own_process():
        yield
        return
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if enabled:
            gc.enable()

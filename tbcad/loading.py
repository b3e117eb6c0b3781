"""Loading of libraries that bring very many objects."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def large_libraries() -> Iterator[None]:
    """Load libraries in this block without looking for garbage among their objects, then or later.

    The CAD kernel brings several hundred thousand: searching them again and again while they grow
    takes a quarter of the time of loading them.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if enabled:
            gc.enable()

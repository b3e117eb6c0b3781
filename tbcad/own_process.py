"""Whether this process is a command's own, which may be copied and set up as suits the command.

A library is a guest: a copy of its user's process would hold other threads' locks for ever, and a
process started by `multiprocessing` would run the user's script again.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_owned: ContextVar[bool] = ContextVar("owned", default=False)  # other threads see the default


def is_own_process() -> bool:
    """Whether this is called inside `own_process`, in its thread."""
    return _owned.get()


@contextmanager
def own_process() -> Iterator[None]:
    """Let the block copy the process and start others: for the entry point of a command."""
    token = _owned.set(True)
    try:
        yield
    finally:
        _owned.reset(token)

"""A process that computes a design: a copy of this one, which meanwhile loads the CAD kernel.

That takes as long as mirrors and arrangement, and a thread would wait for it: the interpreter's
lock is held all the time.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any

from tbcad.background import may_fork
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.process_copy import copied_process, next_result
from tbcad.prototype.arrangement import Arrangement, arrange, arrangements
from tbcad.spec.design import Spec
from tbcad.types import Progress

ENDED = "the process that computes the mirrors ended: is memory short?"


@dataclass(frozen=True)
class DesignAhead:
    """Mirrors and arrangements that a process computes ahead; without one, here when asked for.

    Attributes:
        spec: of the design.
        pipe: to the process; None without.
        arranged: whether it computes an arrangement too.
    """

    spec: Spec
    pipe: Connection | None
    arranged: bool

    def mirrors(self, detail: Progress) -> MirrorDesign:
        """The mirrors; to be asked for once, and first. Raises as `mirrors.array.design`."""
        if self.pipe is None:
            return design(self.spec, detail)
        mirrors: MirrorDesign = next_result(self.pipe, detail, ENDED)
        return mirrors

    def arrangements(self, mirrors: MirrorDesign) -> Iterator[Arrangement]:
        """As `prototype.arrangement.arrangements`, whose first has been computed ahead."""
        if self.pipe is None or not self.arranged:
            yield from arrangements(mirrors)
            return
        yield next_result(self.pipe, lambda _: None, ENDED)
        yield from islice(arrangements(mirrors), 1, None)


@contextmanager
def design_process(spec: Spec, arranged: bool) -> Iterator[DesignAhead]:
    """Compute a design in a copy of this process, which ends with the block.

    Args:
        spec: of the design.
        arranged: compute the first arrangement of its prototype too.
    """
    if not may_fork():
        yield DesignAhead(spec, None, arranged)
        return
    with copied_process(partial(_serve, spec, arranged)) as pipe:
        yield DesignAhead(spec, pipe, arranged)


def _serve(spec: Spec, arranged: bool, pipe: Connection) -> None:
    mirrors = _outcome(lambda: design(spec, pipe.send))
    # A pipe holds little: this process would wait until the mirrors are taken.
    sending = Thread(target=pipe.send, args=(mirrors,))
    sending.start()
    if isinstance(mirrors, MirrorDesign) and arranged:
        first = _outcome(lambda: _arranged(mirrors))
        sending.join()
        pipe.send(first)


def _arranged(mirrors: MirrorDesign) -> Arrangement:
    """The first arrangement, and what its record asks for, whose compiled loops are loaded here."""
    first = arrange(mirrors)
    _ = first.layout.alternatives  # kept with it
    return first


def _outcome(work: Callable[[], Any]) -> Any:
    """What work returns, or why there is none: a pipe carries either."""
    try:
        return work()
    except Exception as error:
        return error

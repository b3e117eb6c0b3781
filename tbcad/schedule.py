"""Units of work, run on the cores of this machine or on a Dask cluster: the same results.

A unit's result may depend on the unit alone, never on which worker had it or when; then the
number of workers, their order and their deaths change nothing. (Another kind of processor may
round a last digit otherwise: numpy and its kin choose their code by what the processor can do.)
"""

import logging
import os
import pickle
import platform
import socket
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar
from urllib.parse import urlsplit

from tbcad.errors import InputError
from tbcad.version import __version__

Unit = TypeVar("Unit")
Result = TypeVar("Result")
Versions = dict[str, str]

# A unit that fails for a worker's own reasons (memory, disk) is tried again. A worker's death is
# no failure of the unit: the scheduler gives the unit to others, four times by its own settings.
RETRIES = 2
PATIENCE = 30.0  # seconds without any worker
_CONNECT = 10.0  # seconds
_LOOK = 2.0  # seconds between looks for workers
_LONGEST_GREETING = 1_000_000  # bytes; it has some hundred
_SCHEMES = ("tcp", "tls", "ws", "wss")
_CONCERNED = ("numpy", "scipy", "numba")  # packages whose version may change a figure
_ASK = "__import__('tbcad.schedule', fromlist=['versions']).versions()"


def ignore_progress(_: object) -> None:
    """Tell nobody."""


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_units(
    work: Callable[[Unit], Result],
    units: Sequence[Unit],
    scheduler: str | None = None,
    progress: Callable[[Unit], None] = ignore_progress,
    workers: int | None = None,
    patience: float = PATIENCE,
) -> list[Result]:
    """Return the results of all units, in the order of the units.

    Args:
        work: makes a unit's result from the unit alone. With a scheduler, it and the results must
            be fit for pickling, which closures and lambdas are.
        units: the earlier ones are begun first, so the longest belong in front.
        scheduler: address of a Dask scheduler ("tcp://host:8786"); None: threads of this process.
        progress: told of each unit when it is done, in this thread.
        workers: number of threads without a scheduler; None: one for each core.
        patience: seconds to wait with no worker at the scheduler.

    Raises:
        InputError: no dask; no such scheduler, or it goes away; no worker, or one with another
            version; a unit that kills its workers. Beside it, what work raises.
    """
    if scheduler is None:
        return _in_threads(work, units, progress, workers or cores())
    with _quiet(), _cluster(scheduler, patience) as client:
        expected = _same_versions(client, scheduler)
        # The work is sent once, as a task of its own: if all that hold it die, it is made again.
        held = client.submit(pickle.loads, _pickled(work), pure=False)
        sent = [
            client.submit(_on_worker, held, unit, expected, pure=False, retries=RETRIES)
            for unit in units
        ]
        # However this ends, Ctrl-C among it: the client goes, and what is not done is dropped.
        return _gathered(client, sent, units, progress, scheduler, patience)


@cache
def versions() -> Versions:
    """Return what must be the same here and on every worker for the same figures."""
    python = ".".join(platform.python_version_tuple()[:2])
    packages = {name: _version(name) for name in _CONCERNED}
    return {"tbcad": __version__, "Python": python, **packages, "tbcad's code": _code()}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def _code() -> str:
    """Short digest of tbcad's modules: a checkout may have other code under the same version."""
    root = Path(__file__).parent
    digest = sha256()
    for path in sorted(root.rglob("*.py"), key=lambda path: path.relative_to(root).as_posix()):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


def _in_threads(
    work: Callable[[Unit], Result],
    units: Sequence[Unit],
    progress: Callable[[Unit], None],
    threads: int,
) -> list[Result]:
    with ThreadPoolExecutor(threads) as pool:
        place: dict[Future[Result], int] = {pool.submit(work, u): i for i, u in enumerate(units)}
        try:
            for future in as_completed(place):
                future.result()
                progress(units[place[future]])
        except BaseException:  # Ctrl-C among them: what has not begun never will
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        return [future.result() for future in place]


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep distributed's log, which tells of lost connections in many lines, off the screen."""
    log = logging.getLogger("distributed")
    level = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(level)


@contextmanager
def _cluster(address: str, patience: float) -> Iterator[Any]:
    """A client of the scheduler, once it has a worker."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            f"--scheduler {address}: dask is not installed: pip install 'tbcad[cluster]'"
        ) from None
    try:
        _knock(address)
        client = Client(address, timeout=_CONNECT, name="tbcad")
    except (OSError, ValueError):  # a time-out is an OSError
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers there: start "
            "`dask scheduler`, or give its address as tcp://host:8786"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise _no_workers(address, patience) from None
        yield client


def _knock(address: str) -> None:
    """Raise OSError or ValueError where no scheduler is: a client would try on, or wait forever."""
    place = urlsplit(address)
    if place.scheme not in _SCHEMES or place.port is None:
        raise ValueError(address)
    with socket.create_connection((place.hostname or "", place.port), timeout=_CONNECT) as line:
        if place.scheme == "tcp":  # a scheduler greets at once, with the length of what it says
            length = int.from_bytes(line.recv(8, socket.MSG_WAITALL), "little")
            if not 0 < length < _LONGEST_GREETING:
                raise ValueError(address)


def _no_workers(address: str, patience: float) -> InputError:
    return InputError(
        f"--scheduler {address}: no worker for {patience:g} s: start `dask worker {address}`"
    )


def _same_versions(client: Any, address: str) -> Versions:
    """Versions here, once every worker has said that it has the same."""
    here = versions()
    for worker, there in sorted(client.run(eval, _ASK, on_error="return").items()):
        if isinstance(there, Exception):
            raise InputError(
                f"--scheduler {address}: worker {worker} cannot use tbcad ({there}): install "
                f"tbcad {__version__} there"
            )
        _refuse_other(here, there, f"--scheduler {address}: worker {worker}")
    return here


def _refuse_other(here: Versions, there: Versions, where: str) -> None:
    other = {name: there.get(name, "none") for name in here if there.get(name) != here[name]}
    for name, found in other.items():
        raise InputError(
            f"{where} has {name} {found}, allowed is {here[name]} as here: install the same there"
        )


def _pickled(work: object) -> bytes:
    from cloudpickle import dumps

    result: bytes = dumps(work)
    return result


def _on_worker(work: Callable[[Unit], Result], unit: Unit, expected: Versions) -> Result:
    # Again, for workers that came later than the question at the start.
    _refuse_other(expected, versions(), f"a worker on {platform.node()}")
    return work(unit)


def _gathered(
    client: Any,
    sent: list[Any],
    units: Sequence[Unit],
    progress: Callable[[Unit], None],
    address: str,
    patience: float,
) -> list[Any]:
    """Results by unit, each brought here as soon as it is there: a later death cannot take it."""
    results: list[Any] = [None] * len(units)
    place = {future.key: i for i, future in enumerate(sent)}
    pending = set(sent)
    while pending:
        done = _some_done(client, pending, address, patience)
        for future, result in zip(done, _results(client, done, address), strict=True):
            results[place[future.key]] = result
            progress(units[place[future.key]])
        pending.difference_update(done)
    return results


def _some_done(client: Any, pending: set[Any], address: str, patience: float) -> list[Any]:
    """Futures that are done, when there are any."""
    from distributed import CancelledError, wait

    seen = monotonic()
    while True:
        try:
            done = wait(pending, timeout=_LOOK, return_when="FIRST_COMPLETED").done
            return sorted(done, key=lambda future: str(future.key))
        except CancelledError:
            raise _gone(address) from None
        except TimeoutError:
            if _has_workers(client, address):
                seen = monotonic()
            elif monotonic() - seen > patience:
                raise _no_workers(address, patience) from None


def _has_workers(client: Any, address: str) -> bool:
    try:
        return bool(client.nthreads())
    except (OSError, TimeoutError):
        raise _gone(address) from None


def _results(client: Any, done: list[Any], address: str) -> list[Any]:
    from distributed import CancelledError, KilledWorker
    from distributed.comm import CommClosedError

    try:
        result: list[Any] = client.gather(done)
        return result
    except KilledWorker as error:
        raise InputError(
            f"--scheduler {address}: {error.allowed_failures + 1} workers died over one unit of "
            "work: give the workers more memory and run again"
        ) from None
    except (CancelledError, CommClosedError):
        raise _gone(address) from None


def _gone(address: str) -> InputError:
    return InputError(
        f"--scheduler {address}: the scheduler went away: start it with its workers and run again"
    )

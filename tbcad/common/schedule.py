"""Work in other processes; units of work on the cores of this machine or on a Dask cluster.

A unit's result may depend on the unit alone, never on its worker or on time; then the number of
workers, their order and their deaths change nothing. (Another kind of processor may round a last
digit differently: numpy and its kin choose their code by the features of the processor.)
"""

import logging
import os
import pickle
import platform
import socket
import warnings
from asyncio import run_coroutine_threadsafe
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from concurrent.futures import wait as wait_for_futures
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache, partial
from hashlib import sha256
from importlib.metadata import version
from operator import call
from pathlib import Path
from time import monotonic
from typing import Any, TypeAlias, TypeVar
from urllib.parse import urlsplit

from tbcad_verify.run.processes import ProcessEnded, Processes

from tbcad.errors import InputError, ProcessLost
from tbcad.version import __version__

Submit: TypeAlias = Callable[..., "Future[Any]"]
"""Takes a function of a module and its arguments, which are copied; the result comes later."""


@contextmanager
def background_processes(number: int = 1) -> Iterator[Submit]:
    """Do work in other processes, each a piece after the other, while the block runs.

    At the block's end all of it is done. A block that fails, or is interrupted, ends it at once.

    Exception: the first that the work raised; ProcessLost: a process ended before its work was
    done.
    """
    with Processes(number) as processes, background_work(processes) as submit:
        yield submit


@contextmanager
def background_work(processes: Processes) -> Iterator[Submit]:
    """The same in processes that are there before and after the block."""
    futures: list[Future[Any]] = []

    def submit(work: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        futures.append(processes.submit(work, *arguments))
        return futures[-1]

    try:
        yield submit
        for future in futures:
            future.result()
    except ProcessEnded as end:
        raise ProcessLost(f"a process ended before its work was done: {end}") from None


Unit = TypeVar("Unit")
Result = TypeVar("Result")
Versions = dict[str, str]

# A unit that fails for a worker's own reasons (memory, disk) is tried again. The death of a worker
# is not a failure of the unit: the scheduler gives the unit to others, by default four times.
RETRIES = 2
PATIENCE = 30.0  # seconds without any worker
_CONNECT_TIMEOUT = 10.0  # seconds
_CHECK_INTERVAL = 2.0  # seconds between checks for workers
_MAX_GREETING = 1_000_000  # bytes; a scheduler's greeting has some hundred
_ENCRYPTED = ("tls", "wss")
_SCHEMES = ("tcp", "ws", *_ENCRYPTED)
_PACKAGES = ("numpy", "scipy", "numba")  # packages whose version may change a figure


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_units(
    work: Callable[[Unit], Result],
    units: Sequence[Unit],
    scheduler: str | None = None,
    progress: Callable[[Unit], None] = lambda _: None,
    workers: int | None = None,
    patience: float = PATIENCE,
) -> list[Result]:
    """Return the results of all units, in the order of the units: put the longest in front.

    Work makes a unit's result from the unit alone, by a number of threads of this process (None:
    one for each core), or with a Dask scheduler ("tcp://host:8786"); then it and the results must
    be picklable, which closures and lambdas are, and patience is for seconds without any worker.
    Progress is called with each unit when it is done, in this thread.

    InputError: no dask; no such scheduler, or it goes away; no worker, or one with another version;
    a unit that kills its workers; Exception: what work raises.
    """
    if scheduler is None:
        return _in_threads(work, units, progress, workers or cores())
    if not units:
        return []
    with one_client(scheduler, patience) as client, _scheduler_errors(scheduler):
        from cloudpickle import dumps

        # The work is sent once, as a task of its own: if all that hold it die, it is made again.
        on_worker = partial(_on_worker, work, expected=versions(), scheduler=scheduler)
        shared = client.submit(pickle.loads, dumps(on_worker), pure=False)
        _spread(client, shared, patience)
        # In one graph: of units that come one by one the first all go to one worker.
        each = [shared] * len(units), units
        futures = client.map(call, *each, pure=False, retries=RETRIES)
        # However this ends, by an interrupt too: the client goes, and what is not done is dropped.
        check = _worker_check(client, scheduler, patience)
        return _gathered(client, futures, units, progress, check)


def _spread(client: Any, shared: Any, patience: float) -> None:
    """Let every worker have the work: units go to those that do, and few units to one of them."""
    from distributed import wait as wait_for

    with suppress(TimeoutError):  # what is wrong with the cluster, the check of workers tells
        wait_for(shared, timeout=patience)
        if shared.status == "finished":
            client.replicate([shared], callback_timeout=patience)


_CLIENTS: ContextVar[dict[str, Any] | None] = ContextVar("clients", default=None)


@contextmanager
def one_client(scheduler: str | None, patience: float = PATIENCE) -> Iterator[Any]:
    """A client of a scheduler, which every `run_units` within the block uses too.

    Without a scheduler, None: a command has the block whatever it is given. Errors are those of
    `run_units`.
    """
    known = _CLIENTS.get() or {}
    if scheduler is None or scheduler in known:
        yield known.get(scheduler or "")
        return
    with _quiet(), _scheduler_errors(scheduler), _cluster(scheduler, patience) as client:
        token = _CLIENTS.set({**known, scheduler: client})
        try:
            yield client
        finally:
            _CLIENTS.reset(token)


def _in_threads(
    work: Callable[[Unit], Result],
    units: Sequence[Unit],
    progress: Callable[[Unit], None],
    threads: int,
) -> list[Result]:
    with ThreadPoolExecutor(threads) as pool:
        numbers = {pool.submit(work, unit): number for number, unit in enumerate(units)}
        try:
            for future in as_completed(numbers):
                future.result()
                progress(units[numbers[future]])
        except BaseException:  # an interrupt too: what has not begun never will
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        return [future.result() for future in numbers]


def _gathered(
    client: Any,
    futures: list[Any],
    units: Sequence[Unit],
    progress: Callable[[Unit], None],
    check_workers: Callable[[], None],
) -> list[Any]:
    """Results of all units, each fetched as soon as it is done: a later death loses none."""
    from distributed import wait

    numbers = {future: number for number, future in enumerate(futures)}
    results: dict[Any, Any] = {}
    while pending := numbers.keys() - results.keys():
        try:
            done = list(wait(pending, _CHECK_INTERVAL, "FIRST_COMPLETED").done)
        except TimeoutError:
            check_workers()
            continue
        for future, result in zip(done, _fetched(client, done, check_workers), strict=True):
            results[future] = result
            progress(units[numbers[future]])
    return [results[future] for future in futures]


def _fetched(client: Any, done: list[Any], check_workers: Callable[[], None]) -> list[Any]:
    """Results of units that are done, however long they take to come, while both ends answer."""
    coming = client.gather(done, asynchronous=True)
    arrived = run_coroutine_threadsafe(coming, client.loop.asyncio_loop)
    while not wait_for_futures([arrived], _CHECK_INTERVAL).done:
        check_workers()
    found: list[Any] = arrived.result()
    return found


@cache
def versions() -> Versions:
    """Return what must be the same here and on every worker for the same figures."""
    python = ".".join(platform.python_version_tuple()[:2])
    packages = {name: version(name) for name in _PACKAGES}
    return {"tbcad": __version__, "Python": python, **packages, "tbcad's code": _code()}


def _code() -> str:
    """Short digest of tbcad's modules: a checkout may have other code under the same version."""
    root = Path(__file__).parents[1]
    digest = sha256()
    for path in sorted(root.rglob("*.py"), key=lambda path: path.relative_to(root).as_posix()):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


def _on_worker(
    work: Callable[[Unit], Result], unit: Unit, expected: Versions, scheduler: str
) -> Result:
    """Result of a unit on a worker, which must have the same versions as the client."""
    for name, installed in versions().items():
        if installed != expected[name]:
            raise InputError(
                f"--scheduler {scheduler}: a worker on {platform.node()} has {name} {installed}, "
                f"allowed is {expected[name]} as here: install the same there"
            )
    return work(unit)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep distributed's log and advice, in many lines, off the screen.

    The log reports lost connections; the advice is for tasks of more than 10 MB, as `shared` is.
    """
    log = logging.getLogger("distributed")
    level = log.level
    log.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")
            yield
    finally:
        log.setLevel(level)


@contextmanager
def _scheduler_errors(address: str) -> Iterator[None]:
    """Raise what a cluster fails with as an InputError that names the scheduler."""
    try:
        from distributed import CancelledError, KilledWorker
        from distributed.comm import CommClosedError
    except ImportError:
        raise InputError(
            f"--scheduler {address}: dask is not installed: pip install 'tbcad[cluster]'"
        ) from None
    try:
        yield
    except KilledWorker as error:
        raise InputError(
            f"--scheduler {address}: {error.allowed_failures + 1} workers died over one unit of "
            "work: give the workers more memory and run again"
        ) from None
    except ModuleNotFoundError as error:
        if not str(error.name).startswith("tbcad"):
            raise
        raise InputError(
            f"--scheduler {address}: a worker cannot use tbcad ({error}): install tbcad "
            f"{__version__} there"
        ) from None
    except (CancelledError, CommClosedError):
        raise _gone(address) from None


@contextmanager
def _cluster(address: str, patience: float) -> Iterator[Any]:
    """A client of the scheduler, once it has a worker."""
    from distributed import Client

    if urlsplit(address).scheme in _ENCRYPTED:
        _check_certificates(address)
    try:
        _check_greeting(address)
        client = Client(address, timeout=_CONNECT_TIMEOUT, name="tbcad", set_as_default=False)
    except (OSError, ValueError):  # a time-out is an OSError
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers there: start "
            "`dask scheduler`, or give its address as tcp://host:8786"
        ) from None
    except Exception as error:  # whatever comes of an answer of another version
        raise InputError(
            f"--scheduler {address}: what answers there is not understood by distributed "
            f"{version('distributed')} of here ({type(error).__name__}): install the same there"
        ) from None
    try:
        with client.as_current():
            _wait_for_worker(client, address, patience)
            yield client
    finally:
        with suppress(OSError):  # of a scheduler that no longer answers
            client.close()


def _wait_for_worker(client: Any, address: str, patience: float) -> None:
    try:
        client.wait_for_workers(1, timeout=patience)
    except TimeoutError:
        raise _no_workers(address, patience) from None


def _check_certificates(address: str) -> None:
    """Raise an InputError where dask's configuration has none, or some that cannot be read."""
    from distributed import Security

    wrong = "are not there"
    try:
        if Security().get_connection_args("client")["ssl_context"]:
            return
    except OSError as error:  # of ssl, too
        wrong = f"cannot be read ({error.strerror or error})"
    raise InputError(
        f"--scheduler {address}: certificates of dask's configuration {wrong}: set DASK_DISTRIBUTED"
        "__COMM__TLS__CA_FILE, and __CLIENT__CERT and __CLIENT__KEY likewise, to PEM files"
    )


def _check_greeting(address: str) -> None:
    """Raise OSError or ValueError where there is no scheduler: a client would wait forever."""
    url = urlsplit(address)
    if url.scheme not in _SCHEMES or url.port is None:
        raise ValueError(address)
    place = (url.hostname or "", url.port)
    with socket.create_connection(place, timeout=_CONNECT_TIMEOUT) as connection:
        if url.scheme == "tcp":  # a scheduler greets at once, beginning with the length
            length = int.from_bytes(connection.recv(8, socket.MSG_WAITALL), "little")
            if not 0 < length < _MAX_GREETING:
                raise ValueError(address)


def _worker_check(client: Any, address: str, patience: float) -> Callable[[], None]:
    """A check that raises an InputError once a scheduler is gone, or has long had no workers."""
    seen = monotonic()

    def check() -> None:
        nonlocal seen
        try:
            workers = client.sync(client.scheduler.ncores, callback_timeout=patience)
        except (OSError, TimeoutError):  # it may be there and not answer
            raise _gone(address) from None
        if workers:
            seen = monotonic()
        elif monotonic() - seen > patience:
            raise _no_workers(address, patience)

    return check


def _no_workers(address: str, patience: float) -> InputError:
    return InputError(
        f"--scheduler {address}: no worker for {patience:g} s: start `dask worker {address}`"
    )


def _gone(address: str) -> InputError:
    return InputError(
        f"--scheduler {address}: the scheduler went away: start it with its workers and run again"
    )

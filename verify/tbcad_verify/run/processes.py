"""Calls in other processes, which run this module and never the script of the user.

`tbcad` uses it too. Nothing is forked: the caller may have threads, no `__main__` guard, and
settings of its own for signals, memory and `multiprocessing`.
"""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import signal
import struct
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import replace
from importlib import import_module
from queue import SimpleQueue
from typing import IO, Any

from tbcad_verify.run.child import crash_reason
from tbcad_verify.run.kept import STORE, keeping

HEARD, DONE, FAILED = "heard", "done", "failed"  # kinds of answers
LENGTH = struct.Struct("<Q")  # goes before each message, bytes
# Objects that a process makes before it looks for garbage: what its libraries bring stays.
THRESHOLDS = (100_000, 20, 100)
# The GNU C library: freed memory is used again, not given back and filled with zeros page by page.
KEEP_MEMORY = {
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 30),
    "MALLOC_ARENA_MAX": "1",
}


class ProcessEnded(RuntimeError):
    """A process ended, or was ended, before its call was done; the text says how."""


class Processes(ThreadPoolExecutor):
    """An executor whose threads each hand calls to a process of their own, begun when needed.

    A call that crashes or takes too long takes its own process with it and no other. Where no
    process can be started, calls are done here, with the same results.
    """

    def __init__(
        self, number: int, seconds: float | None = None, idle: Processes | None = None
    ) -> None:
        """Work with so many processes at most.

        `seconds`: time limit of a call between what it reports; None: there is none.
        `idle`: others, whose calls are done: their processes, with libraries loaded, go on here.
        """
        super().__init__(number)
        self.seconds = seconds
        self._idle: list[_Process] = idle._handed_over() if idle else []
        self._all = [*self._idle]
        self._killed = False

    def _handed_over(self) -> list[_Process]:
        idle, self._idle = self._idle, []
        self._all = [process for process in self._all if process not in idle]
        return idle

    def submit(  # type: ignore[override]
        self,
        work: Callable[..., Any],
        /,
        *arguments: Any,
        heard: Callable[[Any], object] | None = None,
    ) -> Future[Any]:
        """As `call`, in another thread; the future has what that returns or raises."""
        try:
            context = copy_context()  # with the store of what is kept
            return super().submit(context.run, self.call, work, *arguments, heard=heard)
        except RuntimeError:
            if self._shutdown:
                raise
            future: Future[Any] = Future()  # no thread can be started
            future.set_result(self.call(work, *arguments, heard=heard))
            return future

    def call(
        self,
        work: Callable[..., Any],
        *arguments: Any,
        heard: Callable[[Any], object] | None = None,
    ) -> Any:
        """Call a function in a process and wait for its result.

        `heard`: is called with each value that the function reports: by another function, its
        last argument.

        ProcessEnded: the process ended before; Exception: that the function raised.
        """
        try:
            process = self._idle.pop() if self._idle else self._started()
        except OSError:
            return _here(work, arguments, heard)
        store = STORE.get()
        own = replace(store, reused=set()) if store else None
        try:
            request = work, arguments, heard is not None, own
            kind, value = process.ask(request, heard, self.seconds)
        except BaseException:
            process.kill()
            raise
        self._idle.append(process)
        if kind == FAILED:
            raise value
        result, reused = value
        if store:
            store.reused.update(reused)
        return result

    def _started(self) -> _Process:
        process = _Process()
        self._all.append(process)
        if self._killed:  # meanwhile, by another thread that did not know of it
            process.kill()
        return process

    def kill(self) -> None:
        """End all processes at once; calls that are not done fail."""
        self._killed = True
        self.shutdown(wait=False, cancel_futures=True)
        for process in self._all:
            process.kill()

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        """Wait for all calls; a block that fails ends them."""
        if kind is not None:
            self.kill()
        self.shutdown()
        for process in self._all:
            process.close()


class _Process:
    """A process that answers one call after the other."""

    def __init__(self) -> None:
        # Without the current folder, which may be one that is verified.
        path = os.pathsep.join(place for place in sys.path if place)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**KEEP_MEMORY, **os.environ, "PYTHONPATH": path},
            start_new_session=True,  # an interrupt from the keyboard is for its parent alone
        )
        assert self._process.stdin
        assert self._process.stdout
        self._calls, self._answers = self._process.stdin, self._process.stdout

    def ask(
        self, request: object, heard: Callable[[Any], object] | None, seconds: float | None
    ) -> tuple[str, Any]:
        """Send a call; its outcome, and whether that is an error."""
        message = pickle.dumps(request)
        with contextlib.suppress(OSError):  # that it has ended is told when it should answer
            _write(self._calls, message)
        while True:
            kind, value = self._answer(seconds)
            if kind != HEARD or heard is None:
                return kind, value
            heard(value)

    def _answer(self, seconds: float | None) -> tuple[str, Any]:
        late = threading.Event()

        def stop() -> None:
            late.set()
            self._process.kill()

        timer = threading.Timer(seconds or 0.0, stop)
        timer.daemon = True  # an interrupt as it starts leaves it behind: nothing waits for it
        try:
            if seconds:
                timer.start()
            kind, value = pickle.loads(_read(self._answers))
        except (EOFError, OSError):
            code = self._process.wait()
            if late.is_set():
                raise ProcessEnded(f"no answer within {seconds:g} s") from None
            raise ProcessEnded(crash_reason(code) or f"ended with exit code {code}") from None
        finally:
            timer.cancel()
        return str(kind), value

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Let it end: nothing more is asked."""
        with contextlib.suppress(OSError):
            self._calls.close()
        self._process.wait()
        self._answers.close()


def load(module: str) -> None:
    """Import a module, so that a process is ready before there is work for it."""
    import_module(module)


def at_once(work: Callable[..., Any], *arguments: Any) -> Future[Any]:
    """Do work here and now, to copies as in a process: solids lose the sign of zeros on the way."""
    future: Future[Any] = Future()
    future.set_result(_here(work, arguments, None))
    return future


def _here(
    work: Callable[..., Any], arguments: tuple[Any, ...], heard: Callable[[Any], object] | None
) -> Any:
    work, arguments = pickle.loads(pickle.dumps((work, arguments)))
    return pickle.loads(pickle.dumps(work(*arguments, *([heard] if heard else []))))


def _write(file: IO[bytes], message: bytes) -> None:
    file.write(LENGTH.pack(len(message)))
    file.write(message)
    file.flush()


def _read(file: IO[bytes]) -> bytes:
    head = file.read(LENGTH.size)
    message = file.read(LENGTH.unpack(head)[0]) if len(head) == LENGTH.size else b""
    if not message:
        raise EOFError
    return message


def main() -> None:
    """Answer calls from stdin on stdout, until there are no more or the parent has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.set_threshold(*THRESHOLDS)
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer
    inbox: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(calls, inbox), daemon=True).start()
    while True:
        _write(answers, _answer_to(inbox.get(), answers))


def _receive(calls: IO[bytes], inbox: SimpleQueue[bytes]) -> None:
    """Take calls; without a parent this process ends, whatever it is at."""
    try:
        while True:
            inbox.put(_read(calls))
    except (EOFError, OSError):
        os._exit(0)


def _answer_to(message: bytes, answers: IO[bytes]) -> bytes:
    def report(value: object) -> None:
        _write(answers, pickle.dumps((HEARD, value)))

    try:
        work, arguments, reports, store = pickle.loads(message)
        with keeping(store):
            result = work(*arguments, *([report] if reports else []))
        return pickle.dumps((DONE, (result, store.reused if store else ())))
    except Exception as error:
        error.add_note(traceback.format_exc())
        try:
            return pickle.dumps((FAILED, error))
        except Exception:  # it has what cannot be copied
            return pickle.dumps((FAILED, RuntimeError(f"{type(error).__name__}: {error}")))


if __name__ == "__main__":
    main()

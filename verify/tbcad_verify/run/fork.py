"""A copy of this process, which has all that this one has loaded, and what it sends.

A copy has no other threads: what they hold locked would stay locked in it. Who starts one has
none, neither its own nor those of a library.
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from queue import SimpleQueue
from typing import Any, TypeAlias

from tbcad_verify.errors import BadExport
from tbcad_verify.run.child import crash_reason
from tbcad_verify.run.results import ResultSink

PR_SET_PDEATHSIG = 1  # prctl(2): the signal to get when the parent ends
POSSIBLE = sys.platform == "linux"

StagesWork: TypeAlias = Callable[[ResultSink], None]
"""Stages, which send what they measure."""


@dataclass(frozen=True)
class Fork:
    """A copy of this process at work; it ends with this one."""

    process: BaseProcess

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self.process.pid or 0

    def wait(self) -> int:
        """Wait for its end and return the exit status, that of a signal below zero."""
        self.process.join()
        return self.process.exitcode or 0


def start_fork(work: Callable[[Connection], None], writer: Connection, group: bool) -> Fork:
    """Begin work in a copy of this process.

    Args:
        work: is given the pipe to send to.
        writer: that pipe. This process should close it.
        group: whether it leads a process group of its own, which can be killed as a whole.
    """
    process: BaseProcess = get_context("fork").Process(target=_run, args=(work, writer, group))
    process.start()
    return Fork(process)


def _run(work: Callable[[Connection], None], writer: Connection, group: bool) -> None:
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if group:
        os.setsid()
    null = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(null, stream)
    gc.freeze()  # what it begins with stays: no garbage is looked for among it
    work(writer)


class ForkedResult:
    """What a function returns that is called in a copy of this process."""

    def __init__(self, work: Callable[[], Any], failed: Callable[[str], Any]) -> None:
        """Begin the work; `failed` makes a result of why there is none."""
        self._reader, writer = Pipe(duplex=False)
        self._failed = failed
        with writer:
            self.fork = start_fork(lambda pipe: pipe.send(outcome_of(work)), writer, group=True)

    def result(self) -> Any:
        """Wait for the result.

        Raises:
            BadExport: the work raised it.
        """
        with self._reader:
            try:
                outcome = self._reader.recv()
            except EOFError:
                code = self.fork.wait()
                return self._failed(crash_reason(code) or f"ended with exit code {code}")
        if isinstance(outcome, BadExport):
            raise outcome
        return outcome


def outcome_of(work: Callable[[], Any]) -> Any:
    """What work returns, or the `BadExport` that it raises: a pipe carries either."""
    try:
        return work()
    except BadExport as error:
        return error


def in_order(stages: StagesWork) -> StagesWork:
    """Do stages when their results are asked for."""
    return stages


def meanwhile(stages: StagesWork) -> StagesWork:
    """Do stages in a copy of this process; they are handed over when they are asked for.

    If the copy crashes this process ends in the same way.
    """
    if not POSSIBLE:
        return stages
    reader, writer = Pipe(duplex=False)
    with writer:
        fork = start_fork(lambda pipe: _send(stages, pipe), writer, group=False)
    inbox: SimpleQueue[Any] = SimpleQueue()
    # A pipe holds little: without a reader the copy would wait.
    threading.Thread(target=_receive, args=(reader, inbox), daemon=True).start()
    return lambda sink: _hand_over(inbox, fork, sink)


def _send(stages: StagesWork, pipe: Connection) -> None:
    try:
        stages(pipe.send)
        pipe.send(None)
    except BadExport as error:
        pipe.send(error)


def _receive(reader: Connection, inbox: SimpleQueue[Any]) -> None:
    try:
        while True:
            inbox.put(reader.recv())
    except (EOFError, OSError) as error:
        inbox.put(error)


def _hand_over(inbox: SimpleQueue[Any], fork: Fork, sink: ResultSink) -> None:
    while (message := inbox.get()) is not None:
        if isinstance(message, BadExport):
            raise message
        if isinstance(message, Exception):
            _end_as(fork.wait())
        sink(message)
    fork.wait()


def _end_as(code: int) -> None:
    if code < 0:
        os.kill(os.getpid(), -code)
    os._exit(code)

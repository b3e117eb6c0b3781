"""Copies of this process: what they send, and what is left when they crash."""

from __future__ import annotations

import gc
import os
import signal
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from tbcad_verify import BadExport
from tbcad_verify.report.checks import Check
from tbcad_verify.report.report import NAME
from tbcad_verify.run.child import kill_group
from tbcad_verify.run.fork import POSSIBLE, ForkedResult, in_order, meanwhile
from tbcad_verify.run.results import CollectedResults, Results, ResultSink
from tbcad_verify.run.verify import VerifyOptions, verify
from tbcad_verify.run.watch import watch

pytestmark = pytest.mark.skipif(not POSSIBLE, reason="forks are used on Linux only")
TITLES = ("one", "two", "three")
LONG = "x" * 1_000_000  # more than a pipe holds


def first(sink: ResultSink) -> None:
    sink(Results(stages=["one"], checks=[Check("a", "", True, 1.0, 2.0, LONG)]))


def crash(sink: ResultSink) -> None:
    sink(Results(stages=["two"]))
    os.kill(os.getpid(), signal.SIGKILL)


def refuse(sink: ResultSink) -> None:
    raise BadExport("the file is bad")


def both(pipe: Connection) -> None:
    """A worker whose second stage is done by a copy of it."""
    later = meanwhile(crash)
    first(pipe.send)
    later(pipe.send)


def test_what_a_copy_sends_comes_when_it_is_asked_for() -> None:
    results = CollectedResults()
    later = meanwhile(first)
    assert results.stages == []
    later(results.add)
    expected = CollectedResults()
    in_order(first)(expected.add)
    assert results.checks == expected.checks
    assert results.stages == expected.stages


def test_a_copy_looks_for_no_garbage_among_what_it_begins_with() -> None:
    def unfrozen() -> int:
        return len(gc.get_objects())

    assert ForkedResult(unfrozen, str).result() < unfrozen() / 10


def test_a_refusal_of_a_copy_is_raised() -> None:
    with pytest.raises(BadExport, match="the file is bad"):
        meanwhile(refuse)(CollectedResults().add)


def test_a_worker_ends_as_its_copy_did() -> None:
    results = CollectedResults()
    watch(both, TITLES, results, 30)
    assert [(check.name, check.passed) for check in results.checks] == [
        ("a", True),
        ("two", None),
        ("three", None),
    ]
    assert results.checks[1].detail == "crashed (SIGKILL)"


def test_a_result_of_a_copy() -> None:
    assert ForkedResult(lambda: LONG, str).result() == LONG
    crashed = ForkedResult(lambda: os.kill(os.getpid(), signal.SIGKILL), str.upper)
    assert crashed.result() == "CRASHED (SIGKILL)"


def test_a_copy_can_be_killed(tmp_path: Path) -> None:
    def write_late() -> None:
        time.sleep(1)
        (tmp_path / "late").touch()

    working = ForkedResult(write_late, str)
    time.sleep(0.2)
    kill_group(working.fork)
    time.sleep(1.5)
    assert not list(tmp_path.iterdir())


def test_copies_give_the_same_report(export_folder: Path) -> None:
    assert verify(export_folder, options=VerifyOptions(apart=False)).passed
    here = (export_folder / NAME).read_bytes()
    assert verify(export_folder, options=VerifyOptions(fork=True)).passed
    assert (export_folder / NAME).read_bytes() == here

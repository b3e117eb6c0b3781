"""A stage that crashes or hangs is unknown, and so are those after it."""

from __future__ import annotations

import os
import re
import signal
import time
from pathlib import Path

import pytest
from tbcad_verify import BadExport
from tbcad_verify.report.checks import Check
from tbcad_verify.report.report import NAME
from tbcad_verify.run.processes import Processes
from tbcad_verify.run.results import CollectedResults, Results, ResultSink
from tbcad_verify.run.verify import VerifyOptions, verify, watch

STAGES = ("one", "two", "three")
CHECK = Check("a", "", True, 1.0, 2.0, "mm")
FAILURES = {"crash": "crashed (SIGKILL)", "hangs": "no answer within 5 s"}


def stages(end: str, report: ResultSink) -> None:
    report(Results(stages=["one"], checks=[CHECK]))
    report(Results(stages=["two"]))
    match end:
        case "crash":
            os.kill(os.getpid(), signal.SIGKILL)
        case "hangs":
            report(Results(stages=[str(os.getpid())]))
            time.sleep(60)
        case "refuses":
            raise BadExport("the file is bad")
    report(Results(stages=["three"]))


def watched(end: str, seconds: float = 30) -> CollectedResults:
    results = CollectedResults()
    with Processes(1, seconds) as processes:
        watch(STAGES, results, processes, stages, end)
    return results


@pytest.mark.parametrize("failure", FAILURES)
def test_a_stage_without_an_end_is_unknown(failure: str) -> None:
    results = watched(failure, 5 if failure == "hangs" else 30)
    broken, reason = results.stages[-1], FAILURES[failure]
    verdicts = [(check.name, check.passed) for check in results.checks]
    assert verdicts == [("a", True), (broken, None), ("three", None)]
    assert results.checks[1].detail == reason
    assert results.checks[2].detail == f"not reached: {broken!r} {reason}"


def test_a_refusal_is_raised() -> None:
    with pytest.raises(BadExport, match="the file is bad"):
        watched("refuses")


def test_no_worker_outlives_an_interrupt() -> None:
    """Ctrl-C, here from the progress report of a stage."""

    def interrupt(title: str) -> None:
        if title.isdecimal():
            started.append(int(title))
            raise KeyboardInterrupt

    started: list[int] = []
    results = CollectedResults(progress=interrupt)
    with pytest.raises(KeyboardInterrupt), Processes(1, 30) as processes:
        watch(STAGES, results, processes, stages, "hangs")
    assert started
    assert not Path(f"/proc/{started[0]}").exists()


def test_the_result_is_the_same_in_a_process_of_its_own(sample_folder: Path) -> None:
    said: list[str] = []
    assert verify(sample_folder, said.append).passed
    apart = (sample_folder / NAME).read_bytes()
    here: list[str] = []
    assert verify(sample_folder, here.append, VerifyOptions(apart=False)).passed
    assert (sample_folder / NAME).read_bytes() == apart
    assert said == here


def test_too_little_time_is_no_pass(export_folder: Path) -> None:
    report = verify(export_folder, options=VerifyOptions(seconds=0.01))
    assert not report.passed
    assert {check.passed for check in report.checks} == {None}
    assert "unknown: reading" in report.verdict
    assert len(report.verdict) < 160
    assert re.search(r"and \d+ more$", report.verdict)

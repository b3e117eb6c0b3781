"""A stage that crashes, hangs or talks nonsense is unknown, as is all after it: never a pass."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify import BadExport
from tbcad_verify.report.checks import Check
from tbcad_verify.report.report import NAME
from tbcad_verify.run.results import JsonLinesSink, Results, replay
from tbcad_verify.run.verify import Options, verify
from tbcad_verify.run.watch import watched

STAGES = ("one", "two", "three")
BEGUN = (
    "import sys, os, time, json;"
    "print(json.dumps({'stage': 'one'}));"
    "print(json.dumps({'checks': [{'name': 'a', 'file': '', 'passed': True, 'measured': 1.0,"
    " 'limit': 2.0, 'unit': 'mm', 'detail': ''}]}));"
    "print(json.dumps({'stage': 'two'}), flush=True);"
)
ENDS = {
    "crash": ("os.kill(os.getpid(), 11)", "crashed (SIGSEGV)"),
    "killed": ("os.kill(os.getpid(), 9)", "crashed (SIGKILL)"),
    "quiet end": ("sys.exit(0)", "ended with exit code 0"),
    "trouble": ("sys.exit(3)", "ended with exit code 3"),
    "hangs": ("time.sleep(60)", "took more than 1 s and was stopped"),
    "nonsense": ("print('hello', flush=True); time.sleep(60)", "said what nobody understands"),
    "half a line": ("print('{', end='', flush=True)", "said what nobody understands"),
}


def told(code: str, seconds: float = 30) -> Results:
    results = Results(lambda _: None)
    watched([sys.executable, "-c", BEGUN + code], STAGES, results, seconds)
    return results


@pytest.mark.parametrize("how", ENDS)
def test_what_does_not_come_to_an_end_is_unknown(how: str) -> None:
    code, reason = ENDS[how]
    results = told(code, 1 if how == "hangs" else 30)
    assert [(check.name, check.passed) for check in results.found] == [
        ("a", True),
        ("two", None),
        ("three", None),
    ]
    assert results.found[1].detail == reason
    assert results.found[2].detail == f"not reached: 'two' {reason}"


def test_a_process_that_never_speaks() -> None:
    results = Results(lambda _: None)
    watched([sys.executable, "-c", "pass"], STAGES, results, 30)
    assert [(c.name, c.passed) for c in results.found] == [(name, None) for name in STAGES]


def test_what_comes_to_an_end_is_handed_on() -> None:
    results = told("print(json.dumps({'stage': 'three'})); print(json.dumps({'done': True}))")
    assert results.stages == list(STAGES)
    assert results.found == [Check("a", "", True, 1.0, 2.0, "mm")]


def test_a_refusal_is_the_callers() -> None:
    with pytest.raises(BadExport, match="the file is bad"):
        told("print(json.dumps({'refused': 'the file is bad'}), flush=True)")


def test_lines_are_what_was_sent(tmp_path: Path) -> None:
    checks = [Check("a", "f", None, None, None, "mm", "why"), Check("b", "", False, 1.5, 1.0, "mm")]
    column = np.array([1.0, np.nan, 0.1 + 0.2])
    with (tmp_path / "lines").open("w") as stream:
        lines = JsonLinesSink(stream)
        lines.stage("s")
        lines.checks(checks)
        lines.mirrors({"pixels": column})
        lines.send({"done": True})
    results = Results(lambda _: None)
    ended = [replay(line, results) for line in (tmp_path / "lines").read_text().splitlines()]
    assert ended == [False, False, False, True]
    assert results.stages == ["s"]
    assert results.found == checks
    np.testing.assert_array_equal(results.columns["pixels"], column)


def test_the_same_proof_apart_and_here(good: Path) -> None:
    said: list[str] = []
    assert verify(good, said.append).passed
    apart = (good / NAME).read_bytes()
    here: list[str] = []
    assert verify(good, here.append, Options(apart=False)).passed
    assert (good / NAME).read_bytes() == apart
    assert said == here


def test_too_little_time_is_no_pass(good: Path) -> None:
    report = verify(good, wishes=Options(seconds=0.01))
    assert not report.passed
    assert {check.passed for check in report.checks} == {None}
    assert "unknown: reading" in report.verdict


def test_a_file_replaced_while_it_is_read(good: Path) -> None:
    """With the very same bytes, in another file: who did that may have done more."""

    def replace(stage: str) -> None:
        if stage == "coverage":
            copy = good / "copy"
            copy.write_bytes((good / "shell_a.stl").read_bytes())
            copy.replace(good / "shell_a.stl")

    with pytest.raises(BadExport, match=r"shell_a\.stl: changed while it was read"):
        verify(good, replace, Options(apart=False))
    assert not (good / NAME).exists()


def test_a_file_removed_while_it_is_read(good: Path) -> None:
    def remove(stage: str) -> None:
        if stage == "coverage":
            (good / "mirrors.csv").unlink()

    with pytest.raises(BadExport, match=r"mirrors\.csv: changed"):
        verify(good, remove, Options(apart=False))

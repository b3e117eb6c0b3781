import os
import signal
from pathlib import Path

import pytest
from tbcad_verify import BadExport
from tbcad_verify.report.report import NAME
from tbcad_verify.run.verify import verify

from tbcad.background import may_fork
from tbcad.own_process import own_process
from tbcad.verification_process import verification_process
from tests.verify.synthetic_export import Design, export


def small_export(folder: Path) -> Path:
    export(folder / "export", Design())
    return folder / "export"


def test_it_gives_the_same_report(tmp_path: Path) -> None:
    folder = small_export(tmp_path)
    expected = verify(folder)
    written = (folder / NAME).read_bytes()
    stages: list[str] = []
    with own_process(), verification_process() as verify_there:
        report = verify_there(folder, stages.append)
    assert report.checks == expected.checks
    assert (folder / NAME).read_bytes() == written
    assert stages[0] == "reading"


def test_a_refusal_is_raised(tmp_path: Path) -> None:
    with (
        own_process(),
        verification_process() as verify_there,
        pytest.raises(BadExport, match="is an empty folder, no build"),
    ):
        verify_there(tmp_path, lambda _: None)


def test_its_death_is_told(tmp_path: Path) -> None:
    with own_process():
        if not may_fork():
            pytest.skip("the runner of tests has threads")

    def kill_all(_: str) -> None:
        children = Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii")
        for child in children.split():
            os.kill(int(child), signal.SIGKILL)

    with (
        own_process(),
        verification_process() as verify_there,
        pytest.raises(RuntimeError, match="memory short"),
    ):
        verify_there(small_export(tmp_path), kill_all)

"""What commands print: 80 columns, how much is asked for, progress, and interrupts."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.app.cli.app import _show
from tbcad.app.doctor import Finding
from tbcad.common.results import Figure, Study
from tbcad.common.screen import WIDTH, TimeLeft, stages
from tests.app.cli.commands import Command
from tests.exported_files import contents

SMALL = ["build", "--n", "4", "--set", "hfov_deg=120", "--parts", "shell"]
# Longest that a command may go on after an interrupt, seconds: reading the files takes longer.
PATIENCE_S = 20
SAMPLE = Path(__file__).parents[3] / "docs" / "sample"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export without verify.json."""
    out = tmp_path_factory.mktemp("output") / "exports"
    assert run([*SMALL, "--out", str(out), "--no-verify"]) == 0
    return out


def fits(text: str) -> list[str]:
    lines = text.splitlines()
    assert max(map(len, lines)) <= WIDTH, max(lines, key=len)
    return lines


def test_outputs_of_verify(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Command) -> None:
    shutil.copytree(SAMPLE, tmp_path / "x")
    monkeypatch.chdir(tmp_path)
    quiet = cli("verify", "x", "--quiet")
    assert quiet.err == ""
    assert quiet.out == (
        "Files: PASS, as designed 89 virtual cameras see 20 mm\n"
        "Shells: yield not simulated: the mirrors are planar\n"
    )
    full = cli("verify", "x", "--full").out
    assert quiet.out in full
    assert "object clearance" in "\n".join(fits(full))
    assert "parts can be made" in full


def test_doctor_fits_and_shows_every_word(monkeypatch: pytest.MonkeyPatch, cli: Command) -> None:
    detail, remedy = "cadquery-ocp and cadquery-ocp-novtk [both] " * 5, "pip uninstall -y x " * 9
    found = [Finding("kernel", False, detail, remedy)]
    monkeypatch.setattr("tbcad.app.doctor.diagnose", lambda: found)
    words = " ".join(fits(cli("doctor", code=1).out)).split()
    assert words == ["NO", "kernel", *detail.split(), "->", *remedy.split()]


def test_study_fits_and_shows_every_word(capsys: pytest.CaptureFixture[str]) -> None:
    long = "smallest sphere that a virtual camera sees with radii by the rule of the paper"
    figures = (Figure(long, "mm", 50.3412, 60.0, "section 4.2, " + long), Figure("n" * 70, "", 2))
    _show(Study("x", figures, (), ()))
    text = "\n".join(fits(capsys.readouterr().out))
    assert "…" not in text
    assert text.count("n" * 10) > 1
    assert sorted(set(long.split()) - set(text.split())) == []


def test_time_left_follows_the_pace() -> None:
    now = 100.0
    left = TimeLeft({"a": 10, "b": 30, "c": 60}, lambda: now)
    assert left.seconds == pytest.approx(100)
    left.begin("a")
    now += 20  # twice as long as expected
    left.begin("b")
    assert left.done == 10
    assert left.seconds == pytest.approx((20 + 10) / (10 + 10) * 90)
    now += 15
    assert left.done == 25
    left.begin("of nobody's list")
    assert left.done == 25
    now += 1000
    assert left.done == 40  # a stage that takes too long is not more than done
    left.begin("c")
    now += 60
    assert left.seconds == 0


def test_piped_stages_are_lines_with_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    with stages({"a": 1}) as screen:
        screen.stage("a")
        screen.detail("of a")
        screen.note("margin")
    with stages(3, silent=True) as screen:
        screen.stage("b")
        screen.note("c")
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "[  0 s] a\n[  0 s] margin\n")


def test_a_long_stage_tells_its_steps_in_plain_lines(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tbcad.common.screen.PAUSE_S", -1.0)
    with stages({"a": 1}) as screen:
        screen.stage("a")
        screen.detail("2 of 3")
    assert capsys.readouterr().err == "[  0 s] a\n[  0 s] a: 2 of 3\n"


ON_A_TERMINAL = """
import time
from tbcad.common.screen import stages

with stages({"first": 1.0, "second": 3.0}) as screen:
    screen.stage("first")
    time.sleep(0.2)
    screen.stage("second")
    screen.detail("of it")
    time.sleep(0.5)
print("done")
"""


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no terminals of this kind")
def test_a_terminal_shows_stage_and_time_left() -> None:
    terminal, screen = os.openpty()
    variables = {**os.environ, "TERM": "xterm", "COLUMNS": "80"}
    command = [sys.executable, "-c", ON_A_TERMINAL]
    done = subprocess.run(command, stdout=-1, stderr=screen, env=variables, check=False)
    drawn = os.read(terminal, 1 << 16).decode()
    os.close(screen)
    os.close(terminal)
    assert (done.stdout, done.returncode) == (b"done\n", 0), drawn
    assert re.search(r"about 0:0\d left first", drawn)
    assert re.search(r"about 0:0\d left second: of it", drawn)


def _accept_interrupts() -> None:
    """A background job of a shell, and all that it starts, would ignore them."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def interrupted(command: list[str], stage: str, folder: Path, delay_s: float = 0.0) -> None:
    """Send SIGINT once a stage has begun: one line says so, soon, and nothing is changed."""
    before = contents(folder)
    process = subprocess.Popen(
        [sys.executable, "-m", *command],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        encoding="utf-8",
        preexec_fn=_accept_interrupts,  # noqa: PLW1509 - no threads here
    )
    assert process.stderr is not None
    for line in process.stderr:
        if stage in line:
            break
    time.sleep(delay_s)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    errors, out = process.stderr.read(), process.communicate(timeout=60)[0]
    assert (process.returncode, out) == (130, "")
    assert time.monotonic() - sent < PATIENCE_S
    assert errors.splitlines()[-1] == f"{command[0]}: stopped; nothing was changed"
    assert "Traceback" not in errors
    assert contents(folder) == before


# At any moment, also while native libraries are loaded, which is after the first line.
@pytest.mark.parametrize(("stage", "delay_s"), [("files", 0.0), ("", 0.0), ("", 0.15)])
def test_an_interrupted_build_leaves_the_old_export(
    built: Path, tmp_path: Path, stage: str, delay_s: float
) -> None:
    shutil.copytree(built, tmp_path / "exports")
    interrupted(["tbcad", *SMALL, "--out", str(tmp_path / "exports")], stage, tmp_path, delay_s)


def test_an_interrupted_verification_ends_and_writes_nothing(built: Path, tmp_path: Path) -> None:
    out = shutil.copytree(built, tmp_path / "exports", ignore=lambda *_: ["verify.json"])
    interrupted(["tbcad_verify", str(out)], "reading", tmp_path)

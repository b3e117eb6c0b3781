"""The command as a user meets it: exit codes, one line of error, nothing half done."""

import ctypes
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tbcad_verify.report.summary import MAX_LINES

from tbcad.app.cli import run
from tbcad.app.cli.endings import signals_as_interrupt
from tests.exported_files import read_csv

STOPPED = "tbcad: stopped; nothing was changed"
COMMAND = [sys.executable, "-m", "tbcad"]
SHELL = ["--parts", "shell"]
# A quarter of the pixels, all of which a verification traces.
SENSOR = ["--set", "camera.width_px=1040", "--set", "camera.height_px=776"]
SMALL = ["build", "--n", "6", "--set", "chord_error_mm=0.05", *SHELL]
WIDE = ["build", "--n", "6", "--set", "hfov_deg=110", *SENSOR, *SHELL]


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cli") / "exports"
    assert run([*SMALL, "--out", str(out), "--no-verify"]) == 0
    return out


def test_build_without_verification(export: Path) -> None:
    assert not (export / "verify.json").exists()
    document = json.loads((export / "design.json").read_text())
    assert document["spec"]["optics"]["n"] == 6
    assert document["spec"]["mesh"]["chord_error_mm"] == 0.05


@pytest.mark.slow
def test_build_verifies_and_verify_agrees(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The camera of the paper does not hold the mirrors of n = 6; a wider one does."""
    out = tmp_path / "exports"
    code = run([*WIDE, "--out", str(out)])
    shown = capsys.readouterr()
    assert code == 0, shown.out
    assert shown.out.startswith("PASS: ")
    assert "Can be made (" in shown.out
    assert len(shown.out.splitlines()) <= MAX_LINES
    assert "Traceback" not in shown.err
    verified = (out / "verify.json").read_bytes()
    assert json.loads(verified)["pass"] is True
    assert run(["verify", str(out)]) == 0
    assert (out / "verify.json").read_bytes() == verified


@pytest.mark.slow
def test_failed_verification_keeps_the_files_and_names_mirrors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "paper"
    paper = ["--n", "9", "--radius-rule", "paper", *SENSOR]
    assert run(["build", *paper, *SHELL, "--out", str(out)]) == 1
    shown = capsys.readouterr().out
    assert shown.startswith("FAIL: ")
    assert "virtual cameras see less than 60 mm" in shown
    assert "coverage, facets" in shown
    assert "mirrors.radius_rule traced" in shown
    assert len(shown.splitlines()) <= MAX_LINES
    assert (out / "shell_a.step").exists()
    verdict = json.loads((out / "verify.json").read_text())
    assert verdict["pass"] is False
    passed = {check["name"]: check["pass"] for check in verdict["checks"]}
    assert passed["coverage, facets"] is False
    assert passed["coverage, spheres"] is False
    exact = {row["id"]: float(row["coverage_mm"]) for row in read_csv(out / "mirrors.csv")}
    for mirror in verdict["mirrors"]:
        assert mirror["coverage_fitted_mm"] == pytest.approx(exact[mirror["id"]], abs=0.3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = [", ["not valid TOML", "correct that line"]),
        ('based_on = "slaa"', ["based_on is 'slaa'", "sla or cnc"]),
        ('based_on = "sla"\nball_grade = "G7"', ["ball_grade is 'G7'", "G10"]),
    ],
    ids=["TOML", "base", "grade"],
)
@pytest.mark.parametrize(
    "command", [["build", "--for-process"], ["tolerance", "no-such-folder", "--process"]]
)
def test_a_broken_process_is_found_before_anything_begins(
    command: list[str],
    text: str,
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before stages, a missing export, and a folder that cannot be replaced."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(text)
    out = ["--out", "mine.toml/out"]
    assert run([*command, "mine.toml", *out]) == 2
    shown = capsys.readouterr()
    assert shown.err.startswith("tbcad: mine.toml: ")
    assert shown.err.count("\n") == 1
    assert all(word in shown.err for word in words)


def _accept_interrupts() -> None:
    """A background job of a shell, and all that it starts, would ignore them."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def test_an_interrupt_that_native_code_drops_comes_again() -> None:
    """Compilers and event loops call Python, and forget what it raises."""
    from_native = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt), signals_as_interrupt():
        print(from_native(), time.sleep(60))


@pytest.mark.parametrize("delay_s", [0.0, 0.15])
def test_interrupt_is_reported_in_one_line(tmp_path: Path, delay_s: float) -> None:
    """At any moment, also while native libraries are loaded, which is after the first line."""
    build = subprocess.Popen(
        [*COMMAND, "build", "--n", "12", "--out", str(tmp_path / "exports")],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        encoding="utf-8",
        preexec_fn=_accept_interrupts,  # noqa: PLW1509 - no threads here
    )
    assert build.stderr is not None
    build.stderr.readline()
    time.sleep(delay_s)
    build.send_signal(signal.SIGINT)
    _, errors = build.communicate(timeout=60)
    assert build.returncode == 130
    assert errors.splitlines()[-1] == STOPPED
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []

"""The command as a user meets it: exit codes, one line of error, nothing half done."""

import ctypes
import json
import signal
import time
from pathlib import Path

import pytest
from tbcad_verify.report.text import MAX_LINES

from tbcad.app.cli.endings import signals_as_interrupt
from tests.app.cli.commands import Command
from tests.exported_files import read_csv

SHELL = ["--parts", "shell"]
# A 25th of the pixels, all of which a verification traces.
SENSOR = ["--set", "camera.width_px=416", "--set", "camera.height_px=310"]
WIDE = ["build", "--n", "4", "--set", "hfov_deg=120", *SENSOR, *SHELL]


@pytest.mark.slow
@pytest.mark.usefixtures("standing")
def test_build_verifies_and_verify_agrees(tmp_path: Path, cli: Command) -> None:
    """The camera of the paper does not hold the mirrors of n = 4; a wider one does."""
    out = tmp_path / "exports"
    shown = cli(*WIDE, "--out", out)
    assert shown.out.startswith("Files: PASS, ")
    assert "at 60 mm; median coverage:" in shown.out
    assert len(shown.out.splitlines()) <= MAX_LINES
    assert "Traceback" not in shown.err
    verified = (out / "verify.json").read_bytes()
    assert json.loads(verified)["pass"] is True
    cli("verify", out)
    assert (out / "verify.json").read_bytes() == verified


@pytest.mark.slow
@pytest.mark.usefixtures("standing")
def test_failed_verification_keeps_the_files_and_names_mirrors(
    tmp_path: Path, cli: Command
) -> None:
    out = tmp_path / "paper"
    paper = ["--n", "9", "--radius-rule", "paper", *SENSOR]
    shown = cli("build", *paper, *SHELL, "--out", out, code=1).out
    assert shown.startswith("Files: FAIL, ")
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


def test_an_interrupt_that_native_code_drops_comes_again() -> None:
    """Compilers and event loops call Python, and forget what it raises."""
    from_native = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt), signals_as_interrupt():
        print(from_native(), time.sleep(60))

"""tbcad show from the command line."""

import json
import re
import signal
import subprocess
import sys
import webbrowser
from http.client import HTTPConnection
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.output.manifest import REPORT_BEGIN


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Addresses that the browser is to open."""
    addresses = list[str]()
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    return addresses


@pytest.fixture
def export(tmp_path: Path) -> Path:
    (tmp_path / "report.html").write_text(REPORT_BEGIN + "<p>", encoding="utf-8")
    return tmp_path


def test_a_report_is_opened_or_named(
    export: Path,
    opened: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["show", str(export)]) == 0
    assert opened == [(export / "report.html").as_uri()]
    assert capsys.readouterr().out == f"{export / 'report.html'}\n"
    assert run(["show", str(export), "--no-open", "--json"]) == 0
    assert len(opened) == 1
    assert json.loads(capsys.readouterr().out) == {"report": str(export / "report.html")}
    monkeypatch.setattr(webbrowser, "open", lambda _: False)
    assert run(["show", str(export)]) == 0
    assert "no browser was found: open this address in one" in capsys.readouterr().err


def refused(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["show", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_a_report_of_somebody_else(export: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (export / "report.html").write_text("<!doctype html>mine", encoding="utf-8")
    refused([str(export)], "report.html is not by tbcad: move it", capsys)


def test_a_light_field_that_is_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "lightfield.h5").write_bytes(b"no")
    refused([str(tmp_path), "--no-open"], "is no light field", capsys)


def test_a_turntable_is_written_and_not_replaced(
    captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "knot.html"
    words = [str(captured), "--turntable", str(file), "--frames", "4", "--rows", "2"]
    words += ["--width", "64", "--height", "48"]
    assert run(["show", *words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == {"turntable": str(file), "bytes": file.stat().st_size, "views": 8}
    refused(words, "exists", capsys)
    assert run(["show", *words, "--force"]) == 0
    assert "8 views by method depth, 0.0 MB" in capsys.readouterr().out


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent otherwise")
def test_a_light_field_is_served_until_ctrl_c(captured: Path) -> None:
    words = [sys.executable, "-m", "tbcad", "show", str(captured), "--no-open"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.fullmatch(
            r"http://127\.0\.0\.1:(\d+)(/[\w-]+/) shows .*; Ctrl-C ends it\n", line
        )
        assert found, line
        connection = HTTPConnection("127.0.0.1", int(found[1]), timeout=60)
        connection.request("GET", f"{found[2]}view?width=64&height=48")
        assert connection.getresponse().read().startswith(b"\xff\xd8")
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, "")
    assert error.splitlines()[1:] == ["ended"]  # after the one stage

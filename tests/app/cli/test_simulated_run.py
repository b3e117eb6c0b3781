"""The command simulate-run: its lists, its refusals, and a run by it."""

from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.errors import InputError
from tbcad.options.shared import numbers
from tbcad.rig.runs import read_run


def test_numbers() -> None:
    assert numbers("1,5,20-22, 3") == (1, 3, 5, 20, 21, 22)


@pytest.mark.parametrize("text", ["", "a", "1,,2", "1-b", "5-2", "7,5-2", "1-99999999999", "1.5"])
def test_no_numbers(text: str) -> None:
    with pytest.raises(InputError, match=r"write for instance 1,5,20-30"):
        numbers(text)


def test_a_run_by_the_command(
    export_with_wind_up: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    words = ["simulate-run", str(export_with_wind_up), "--seed", "3", "-o", str(out)]
    assert run([*words, "--stops", "20", "--phases", "dark,led_1,lit"]) == 0
    assert "6 photographs of 2 frames" in capsys.readouterr().out
    found = read_run(out)
    assert not found.faults
    assert found.record.phases == ("dark", "led_1", "lit")
    assert run([*words, "--stops", "20"]) == 2
    assert "photographs are not replaced" in capsys.readouterr().err

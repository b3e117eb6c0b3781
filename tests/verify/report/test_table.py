"""What people see: rows, and words from outside that must not be taken for markup."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from tbcad_verify import main
from tbcad_verify.programs.program_query import skipped
from tbcad_verify.report.checks import Check, at_most, informative, unknown
from tbcad_verify.report.text import WIDTH, table


def shown(*checks: Check) -> list[str]:
    console = Console(width=WIDTH, record=True, file=StringIO())
    console.print(table(checks))
    lines = console.export_text().splitlines()
    assert max(map(len, lines)) <= WIDTH
    return [" ".join(line.split()) for line in lines]


def test_files_that_agree_share_a_row() -> None:
    a, b = (at_most(("x", file, "mm"), value, 3) for file, value in (("a", 1.5), ("b", 2)))
    assert shown(a, b) == ["2 files", "x pass 1.5 ... 2 <= 3 mm"]
    assert shown(a, at_most(("x", "b", "mm"), 4, 3, "too long")) == [
        "a",
        "x pass 1.5 <= 3 mm",
        "b",
        "x FAIL 4 <= 3 mm",
        "too long",
    ]


def test_states_are_told_apart() -> None:
    name = ("x", "f", "mm")
    assert shown(unknown(name, "why")) == ["f", "x unknown mm", "why"]
    assert shown(informative(name, 1)) == ["f", "x info 1 mm"]
    assert shown(skipped(name, "not here: y")) == ["f", "x skipped mm", "skipped: not here: y"]


def test_words_from_outside_are_no_markup() -> None:
    assert shown(at_most(("x", "[red]f", "mm"), 2, 1, "[/such] [bold]")) == [
        "[red]f",
        "x FAIL 2 <= 1 mm",
        "[/such] [bold]",
    ]


def test_absent_programs_are_skipped_in_so_many_words(
    sample_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(sample_folder.parent))
    assert main([str(sample_folder), "--clients", "--full"]) == 0
    said = capsys.readouterr().out
    assert "not installed: apt install prusa-slicer" in said
    assert "questions to other programs skipped" in said


def test_long_names_figures_and_words_stay_whole() -> None:
    words = ("a check with a long name, of many words", "shell_a.stl", "units that nobody expected")
    name, detail = (words[0], ", ".join(["part_of_the_base.stl"] * 9), words[2]), "word " * 60
    text = " ".join(shown(at_most(name, 123456.789e-12, 98765.4321e-9, detail)))
    for word in f"{words[0]} {name[1]} {words[2]} {detail}".split():
        assert word in text


@pytest.mark.parametrize("option", ["time-limit", "cutter"])
@pytest.mark.parametrize("limit", ["0", "-1", "nan", "soon"])
def test_a_limit_is_more_than_nothing(
    option: str, limit: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["x", f"--{option}={limit}"])
    assert stop.value.code == 2
    assert option in capsys.readouterr().err

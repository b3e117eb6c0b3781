"""What people see: at most fourteen lines of 80 columns, and rows with words from outside."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from tbcad_verify import main
from tbcad_verify.programs.program_query import skipped
from tbcad_verify.report.as_made import AsMade, ProcessYield
from tbcad_verify.report.checks import Check, at_most, informative, unknown
from tbcad_verify.report.methods import (
    ELSE,
    KEY_FIGURES,
    LABEL_WIDTH,
    UNKNOWN,
    key_figures,
    methods,
    remedy_by_name,
)
from tbcad_verify.report.report import Output, Report
from tbcad_verify.report.text import MAX_LINES, WIDTH, table

from tests.verify.synthetic_export import Design, export

pytestmark = pytest.mark.usefixtures("standing")

LONG = ", ".join(f"a{k:04d} sees {k / 7:.2f} mm" for k in range(40))
SUMMARY_KEYS = [
    *("schema", "verdict", "target_mm", "figures", "failed", "changed", "as_made", "note"),
    *("folder", "seconds"),
]
FIGURE_KEYS = ["check", "file", "measured", "bound", "limit", "unit"]


def shown(report: Report, output: Output = "summary", terminal: bool = False) -> str:
    stream = StringIO()
    report.show(Console(file=stream, width=WIDTH, force_terminal=terminal), output)
    return stream.getvalue()


def fits(text: str) -> list[str]:
    lines = text.splitlines()
    assert max(map(len, lines)) <= WIDTH, max(lines, key=len)
    assert not any("\x1b" in line for line in lines)
    return lines


def broken(
    report: Report, which: Callable[[Check], bool], passed: bool | None = False, detail: str = LONG
) -> Report:
    checks = (
        replace(one, passed=passed, detail=detail) if which(one) else one for one in report.checks
    )
    return replace(report, checks=tuple(checks))


def test_pass_of_a_shell(shell_report: Report) -> None:
    lines = fits(shown(shell_report))
    assert len(lines) <= MAX_LINES
    assert lines[0] == "Files: PASS, as designed 89 virtual cameras see 40 mm"
    text = " ".join(lines)
    figures = {one.label: check for one, check in key_figures(shell_report)}
    assert {"coverage, spheres", "coverage, facets", "pixels blocked"} <= figures.keys()
    assert all(label in text for label in figures)
    assert f"{figures['coverage, spheres'].measured:.4g} >= 40 mm" in text
    assert "Shells: tbcad tolerance FOLDER" in text
    assert " s; files, and every check in verify.json" in lines[-1]


def test_pass_with_all_there_is(long_report: Report) -> None:
    asked = tuple(skipped((f"gmsh {k}", "x.stl", "mm"), "not installed") for k in range(9))
    lines = fits(shown(replace(long_report, programs=asked)))
    assert len(lines) == MAX_LINES
    assert lines[0].endswith(", on 16 balls too")
    assert lines[1] == "Shells: yield 98% by diamond"
    assert lines[2] == "Prototype: yield 12/15, printed by FDM, calibrated; all 2 parts can be made"
    assert "50 simulated builds, or until 3 fail," in lines[-7]  # 47 of 50 are 94 %
    assert lines[-6] == "  diamond 98% 60, cnc 7/10 60, sla 0/5 51.4; prototype 12/15 59.9"
    assert "9 questions to other programs skipped" in lines[-4]
    assert lines[-3].startswith("No prototype: ")
    assert lines[-1] == "1234 s; files, and every check in verify.json: exports"


@pytest.mark.parametrize(
    "as_made", [None, AsMade(), AsMade(50, (ProcessYield("cnc", 1, 60.1, 50),))]
)
def test_solids_without_fillets_are_told(shell_report: Report, as_made: AsMade | None) -> None:
    valleys, grooves = (replace(shell_report, valleys=v, as_made=as_made) for v in (True, False))
    assert "fillets" in "".join(line for line in fits(shown(valleys)) if "solids" in line)
    assert "fillets" not in shown(grooves)


def test_parts_that_the_printer_cannot_make_are_counted(long_report: Report) -> None:
    files = {one.file for one in long_report.checks if one.name == "printable"}
    lines = fits(shown(broken(long_report, lambda check: check.file == "a.stl")))
    assert lines[0] == "Files: FAIL, failed: printable"
    assert lines[2].endswith(f"; 1 of {len(files)} parts cannot be made")


def test_no_process_and_no_simulation_are_said(long_report: Report) -> None:
    bad = (ProcessYield("fdm", 0.0, 42, 5), ProcessYield("cnc", 0.8, 59.98, 15))
    for made, said in (
        (AsMade(50, bad), "no built-in process yields 95%; best: 12/15 by cnc"),
        (AsMade(50, reason="the mirrors are planar"), "yield not simulated: the mirrors are"),
        (None, "tbcad tolerance FOLDER simulates builds"),
    ):
        lines = fits(shown(replace(long_report, as_made=made)))
        assert lines[1].startswith(f"Shells: {said}")
        assert lines[2].startswith("Prototype: yield not simulated; all")


def test_every_key_figure_has_room(long_report: Report) -> None:
    text = "\n".join(fits(shown(replace(long_report, note=""))))
    assert all(one.label in text for one in KEY_FIGURES)
    assert max(len(one.label) for one in KEY_FIGURES) <= LABEL_WIDTH
    assert len({one.label for one in KEY_FIGURES}) == len(KEY_FIGURES)


@pytest.mark.parametrize("state", [False, None])
@pytest.mark.parametrize("every", [1, 2, 5, 17])
def test_failures_fit(long_report: Report, every: int, state: bool | None) -> None:
    names = [check.name for check in long_report.checks][::every]
    report = broken(long_report, lambda check: check.name in names, state)
    lines = fits(shown(report))
    assert len(lines) <= MAX_LINES
    assert lines[0].startswith("Files: FAIL, ")
    assert fits(shown(report, "quiet")) == lines[:3]
    explained = [line for line in lines if line.startswith("- ")]
    rest = [line for line in explained if " more: " in line]
    counted = int(rest[0].split()[1]) if rest else 0
    assert counted + len(explained) - len(rest) == len(set(names))


def test_the_worst_comes_first_and_remedies_are_shared(shell_report: Report) -> None:
    names = ("watertight", "manifest", "coverage, facets", "coverage, spheres", "poses", "folds")
    lines = fits(shown(broken(shell_report, lambda check: check.name in names)))
    assert lines[2].startswith("- coverage, spheres:")
    assert lines[3].startswith("- coverage, facets:")
    assert lines[4] == f"    -> {remedy_by_name('coverage, facets')}"
    assert "3 more: poses; watertight; folds" in " ".join(lines)


def test_a_failing_export(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    export(tmp_path / "x", Design(radius=400.0))
    monkeypatch.chdir(tmp_path)
    assert main(["x"]) == 1
    lines = fits(capsys.readouterr().out)
    assert len(lines) <= MAX_LINES
    assert "virtual cameras see less than 40 mm" in lines[0]
    assert remedy_by_name("coverage, facets") in " ".join(lines)
    written = json.loads((tmp_path / "x" / "verify.json").read_text())
    bad = {check["name"] for check in written["checks"] if check["pass"] is False}
    assert {"coverage, facets", "coverage, spheres"} <= bad
    assert bad.isdisjoint({"centre error", "radius error"})
    assert written["pass"] is False


def test_a_printer_that_was_asked_for_is_a_key_figure(shell_report: Report) -> None:
    asked = broken(shell_report, lambda check: check.name == "print fdm", True, "")
    checks = tuple(replace(one, limit=0.0) for one in asked.checks if one.name == "print fdm")
    assert "print fdm" not in shown(shell_report)
    assert "print fdm" in shown(replace(asked, checks=asked.checks + checks))


def test_full_shows_every_check_and_ends_like_the_summary(shell_report: Report) -> None:
    lines = fits(shown(shell_report, "full"))
    assert "\n".join(lines).endswith(shown(shell_report).rstrip())
    rows = {line.partition("  ")[0].strip() for line in lines}
    unasked = {f"print {row['profile']}" for row in shell_report.printing}
    names = {check.name for check in shell_report.checks} - unasked
    long_names = {name for name in names if len(name) > 26}
    assert names - long_names <= rows
    assert not unasked & rows


def test_printers_take_a_line_each_and_parts_share_their_problem(shell_report: Report) -> None:
    assert shell_report.printing
    assert "parts can be made" not in shown(shell_report)
    rows = [
        {"part": part, "profile": "sla", "material": "resin", "problems": problems}
        for part, problems in (("a", ["1 mm off: 3"]), ("b", []), ("c", ["1 mm off: 4"]))
    ]
    text = shown(replace(shell_report, printing=tuple(rows)), "full")
    assert "sla (resin): 1 of 3 parts can be made\n  not a, c: 1 mm off\n" in text


def test_json_has_the_documented_keys(long_report: Report) -> None:
    document = json.loads(shown(long_report, "json"))
    assert list(document) == SUMMARY_KEYS
    assert (document["verdict"], document["failed"]) == ("pass", [])
    assert all(list(figure) == ["label", *FIGURE_KEYS, "pass"] for figure in document["figures"])
    assert [figure["check"] for figure in document["figures"]] == [one.check for one in KEY_FIGURES]
    first = {"process": "diamond", "yield": 0.98, "builds": 50, "coverage_mm": 60.04}
    assert document["as_made"]["processes"][0] == first
    assert {one["bound"] for one in document["figures"]} == {"at least", "at most"}


def test_json_of_failures(shell_report: Report) -> None:
    report = broken(shell_report, lambda check: check.name == "manifest")
    report = broken(report, lambda check: check.name == "poses", None, "why")
    document = json.loads(shown(report, "json"))
    assert (document["verdict"], document["as_made"]) == ("fail", None)
    failed = [(one["check"], one["pass"]) for one in document["failed"]]
    assert failed == [("manifest", False), ("poses", None)]
    keys = [*FIGURE_KEYS, "pass", "detail", "remedy"]
    assert all(list(one) == keys for one in document["failed"])
    assert document["failed"][1]["remedy"] == UNKNOWN


def test_json_keys_are_documented() -> None:
    text = (Path(__file__).parents[3] / "verify" / "README.md").read_text(encoding="utf-8")
    section = text.partition("## The summary as JSON")[2].partition("\n## ")[0]
    more = ("label", "pass", "detail", "remedy", "builds", "yield")
    assert [k for k in (*SUMMARY_KEYS, *FIGURE_KEYS, *more) if f"`{k}`" not in section] == []


def test_colour_is_for_terminals(shell_report: Report) -> None:
    assert shown(shell_report, terminal=True).startswith("Files: \x1b[1;32mPASS")
    failing = broken(shell_report, lambda check: check.name == "manifest")
    assert shown(failing, terminal=True).startswith("Files: \x1b[1;31mFAIL")


def test_every_remedy_fits() -> None:
    every = [text for one in methods() for text in one.remedies]
    assert max(len(f"    -> {text}") for text in (*every, UNKNOWN, ELSE)) <= WIDTH


@pytest.mark.parametrize("words", [["--full", "--quiet"], ["--json", "-q"], ["--json", "--full"]])
def test_outputs_exclude_each_other(
    words: list[str], export_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(export_folder), *words]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert "only one of them" in shown.err
    assert not (export_folder / "verify.json").exists()


def rows(*checks: Check) -> list[str]:
    console = Console(width=WIDTH, record=True, file=StringIO())
    console.print(table(checks))
    lines = console.export_text().splitlines()
    assert max(map(len, lines)) <= WIDTH
    return [" ".join(line.split()) for line in lines]


def test_files_that_agree_share_a_row() -> None:
    a, b = (at_most(("x", file, "mm"), value, 3) for file, value in (("a", 1.5), ("b", 2)))
    assert rows(a, b) == ["2 files", "x pass 1.5 ... 2 <= 3 mm"]
    assert rows(a, at_most(("x", "b", "mm"), 4, 3, "too long")) == [
        "a",
        "x pass 1.5 <= 3 mm",
        "b",
        "x FAIL 4 <= 3 mm",
        "too long",
    ]


def test_states_are_told_apart() -> None:
    name = ("x", "f", "mm")
    assert rows(unknown(name, "why")) == ["f", "x unknown mm", "why"]
    assert rows(informative(name, 1)) == ["f", "x info 1 mm"]
    assert rows(skipped(name, "not here: y")) == ["f", "x skipped mm", "skipped: not here: y"]


def test_words_from_outside_are_no_markup() -> None:
    assert rows(at_most(("x", "[red]f", "mm"), 2, 1, "[/such] [bold]")) == [
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
    text = " ".join(rows(at_most(name, 123456.789e-12, 98765.4321e-9, detail)))
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

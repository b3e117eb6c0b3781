"""One vocabulary for the options of all commands, examples in every help, and completion."""

import json
import os
import shlex
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

import tbcad.app.cli  # noqa: F401 - adds all commands
from tbcad.app.cli import run
from tbcad.app.cli.help_texts import EXAMPLES
from tbcad.app.doctor import Finding
from tests.app.cli.commands import Words, leaves, long_name, options

# Write files or pictures that are their result, and print no figures.
WITHOUT_FIGURES = {"picture", "report", "simulate-run", "view", "refocus"}
# One name for one thing; where the values differ, it is said why.
SEVERAL_KINDS = {
    "--n",  # build leaves its check to the design
    "--cameras",  # camera: a file of them; export: names of virtual ones
    "--method",  # view also finds the depth first, which takes too long for moving and for studies
    "--mesh",  # capture: trace the exported meshes; reconstruct: files of the surface
    "--from",  # init: a design's name; studies: the smallest n
    "--size",  # run, export: a picture's pixels; intrinsics: width of a square, mm
    "--to",  # studies: the largest n; export: the program that reads it
}


def test_an_option_takes_the_same_kind_of_value_everywhere() -> None:
    kinds = defaultdict(set)
    for command in leaves().values():
        for one in options(command):
            words = str(one.type_descriptor.annotation)
            kinds[long_name(one)].add((words.replace(" | None", ""), one.is_flag))
    several = {name for name, found in kinds.items() if len(found) > 1}
    assert several == SEVERAL_KINDS


@pytest.mark.parametrize("words", leaves(), ids=" ".join)
def test_every_command_that_prints_figures_prints_them_as_json(words: Words) -> None:
    names = {long_name(one) for one in options(leaves()[words])}
    assert ("--json" in names) != (words[0] in WITHOUT_FIGURES)


def test_old_names_stay() -> None:
    spelled = {
        name for command in leaves().values() for one in options(command) for name in one.opts
    }
    assert {"--timeout", "--time-limit", "--for-process", "--process"} <= spelled


@pytest.mark.parametrize("command", [" ".join(words) for words in leaves()])
def test_every_example_is_understood(command: str) -> None:
    found: Any = leaves()[tuple(command.split())]
    for words, about in EXAMPLES[command]:
        assert about
        found.make_context("tbcad", shlex.split(words))


def test_examples_are_those_of_commands_that_exist() -> None:
    assert {tuple(name.split()) for name in EXAMPLES} == leaves().keys()


@pytest.mark.parametrize("command", list(EXAMPLES))
def test_help_ends_with_the_examples(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    assert run([*command.split(), "--help"]) == 0
    shown = capsys.readouterr().out.partition("Examples")[2]
    for words, about in EXAMPLES[command]:
        assert f"{f'tbcad {command} {words}'.strip()} - {about}" in shown


def completed(place: dict[str, str]) -> str:
    """What the command prints when a shell asks it, by variables of the environment."""
    words, environment = [sys.executable, "-m", "tbcad"], {**os.environ, **place}
    done = subprocess.run(words, env=environment, capture_output=True, encoding="utf-8", check=True)
    return done.stdout


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("tbcad bui", {"build"}),
        ("tbcad study s", {"ssim"}),
        ("tbcad build --for", {"--for-process", "--force"}),
        ("tbcad picture exports --of", {"--of"}),
    ],
)
def test_completion(typed: str, expected: set[str]) -> None:
    place = {"COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    shown = completed({**place, "_TBCAD_COMPLETE": "complete_bash"})
    assert set(shown.split()) == expected


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_there_for_every_shell(shell: str) -> None:
    assert "tbcad" in completed({"_TBCAD_COMPLETE": f"source_{shell}"})


def test_doctor_as_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tbcad.app.doctor.diagnose", lambda: [Finding("numba", True, "works")])
    assert run(["doctor", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert {"name", "ok", "detail", "remedy"} == set(record["findings"][0])


def test_a_study_as_json(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["study", "elevation", "--set", "n=4", "--json", "--out", str(tmp_path)]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["study"] == "elevation"
    assert {Path(file) for file in record["files"]} == set(tmp_path.iterdir())
    assert {"quantity", "unit", "value", "paper", "where"} == set(record["figures"][0])

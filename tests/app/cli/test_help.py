"""Help of every command, one vocabulary for the options of all, and examples."""

import json
import pkgutil
import shlex
from collections import defaultdict
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import tbcad_verify
from tbcad_verify.report.methods import method_of

import tbcad.app.cli  # noqa: F401 - adds all commands
from tbcad.app.cli.help_texts import HEADINGS, RENAMED_OPTIONS, examples
from tests.app.cli.commands import Command, Words, commands, leaves, long_name, options

WIDE = "2000"  # columns: no line of help is broken
ALL = commands()
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
SAMPLE = Path(__file__).parents[3] / "docs" / "sample" / "verify.json"


def plain(text: str) -> str:
    """Text as its author wants it read: without the marks of bold type."""
    return " ".join(text.replace("**", "").split())


@pytest.mark.parametrize("words", ALL, ids=" ".join)
def test_screen_shows_every_word_and_the_examples(
    words: Words, monkeypatch: pytest.MonkeyPatch, cli: Command
) -> None:
    monkeypatch.setenv("COLUMNS", WIDE)
    lines = cli(*words, "-h").out.splitlines()
    shown = " ".join(" ".join(lines).split())
    assert words not in leaves() or all("<bool>" not in one and len(one) <= 80 for one in lines)
    assert shown.startswith(" ".join(["Usage: tbcad", *words]))
    for text in (ALL[words].help, *(one.help for one in ALL[words].params)):
        for paragraph in (text or "").split("\n\n"):
            assert plain(paragraph) in shown
    command = " ".join(words)
    for example, about in examples().get(command, {}).items():
        assert about
        ALL[words].make_context("tbcad", shlex.split(example))
        assert f"{f'tbcad {command} {example}'.strip()} {about}" in shown.partition("Examples:")[2]


def test_commands_are_under_headings_in_the_order_of_the_work(cli: Command) -> None:
    shown = cli("--help").out
    places = [shown.index(f"\n{title}:\n") for title in HEADINGS]
    assert places == sorted(places)
    assert "<bool>" not in shown
    assert {name for names in HEADINGS.values() for name in names} == {
        words[0] for words in ALL if words
    }
    assert {tuple(name.split()) for name in examples()} == leaves().keys()


def test_an_option_is_called_and_takes_the_same_everywhere() -> None:
    kinds = defaultdict(set)
    for words, command in leaves().items():
        for one in options(command):
            kind = str(one.type_descriptor.annotation).replace(" | None", "")
            kinds[long_name(one)].add((kind, one.is_flag))
            assert long_name(one) != "--out" or "-o" in one.opts
            assert bool(one.secondary_opts) == bool(one.is_flag and one.default)  # --no- ...
        names = {long_name(one) for one in options(command)}
        assert ("--json" in names) != (words[0] in WITHOUT_FIGURES), words
    assert {name for name, found in kinds.items() if len(found) > 1} == SEVERAL_KINDS
    spelled = {name for one in leaves().values() for opt in options(one) for name in opt.opts}
    assert {"--timeout", "--time-limit", "--process"} <= spelled
    assert not spelled & RENAMED_OPTIONS.keys()


def test_former_names_of_options_are_told_and_still_taken(cli: Command) -> None:
    """For a release."""
    said = cli("build", "--for-process", "cnc", "--yield", "2", code=2).err
    assert said.startswith("tbcad: --for-process is called --process now\ntbcad: --yield 2")
    said = cli("order", "no-such-folder", "--chain=cnc", code=2).err
    assert said.startswith("tbcad: --chain is called --process now\n")


def test_a_folder_may_have_the_name_of_an_option(cli: Command) -> None:
    said = cli("build", "-n", "99", "--out", "n", code=2).err
    assert "optics.n is 99" in said


@pytest.mark.parametrize(
    ("words", "named"), [(("-out", "x"), "--out"), (("-dry-run",), "--dry-run")]
)
def test_a_name_with_one_hyphen_is_refused_by_its_right_name(
    words: tuple[str, ...], named: str, cli: Command
) -> None:
    """Of -out click makes -o with the folder ut."""
    said = cli("build", *words, code=2).err
    assert said == f"tbcad: {named[1:]}: an option's name has two hyphens: write {named}\n"


def test_a_study_as_json(cli: Command, tmp_path: Path) -> None:
    words = ("study", "elevation", "--set", "n=4", "--json", "--out", tmp_path)
    record: dict[str, Any] = json.loads(cli(*words).out)
    assert record["study"] == "elevation"
    assert {Path(file) for file in record["files"]} == set(tmp_path.iterdir())
    assert {"quantity", "unit", "value", "paper", "where"} == set(record["figures"][0])


def explain(cli: Command, *words: str) -> str:
    shown = cli("explain", *words)
    assert not shown.err
    assert "--json" in words or max(map(len, shown.out.splitlines())) <= 80
    return str(shown.out)


def found(cli: Command, name: str) -> dict[str, dict[str, object]]:
    record = json.loads(explain(cli, name, "--json"))
    assert record["schema"] == "tbcad-explain/1"
    return {f"{one['kind']} {one['name']}": one for one in record["found"]}


@pytest.mark.parametrize("name", ["theta1", "theta_1", "THETA1", "θ₁", "theta1_deg"])
def test_a_symbol(cli: Command, name: str) -> None:
    text = explain(cli, name)
    for part in ("θ₁ = atan(", "rad", "eq. 1", "required_angles", "mirrors.csv"):
        assert part in text


def test_keys_sections_and_checks_by_all_their_names(cli: Command) -> None:
    for name, expected in {
        "margin_mm": {"key mirrors.margin_mm"},
        "stage": {"term stage", "section prototype.stage"},
        "bolts": {"key shell.seam_flange.bolts", "key shell.foot_flange.bolts"},
        "coverage facets": {"check coverage, facets"},
        "mirror error": {"check centre error"},  # as the summary calls it
    }.items():
        assert found(cli, name).keys() == expected
    key = found(cli, "mirrors.margin_mm")["key mirrors.margin_mm"]
    assert (key["type"], key["default"], key["unit"]) == ("number", "0.6", "mm")
    assert key["allowed"] == "a number from 0 to 20"
    check = found(cli, "coverage, facets")["check coverage, facets"]
    assert "pinhole -> outline" in str(check["compares"])
    assert check["tolerance"] == "target"
    assert check["if it fails"]


def every_check() -> set[str]:
    """Names of all checks, as the modules of the verification list them, and of the sample."""
    names = {check["name"] for check in json.loads(SAMPLE.read_text())["checks"]}
    for module in pkgutil.walk_packages(tbcad_verify.__path__, "tbcad_verify."):
        if not module.name.endswith("__main__"):
            checks = getattr(import_module(module.name), "CHECKS", ())
            names |= {one if isinstance(one, str) else one[0] for one in checks}
    return names


def test_every_check_is_known() -> None:
    assert len(every_check()) > 90
    assert {name for name in every_check() if method_of(name) is None} == set()


def test_alone_it_lists_what_there_is(cli: Command) -> None:
    text = explain(cli)
    for part in ("θ₁", "[prototype.base]", "margin_mm", "coverage, facets"):
        assert part in text
    listed = json.loads(explain(cli, "--json"))
    assert {"term", "section", "key", "check"} <= set(listed)
    for name in (*listed["term"], *listed["key"], *listed["check"])[::20]:
        assert found(cli, name)

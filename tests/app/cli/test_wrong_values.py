"""Wrong values of every option of every command: one line in tbcad's own words."""

import re
import sys
from typing import Any

import pytest

import tbcad.app.cli  # noqa: F401 - adds all commands
from tbcad.errors import InputError
from tests.app.cli.commands import Command, Words, leaves, long_name, options

LEAKS = re.compile(
    r"Traceback|pydantic|typer|click|Value error|Input should|Invalid value|\bNone\b|Errno|"
    r"Literal|validation error|\(s\)",
    re.IGNORECASE,
)
VALUES = ("", "-1", "nan", "\N{SNOWMAN}\x07\n")
NUMBERS = (int, float)
# Options that are declared alike are one case, of the first command that has them.
CASES = {
    f"tbcad {' '.join(words)} {long_name(option)}": (words, option)
    for (words, option) in {
        (long_name(option), option.help, str(option.type_descriptor.annotation)): (words, option)
        for words, command in reversed(leaves().items())
        for option in options(command)
        if option.nargs and not option.is_flag
    }.values()
}
STAGE = "tbcad: light field\n"
ONE_LINE = re.compile(r"tbcad: [^\n]+\n")


@pytest.fixture(autouse=True)
def _no_work(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    """Work begins where all options have been read: there it ends."""

    def begun(*_: object, **__: object) -> None:
        raise InputError("all options are allowed")

    for name in ("builds.build_planned", "photograph", "analyse", "verify", "simulate_run"):
        monkeypatch.setattr(f"tbcad.app.api.{name}", begun)
    monkeypatch.setattr("tbcad.tolerancing.process_design.edges_for_process", begun)
    monkeypatch.setattr(sys.modules["tbcad.app.cli.app"], "stages", begun)
    monkeypatch.setattr("tbcad.app.api.designs._checked_store", begun)
    monkeypatch.setattr("tbcad.app.doctor.diagnose", begun)
    monkeypatch.setattr("tbcad.core.camera.requirements.camera_requirements", begun)
    monkeypatch.chdir(tmp_path)


def refusal(cli: Command, words: list[str]) -> str:
    """The one line of a command that ends with exit code 2."""
    line: str = cli(*words, code=2).err.removeprefix(STAGE)
    assert ONE_LINE.fullmatch(line), line
    assert not LEAKS.search(line)
    return line


def call(words: Words, *more: str) -> list[str]:
    folders = ["no-such-folder"] * sum(
        one.param_type_name == "argument" and one.required for one in leaves()[words].params
    )
    return [*words, *folders, *more]


@pytest.mark.parametrize("name", CASES)
def test_wrong_values_are_refused_in_our_words(name: str, cli: Command) -> None:
    words, option = CASES[name]
    for value in VALUES:
        refusal(cli, call(words, f"{long_name(option)}={value}"))
    line, kind = refusal(cli, call(words, long_name(option), "foo")), option.type_descriptor
    if kind.is_choice or kind.annotation in NUMBERS:
        assert line.startswith(f"tbcad: {long_name(option)} is 'foo', allowed is ")
        limits = (kind.parameter_info.min, kind.parameter_info.max)
        allowed = [*(kind.choices or ()), *(f"{limit:g}" for limit in limits if limit is not None)]
        assert all(word in line for word in allowed)


@pytest.mark.parametrize("words", leaves(), ids=" ".join)
def test_wrong_options_and_arguments(words: Words, cli: Command) -> None:
    assert "--nonsense" in refusal(cli, call(words, "--nonsense"))
    assert "-Z" in refusal(cli, call(words, "-Z"))
    refused = refusal(cli, call(words, "a", "b", "c"))
    # What is explained may have several words.
    assert (
        "nothing is known of 'a b c'"
        if words == ("explain",)
        else f"tbcad {' '.join(words)} --help"
    ) in refused
    if call(words) != [*words]:
        assert re.search("(FOLDER|RUN) is missing", refusal(cli, [*words]))

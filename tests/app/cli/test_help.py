"""Help of every command: nothing is lost on the way to the screen; -h and -o work everywhere."""

import re
from typing import Any

import pytest

import tbcad.app.cli  # noqa: F401 - adds all commands
from tbcad.app.cli import run
from tbcad.app.cli.help_texts import HEADINGS
from tests.app.cli.commands import Words, commands, leaves, long_name, options

WIDE = "2000"  # columns: no line of help is broken
ALL = commands()
NAMES = [" ".join(["tbcad", *words]) for words in ALL]


def shown_help(
    words: Words, flag: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> str:
    monkeypatch.setenv("COLUMNS", WIDE)
    assert run([*words, flag]) == 0
    return " ".join(capsys.readouterr().out.split())


def plain(text: str) -> str:
    """Text as its author wants it read: without the marks of bold type and escapes."""
    return " ".join(re.sub(r"\\(?=\[)|\*\*", "", text).split())


@pytest.mark.parametrize(("words", "command"), ALL.items(), ids=NAMES)
def test_screen_shows_every_word_of_the_help(
    words: Words,
    command: Any,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = shown_help(words, "--help", monkeypatch, capsys)
    for text in (command.help, *(one.help for one in command.params)):
        for paragraph in (text or "").split("\n\n"):
            assert plain(paragraph) in shown


@pytest.mark.parametrize("words", ALL, ids=NAMES)
def test_short_help_is_the_long_one(
    words: Words, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = shown_help(words, "-h", monkeypatch, capsys)
    assert shown.startswith(" ".join(["Usage: tbcad", *words]))
    assert shown == shown_help(words, "--help", monkeypatch, capsys)


def test_commands_are_under_headings_in_the_order_of_the_work(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = shown_help((), "--help", monkeypatch, capsys)
    places = [shown.index(f"─ {title} ─") for title in HEADINGS]
    assert places == sorted(places)
    listed = {name for names in HEADINGS.values() for name in names}
    assert listed == {words[0] for words in ALL if words}


def test_every_out_is_an_o_too() -> None:
    outs = [
        one
        for command in leaves().values()
        for one in options(command)
        if long_name(one) == "--out"
    ]
    assert len(outs) > 10
    assert all("-o" in one.opts for one in outs)

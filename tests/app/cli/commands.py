"""All commands of tbcad with their options, as the command line knows them."""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import typer.main

from tbcad.app.cli.app import app

Words = tuple[str, ...]
Command = Callable[..., Any]
"""Runs a command of words, and gives what it prints as `out` and `err`."""


@cache
def commands() -> dict[Words, Any]:
    """Every command and group of commands by the words that call it; () is tbcad itself."""
    return dict(_below((), typer.main.get_command(app)))


def _below(words: Words, command: Any) -> Iterator[tuple[Words, Any]]:
    yield words, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from _below((*words, name), inner)


@cache
def leaves() -> dict[Words, Any]:
    """The commands that do something."""
    return {words: one for words, one in commands().items() if not hasattr(one, "commands")}


def options(command: Any) -> list[Any]:
    """The options of a command, but for the help."""
    return [one for one in command.params if one.param_type_name == "option"]


def long_name(option: Any) -> str:
    return max(option.opts, key=len)

"""Help: commands in the order of the work, under headings, with examples that the tests try."""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.models import CommandInfo

from tbcad.errors import InputError

HEADINGS = {
    "Design and build": (
        *("init", "optimize", "build", "verify", "report", "picture", "camera"),
        *("explain", "doctor"),
    ),
    "Order and assemble": ("order", "parts", "drawings", "assembly"),
    "Run the machine": ("run", "intrinsics", "calibrate", "merge", "as-built"),
    "Simulate and analyse": ("capture", "simulate-run", "sag", "tolerance", "study"),
    "Look at light fields": ("reconstruct", "show", "view", "refocus", "dataset"),
}


@cache
def examples() -> dict[str, dict[str, str]]:
    """By the words that call the command: what is typed behind them, and what it gives."""
    text = (files("tbcad.app.cli") / "examples.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def order_help(app: typer.Typer) -> None:
    """Put commands in the order of the work; one without a heading is a fault of tbcad."""
    place = [name for names in HEADINGS.values() for name in names]
    app.registered_commands.sort(key=lambda one: place.index(_name(one)))


def _name(command: CommandInfo) -> str:
    return str(command.name or getattr(command.callback, "__name__", ""))


RENAMED_OPTIONS = {"--for-process": "--process", "--chain": "--process"}  # as they were, and are


class PlainGroup(TyperGroup):
    """All commands under their headings, in plain text."""

    def __init__(self, *arguments: Any, **given: Any) -> None:
        """As TyperGroup, but without markup."""
        super().__init__(*arguments, **{**given, "rich_markup_mode": None})

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each heading; of a group within tbcad, all its commands."""
        own = {"Commands": tuple(self.list_commands(ctx))}
        for title, names in (own if ctx.parent else HEADINGS).items():
            with formatter.section(title):
                found = [(name, self.get_command(ctx, name)) for name in names]
                rows = [(name, _first_paragraph(one.help)) for name, one in found if one]
                formatter.write_dl(rows)


def _first_paragraph(text: str | None) -> str:
    return " ".join((text or "").partition("\n\n")[0].split())


class Plain(TyperCommand):
    """A command with help in plain text: option names and types of any length in 80 columns."""

    def __init__(self, *arguments: Any, **given: Any) -> None:
        """As TyperCommand, but without markup."""
        super().__init__(*arguments, **{**given, "rich_markup_mode": None})

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As TyperCommand, but with options under their former names too, each of which is told.

        InputError: a name has one hyphen, of which click would make its first letter's option.
        """
        names = {name for one in self.params for name in (*one.opts, *one.secondary_opts)}
        for word in args[: args.index("--")] if "--" in args else args:
            given = word.partition("=")[0]
            if given[:1] == "-" and f"-{given}" in names and given not in names:
                raise InputError(f"{given}: an option's name has two hyphens: write -{given}")
        return super().parse_args(ctx, list(map(_renamed, args)))


def _renamed(word: str) -> str:
    name, equals, value = word.partition("=")
    if name not in RENAMED_OPTIONS:
        return word
    typer.echo(f"tbcad: {name} is called {RENAMED_OPTIONS[name]} now", err=True)
    return f"{RENAMED_OPTIONS[name]}{equals}{value}"


def add_examples(app: typer.Typer, words: tuple[str, ...] = ()) -> None:
    """Help in plain text with examples for every command; one without is a fault of tbcad."""
    for command in app.registered_commands:
        command.cls = Plain
        command.epilog = examples_text(" ".join((*words, _name(command))))
    for group in app.registered_groups:
        if group.typer_instance is not None:
            add_examples(group.typer_instance, (*words, str(group.name)))


def examples_text(command: str) -> str:
    """The examples of a command, each with its comment below it, as they stand."""
    told = examples()[command].items()
    lines = [f"  {f'tbcad {command} {words}'.strip()}\n      {about}" for words, about in told]
    return "\n".join(["\b", "Examples:", *lines])

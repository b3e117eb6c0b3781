"""The command that explains terms, keys of a design, and checks of the verification."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.app.cli.app import app, print_result
from tbcad.common.screen import paragraph
from tbcad.options.call import tell_options

if TYPE_CHECKING:
    from tbcad.app.reference.entries import ReferenceEntry

SCHEMA = "tbcad-explain/1"
KINDS = ("term", "section", "key", "check", "process")
INDENT = 13  # columns, of what stands behind a heading


NameOption = Annotated[list[str] | None, typer.Argument(metavar="NAME")]
"""A term or symbol (theta1), a key of a design or its end (margin_mm), a value of one (traced), a
process (cnc), a column of a table (coverage_mm), or a check or figure of the verification
(coverage, facets); without it, all names."""


@app.command()
def explain(
    name: NameOption = None,
    json: Annotated[bool, typer.Option("--json", help="Print the same as JSON.")] = False,
) -> int:
    """Explain a word of tbcad: what it is, its equation, unit and source, and where it is used.

    Of a key: type, default, unit and allowed values. Of a check: what is compared, how, its
    tolerance, and what to do when it fails.
    """
    from tbcad.app.reference.entries import explained, terms_and_keys

    entries = [*terms_and_keys(), *_checks(), *_processes()]
    if not name:
        names = {kind: _names(entries, kind) for kind in KINDS}
        print_result({"schema": SCHEMA, **names}, _lists(entries), json)
        return 0
    found = explained(" ".join(name), entries)
    record = {"schema": SCHEMA, "found": [entry.record for entry in found]}
    print_result(record, ["\n\n".join("\n".join(_lines(entry)) for entry in found)], json)
    return 0


def _checks() -> "Iterator[ReferenceEntry]":
    """The checks of the verification, as it describes them itself."""
    from tbcad_verify.report.methods import KEY_FIGURES, QUESTIONS, methods, remedy_by_name

    from tbcad.app.reference.entries import ReferenceEntry

    labels = {one.check: one.label for one in KEY_FIGURES}
    for one in methods():
        for check in one.names:
            facts: dict[str, str | list[str]] = {
                "answers": QUESTIONS[one.question],
                "compares": one.method,
                "tolerance": one.tolerance,
                "if it fails": remedy_by_name(check),
            }
            yield ReferenceEntry("check", check, facts, (labels.get(check, check),))


def _processes() -> "Iterator[ReferenceEntry]":
    """The built-in processes, as each one's file describes it."""
    from tbcad.app.reference.entries import ReferenceEntry
    from tbcad.tolerancing.process.process import BUILT_IN, load_process

    for name in BUILT_IN:
        facts: dict[str, str | list[str]] = {
            "meaning": load_process(name).title,
            "used by": "tbcad build, tolerance and order with --process",
        }
        yield ReferenceEntry("process", name, facts)


def _lines(entry: "ReferenceEntry") -> Iterator[str]:
    yield f"{entry.name} ({entry.kind})"
    for heading, value in entry.facts.items():
        text = value if isinstance(value, str) else ", ".join(value)
        begin = f"  {heading}".ljust(INDENT) + " "
        yield paragraph(text, begin, " " * len(begin))


def _lists(entries: "list[ReferenceEntry]") -> Iterator[str]:
    from tbcad.app.reference.keys import key_sections

    yield _list("Terms", _names(entries, "term"))
    for section in key_sections():
        keys = [key.name.rpartition(".")[2] for key in section.keys]
        yield _list(f"Keys of a design, [{section.name}]".replace(", []", ""), keys)
    yield _list("Checks of the verification", _names(entries, "check"))
    yield _list("Processes", _names(entries, "process"))
    yield "tbcad explain NAME explains one of them."


def _list(heading: str, names: list[str]) -> str:
    return f"{heading}:\n{paragraph('; '.join(names), '  ', '  ')}"


def _names(entries: "list[ReferenceEntry]", kind: str) -> list[str]:
    return [entry.name for entry in entries if entry.kind == kind]


tell_options(__name__)

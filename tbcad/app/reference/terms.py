"""The terms of tbcad: the record is terms.toml, from which docs/glossary.md is written."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

PAGE_HEAD = (
    "<!-- Written by docs/reference.py from tbcad/app/reference/terms.toml: change that. -->"
)


@dataclass(frozen=True)
class Term:
    """One term; what does not apply to it is empty."""

    name: str  # as the documentation has it
    meaning: str  # Markdown
    aliases: tuple[str, ...] = ()  # other ways to type the name
    symbol: str = ""  # in equations
    equation: str = ""  # that defines it
    unit: str = ""  # of it
    source: str = ""  # of the definition
    keys: tuple[str, ...] = ()  # of a design, that set it
    # of an export, with the columns that hold it: "mirrors.csv: px, py, pz"
    files: tuple[str, ...] = ()
    code: tuple[str, ...] = ()  # dotted names of what computes it


@dataclass(frozen=True)
class TermSection:
    """Terms of one subject."""

    title: str
    terms: tuple[Term, ...]


@dataclass(frozen=True)
class Glossary:
    """All terms."""

    introduction: str
    sections: tuple[TermSection, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms of all sections."""
        return tuple(term for section in self.sections for term in section.terms)


@cache
def glossary() -> Glossary:
    """The record, read."""
    text = (files("tbcad.app.reference") / "terms.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    sections = [
        TermSection(section["title"], tuple(_term(row) for row in section["term"]))
        for section in table["section"]
    ]
    return Glossary(table["introduction"].strip(), tuple(sections))


def _term(row: dict[str, object]) -> Term:
    frozen = {key: tuple(value) if isinstance(value, list) else value for key, value in row.items()}
    return Term(**frozen)  # type: ignore[arg-type]


def glossary_page() -> str:
    """The page docs/glossary.md."""
    sections = [f"## {one.title}\n\n{_table(one)}" for one in glossary().sections]
    return "\n\n".join(["# Glossary", PAGE_HEAD, glossary().introduction, *sections]) + "\n"


def _table(section: TermSection) -> str:
    columns = {"term": _name, "symbol, unit": _symbol, "meaning": _meaning}
    if not any(map(_symbol, section.terms)):
        del columns["symbol, unit"]
    rows = [list(columns), *([cell(term) for cell in columns.values()] for term in section.terms)]
    head, *lines = (f"| {' | '.join(row)} |".replace("|  |", "| |") for row in rows)
    return "\n".join([head, "|---" * len(columns) + "|", *lines])


def _name(term: Term) -> str:
    return term.name


def _symbol(term: Term) -> str:
    # An equation of one symbol says the symbol, too.
    symbol = "" if term.equation.startswith(f"{term.symbol} =") else term.symbol
    symbol = "" if symbol == term.name else symbol
    return ", ".join(filter(None, [symbol, term.equation, term.unit]))


def _meaning(term: Term) -> str:
    keys = ", ".join(f"`{key}`" for key in term.keys)
    said = [term.meaning]
    said += [f"Source: {term.source}."] if term.source else []
    said += [f"Keys: {keys}."] if len(term.keys) > 1 else [f"Key: {keys}."] if keys else []
    return " ".join(said)

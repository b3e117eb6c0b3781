"""Terms and keys by name, as tbcad explain tells them."""

import re
import tomllib
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache
from importlib.resources import files

from pydantic import BaseModel, ConfigDict, Field

from tbcad.app.reference.keys import KeySection, key_sections
from tbcad.errors import InputError

PAGE_HEAD = (
    "<!-- Written by docs/reference.py from tbcad/app/reference/terms.toml: change that. -->"
)


class Words(BaseModel):
    """A table of terms.toml."""

    model_config = ConfigDict(frozen=True, extra="forbid", str_strip_whitespace=True)


class Term(Words):
    """One term; what does not apply to it is empty."""

    name: str  # as the documentation has it
    meaning: str  # Markdown
    aliases: tuple[str, ...] = ()  # other ways to type the name
    symbol: str = ""  # in equations
    equation: str = ""  # that defines it
    unit: str = ""  # of it
    source: str = ""  # of the definition
    keys: tuple[str, ...] = ()  # of a design, that set it
    # of a build, with the columns that hold it: "mirrors.csv: px, py, pz"
    files: tuple[str, ...] = ()
    code: tuple[str, ...] = ()  # dotted names of what computes it


class TermSection(Words):
    """Terms of one subject."""

    title: str
    terms: tuple[Term, ...] = Field(alias="term")


class Glossary(Words):
    """All terms."""

    introduction: str
    sections: tuple[TermSection, ...] = Field(alias="section")

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms of all sections."""
        return tuple(term for section in self.sections for term in section.terms)


@cache
def glossary() -> Glossary:
    """The record, read."""
    text = (files("tbcad.app.reference") / "terms.toml").read_text(encoding="utf-8")
    return Glossary.model_validate(tomllib.loads(text))


def glossary_page() -> str:
    """The page docs/glossary.md."""
    sections = [
        f"## {one.title}\n\n" + "\n".join(map(_defined, one.terms)) for one in glossary().sections
    ]
    return "\n\n".join(["# Glossary", PAGE_HEAD, glossary().introduction, *sections]) + "\n"


def _defined(term: Term) -> str:
    symbol, source = _symbol(term), f" Source: {term.source}." if term.source else ""
    return f"- **{term.name}**{symbol and f' ({symbol})'}: {term.meaning}{source}"


def _symbol(term: Term) -> str:
    # An equation of one symbol says the symbol, too.
    symbol = "" if term.equation.startswith(f"{term.symbol} =") else term.symbol
    symbol = "" if symbol == term.name else symbol
    return ", ".join(filter(None, [symbol, term.equation, term.unit]))


GREEK = {"θ": "theta", "\N{GREEK SMALL LETTER RHO}": "rho"}
KEY_UNITS = ("mm", "deg", "um", "px", "percent")  # that names of keys end with
MOST_SUGGESTED = 3
LIKENESS = 0.6


@dataclass(frozen=True)
class ReferenceEntry:
    """One thing that is explained."""

    kind: str  # "term", "key", "section" or "check"
    name: str  # its own
    facts: dict[str, str | list[str]]  # text or list of texts of each heading
    names: tuple[str, ...] = field(default=())  # all that it is found by, besides its own

    @property
    def record(self) -> dict[str, object]:
        """The entry as plain JSON values."""
        return {"kind": self.kind, "name": self.name, **self.facts}


def plain(name: str) -> str:
    """A name as it is compared: Greek as words, no subscripts, blanks, commas, bars or case."""
    text = "".join(GREEK.get(c, c) for c in unicodedata.normalize("NFKC", name))
    return re.sub(r"[\s_,`-]+", "", text).casefold()


def terms_and_keys() -> Iterator[ReferenceEntry]:
    """Every term, section and key."""
    for term in glossary().terms:
        yield _term_entry(term)
    for section in key_sections():
        yield from _section_entries(section)


def explained(word: str, entries: Iterable[ReferenceEntry]) -> list[ReferenceEntry]:
    """All entries of one name; InputError: there is none; it names those that are alike."""
    by_name: dict[str, list[ReferenceEntry]] = {}
    shown: dict[str, str] = {}
    for entry in entries:
        for name in dict.fromkeys((entry.name, *entry.names)):
            by_name.setdefault(plain(name), []).append(entry)
            if name.isascii() or plain(name) not in shown:  # what can be typed
                shown[plain(name)] = name
    spelt = next(filter(by_name.get, _spellings(word)), "")
    found = {entry.kind + entry.name: entry for entry in by_name.get(spelt, [])}
    if found:
        return list(found.values())
    near = get_close_matches(plain(word), by_name, MOST_SUGGESTED, LIKENESS)
    names = " or ".join(shown[one] for one in near)
    hint = f"did you mean {names}?" if near else "tbcad explain lists what there is"
    raise InputError(f"nothing is known of {word!r}: {hint}")


def _spellings(word: str) -> Iterator[str]:
    """A name as it is compared: as given, in the singular, with the unit of a key."""
    name = plain(word)
    yield from (name, name.removesuffix("s"))
    yield from (name + unit for unit in KEY_UNITS if name)


def _term_entry(term: Term) -> ReferenceEntry:
    columns = [column for file in term.files for column in file.partition(": ")[2].split(", ")]
    symbols = [symbol for symbol in term.symbol.split(", ") if symbol]
    facts: dict[str, str | list[str]] = {
        "meaning": term.meaning,
        "equation": term.equation or ("" if term.symbol == term.name else term.symbol),
        "unit": term.unit,
        "source": term.source,
        "keys": list(term.keys),
        "files": list(term.files),
        "code": list(term.code),
    }
    return ReferenceEntry("term", term.name, _filled(facts), (*term.aliases, *symbols, *columns))


def _section_entries(section: KeySection) -> Iterator[ReferenceEntry]:
    if section.name:
        names = [key.name for key in section.keys]
        facts: dict[str, str | list[str]] = {"meaning": section.description, "keys": names}
        yield ReferenceEntry("section", section.name, facts, _ends(section.name))
    for key in section.keys:
        facts = {
            "meaning": key.description,
            "type": key.type,
            "default": key.default,
            "unit": key.unit,
            "allowed": key.allowed,
        }
        yield ReferenceEntry("key", key.name, _filled(facts), (*_ends(key.name), *key.choices))


def _ends(name: str) -> tuple[str, ...]:
    """The ends of a dotted name: a.b.c also as b.c and c."""
    words = name.split(".")
    return tuple(".".join(words[k:]) for k in range(1, len(words)))


def _filled(facts: dict[str, str | list[str]]) -> dict[str, str | list[str]]:
    return {heading: value for heading, value in facts.items() if value}

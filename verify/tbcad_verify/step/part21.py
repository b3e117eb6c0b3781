"""Entities of a STEP file's text (ISO 10303-21), found by one expression and parsed when asked for.

A shell has 30,000 entities, of which the verification needs a fifth: a parser of the whole grammar
takes twenty times as long. It is the oracle of the tests.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

# No expression tries again what it has read, so that the time grows with the length alone.
TEXT = r"'(?:[^']++|'')*+'"
NOTE = re.compile(rf"{TEXT}|/\*(?:[^*]++|\*(?!/))*+(?:\*/)?")  # a comment, or a text as it is
ENTITY = re.compile(
    rf"\s*+#(\d{{1,15}}+)\s*+=\s*+([A-Z]\w*+)?\s*+\(((?:[^';=]++|{TEXT})*+);",
)
START = re.compile(r"\s*+ISO-10303-21;\s*+HEADER;")
HEADER_END = re.compile(rf"{TEXT}|(?P<end>ENDSEC;\s*+DATA;)|(?P<open>')")
END = re.compile(r"\s*+ENDSEC;\s*+END-ISO-10303-21;\s*+")
TOKEN = re.compile(
    rf"\s*+(?:(?P<text>{TEXT})|#(?P<reference>\d{{1,15}}+)"
    r"|(?P<number>[-+]?\d++\.?\d*+(?:E[-+]?\d++)?)|\.(?P<enumeration>[A-Z]\w*+)\."
    r"|(?P<none>[$*])|(?P<name>[A-Z]\w*+)\s*+(?=\()|(?P<mark>[(),]))"
)
MAX_DEPTH = 30  # of lists in lists; a surface by splines has three
SHOWN = 40  # characters of what cannot be read


class Reference(NamedTuple):
    """The number of an entity."""

    number: int


class Enumeration(NamedTuple):
    """A word of a list, such as T for true."""

    word: str


class Typed(NamedTuple):
    """A value with the name of its type."""

    name: str
    values: list[Value]


Value: TypeAlias = "str | float | Reference | Enumeration | Typed | list[Value] | None"
"""A parameter; None: left open."""


def finite(digits: str) -> float:
    """A number, none too large.

    Raises:
        ValueError: it is beyond all floats.
    """
    if not math.isfinite(number := float(digits)):
        raise ValueError(f"broken STEP text: the number {digits[:SHOWN]} is too large")
    return number


SIMPLE: Mapping[str, Callable[[str], Value]] = {
    "text": lambda word: word[1:-1].replace("''", "'"),
    "reference": lambda word: Reference(int(word)),
    "number": finite,
    "enumeration": Enumeration,
    "none": lambda word: None,
}
"""How each kind of token that is a value by itself is read."""


@dataclass
class Entities:
    """The entities of a file, by number.

    Attributes:
        texts: of simple ones, name and text of the parameters.
        units: of complex ones, which carry units, the text.
        header: all before the first.
    """

    texts: dict[int, tuple[str, str]] = field(repr=False)
    units: dict[int, str] = field(default_factory=dict, repr=False)
    header: str = field(default="", repr=False)

    def of(self, name: str) -> Iterator[tuple[int, list[Value]]]:
        """Number and parameters of every entity of a name, in the order of the file."""
        for number, (kind, text) in self.texts.items():
            if kind == name:
                yield number, parameters(text)

    def name(self, reference: Value) -> str:
        """Name of the entity that a parameter refers to."""
        return self._entity(reference)[0]

    def parameters(self, reference: Value) -> list[Value]:
        """Parameters of the entity that a parameter refers to."""
        return parameters(self._entity(reference)[1])

    def _entity(self, reference: Value) -> tuple[str, str]:
        if not isinstance(reference, Reference) or reference.number not in self.texts:
            raise ValueError(f"broken STEP text: {reference!r} where an entity must be")
        return self.texts[reference.number]


def read_entities(text: str) -> Entities:
    """Find the entities of a file with one data section.

    Raises:
        ValueError: the text is no STEP file, or two entities have one number.
    """
    if "/*" in text:
        text = NOTE.sub(lambda found: found[0] if found[0].startswith("'") else " ", text)
    place = _data_start(text)
    header = text[:place]
    texts: dict[int, tuple[str, str]] = {}
    numbers = 0
    while (match := ENTITY.match(text, place)) and (inside := match[3].rstrip()).endswith(")"):
        numbers, place = numbers + 1, match.end()
        texts[int(match[1])] = (match[2] or "", inside[:-1])
    if not END.fullmatch(text, place):
        raise ValueError(f"broken STEP text at {text[place : place + SHOWN].strip()!r}")
    if len(texts) < numbers:
        raise ValueError("broken STEP text: two entities have one number")
    composed = {number: inside for number, (name, inside) in texts.items() if not name}
    for inside in composed.values():
        _check_complex(inside)
    simple = {number: entity for number, entity in texts.items() if entity[0]}
    return Entities(simple, composed, header)


def _data_start(text: str) -> int:
    """Where the first entity begins."""
    start = START.match(text)
    for found in HEADER_END.finditer(text, start.end()) if start else ():
        if found["end"]:
            return found.end()
        if found["open"]:
            break
    raise ValueError("broken STEP text: no header and data section")


def _check_complex(text: str) -> None:
    """Refuse what is not one named list after the other."""
    tokens = _tokens(text)
    for kind, word in tokens:
        if kind != "name":
            raise ValueError(f"broken STEP text: {word!r} where a name must be")
        _value(kind, word, tokens, 0)


def parameters(text: str) -> list[Value]:
    """Values of a list without its outer parentheses.

    Raises:
        ValueError: it is no list of parameters.
    """
    tokens = _tokens(f"({text})")
    if next(tokens) != ("mark", "("):
        raise ValueError("broken STEP text: no list")
    values = _list(tokens, 0)
    if next(tokens, None) is not None:
        raise ValueError(f"broken STEP text in {text[:SHOWN]!r}")
    return values


def _tokens(text: str) -> Iterator[tuple[str, str]]:
    place, end = 0, len(text.rstrip())
    while place < end:
        match = TOKEN.match(text, place)
        if match is None or match.lastgroup is None:
            raise ValueError(f"broken STEP text at {text[place : place + SHOWN]!r}")
        yield match.lastgroup, match[match.lastgroup]
        place = match.end()


def _list(tokens: Iterator[tuple[str, str]], depth: int) -> list[Value]:
    """Values up to the closing parenthesis."""
    if depth > MAX_DEPTH:
        raise ValueError(f"broken STEP text: more than {MAX_DEPTH} lists in each other")
    values: list[Value] = []
    kind, word = _next(tokens)
    if (kind, word) == ("mark", ")"):
        return values
    while True:
        values.append(_value(kind, word, tokens, depth))
        match _next(tokens):
            case ("mark", ")"):
                return values
            case ("mark", ","):
                kind, word = _next(tokens)
            case (_, other):
                raise ValueError(f"broken STEP text: {other!r} where a comma must be")


def _value(kind: str, word: str, tokens: Iterator[tuple[str, str]], depth: int) -> Value:
    if kind in SIMPLE:
        return SIMPLE[kind](word)
    if kind == "name":
        _next(tokens)
        return Typed(word, _list(tokens, depth + 1))
    if word == "(":
        return _list(tokens, depth + 1)
    raise ValueError(f"broken STEP text: {word!r} where a value must be")


def _next(tokens: Iterator[tuple[str, str]]) -> tuple[str, str]:
    token = next(tokens, None)
    if token is None:
        raise ValueError("broken STEP text: a list without an end")
    return token

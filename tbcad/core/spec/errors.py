"""Errors of a design: one line with what is wrong, where, what is allowed and what to do."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from difflib import SequenceMatcher
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from tbcad.core.spec.section import Entries, OrWord, Reason
from tbcad.errors import InputError, one_line

_MAX_VALUE_LENGTH = 60
_MIN_LIKENESS = 0.6
_PLURALS = {int: "whole numbers", float: "numbers", str: "texts"}
_COUNTS = {2: "two", 3: "three"}
_ORDER = {Gt: "above", Ge: "from", Lt: "below", Le: "to"}


class SpecError(InputError, ValueError):
    """A design that cannot be read or built; its text is one line."""


def short_text(value: object) -> str:
    """Return a value as short text of one line."""
    try:
        text = one_line(repr(value))
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        text = "a number of thousands of digits"
    return text if len(text) <= _MAX_VALUE_LENGTH else text[: _MAX_VALUE_LENGTH - 3] + "..."


def dotted_fields(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Yield every dotted key of a model with its field, sections before their keys."""
    for name, field in model.model_fields.items():
        key = prefix + (field.alias or name)
        yield key, field
        if section := section_of(field):
            yield from dotted_fields(section, key + ".")


def section_of(field: FieldInfo) -> type[BaseModel] | None:
    """Return the model of a field that is a section, None for a key."""
    kind = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def allowed_text(kind: Any, limits: Iterable[object] = ()) -> str:
    """Return what a type and its limits allow, as text: "a number above 0 to 90"."""
    limits = list(limits)
    words = "".join(f", or {limit.word}" for limit in limits if isinstance(limit, OrWord))
    return _allowed_value(kind, limits) + words


def _allowed_value(kind: Any, limits: Iterable[object]) -> str:
    if get_origin(kind) is tuple:
        return _allowed_list(get_args(kind))
    if get_origin(kind) is Literal:
        return " or ".join(str(choice) for choice in get_args(kind))
    if get_origin(kind) in (Union, UnionType):
        return ", or ".join(allowed_text(*_kind_and_limits(choice)) for choice in get_args(kind))
    words = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}
    return " ".join([words.get(kind, "a table"), *_limits(limits)])


def _allowed_list(items: tuple[Any, ...]) -> str:
    """A list whose entries are of one kind: "two numbers in brackets, each from 0.5 to 2"."""
    entries = []  # plural of each, and what each must be
    for kind, limits in (_kind_and_limits(item) for item in items if item is not Ellipsis):
        if get_origin(kind) is tuple:
            entries.append(("lists", f"with {_allowed_list(get_args(kind))}"))
        else:
            entries.append((_PLURALS[kind], " ".join(_limits(limits))))
    name, rule = entries[0]
    count = "" if Ellipsis in items else f"{_COUNTS[len(entries)]} "
    head = f"{count}{name} in brackets"
    if len(set(entries)) > 1:
        return f"{head}: {', '.join(rule for _, rule in entries)}"
    return f"{head}, each {rule}" if rule else head


def _kind_and_limits(item: Any) -> tuple[Any, list[object]]:
    kind, *metadata = get_args(item) if get_origin(item) is Annotated else (item,)
    fields = [field for field in metadata if isinstance(field, FieldInfo)]
    return kind, [limit for field in fields for limit in field.metadata]


def _limits(limits: Iterable[object]) -> Iterator[str]:
    for limit in limits:
        if word := _ORDER.get(type(limit)):
            yield f"{word} {getattr(limit, type(limit).__name__.lower()):g}"
        elif pattern := getattr(limit, "pattern", None):
            yield f"that matches {pattern}"


def nearest_key(key: str, known: Iterable[str]) -> str | None:
    """Return the known dotted key most similar to a given one, None if none is similar."""
    likeness, best = max((_likeness(key, other), other) for other in known)
    return best if likeness >= _MIN_LIKENESS else None


def _likeness(key: str, other: str) -> float:
    leaf, other_leaf = key.rpartition(".")[2], other.rpartition(".")[2]
    whole = SequenceMatcher(None, key, other).ratio()
    # A key in the wrong section is still the key that was meant.
    return max(whole, 0.95 * SequenceMatcher(None, leaf, other_leaf).ratio())


def unknown_key(where: str, key: str, model: type[BaseModel]) -> SpecError:
    """Return the error for a key that does not exist, or is a section where a key must be."""
    known = [name for name, _ in dotted_fields(model)]
    if key in known:
        return SpecError(
            f"{where}: {key} is a section: set one of {', '.join(_inside(key, known))}"
        )
    likely = nearest_key(key, known)
    siblings = _inside(key.rpartition(".")[0], known) or _inside("", known)
    hint = f"did you mean {likely}?" if likely else "known are " + ", ".join(siblings)
    return SpecError(f"{where}: unknown key {key}: {hint}")


def _inside(section: str, known: list[str]) -> list[str]:
    return [key for key in known if key.rpartition(".")[0] == section]


def validation_error(
    error: ValidationError, model: type[BaseModel], file: str, options: Collection[str] = ()
) -> SpecError:
    """Return the first error of a validation as one line, and how many more there are."""
    first, *others = error.errors(include_url=False)
    key = ".".join(part for part in first["loc"] if isinstance(part, str))
    more = f" (and {len(others)} more)" if others else ""
    if first["type"] == "value_error":
        where = f"{file} with options" if options else file
        return SpecError(f"{where}: {key and key + ': '}{first['ctx']['error']}{more}")
    where = "option" if key in options else file
    if first["type"] == "extra_forbidden":
        return SpecError(f"{unknown_key(where, key, model)}{more}")
    return SpecError(f"{where}: {_wrong_value(first, key, model)}{more}")


def _wrong_value(first: ErrorDetails, key: str, model: type[BaseModel]) -> str:
    field = dict(dotted_fields(model)).get(key)
    name = f"{key}{''.join(f'[{part}]' for part in first['loc'] if isinstance(part, int))}"
    value = "missing" if first["type"] == "missing" else short_text(first["input"])
    if field is None:  # in a table that may be left out, or in a list of tables
        return f"{name} is {value}: {first['msg'].lower()}: change it"
    for entries in (one.names for one in field.metadata if isinstance(one, Entries)):
        named = [name for place, name in enumerate(entries) if place in first["loc"]]
        name = " of ".join([*named, key])
    permitted = allowed_text(field.annotation, field.metadata)
    reasons = "".join(f" ({one.text})" for one in field.metadata if isinstance(one, Reason))
    return f"{name} is {value}, allowed is {permitted}{reasons}: change it"

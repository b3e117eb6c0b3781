"""The keys of a design, told from the models: type, default, unit, allowed values, description."""

import ast
import inspect
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tbcad.cad.formats.checked_files import toml_text
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import allowed_text, section_of

# Of a key, by the last word of its name, or its last two.
UNITS = {
    "mm": "mm",
    "deg": "degrees",
    "um": "micrometres",
    "px": "pixels",
    "percent": "%",
    "s": "s",
    "ma": "mA",
    "v": "V",
    "widths": "half widths",
    "g_cm3": "g/cm^3",
    "deg_min": "degrees per minute",
    "deg_s2": "degrees per second^2",
    "weight_deg": "degrees per mm",
}
TYPES = {int: "whole number", float: "number", bool: "true or false", str: "text"}


@dataclass(frozen=True)
class Key:
    """One key of a design."""

    name: str  # dotted
    type: str  # "number", "one of several words" ...
    default: str  # as TOML
    unit: str  # empty where it has none
    allowed: str
    description: str  # one sentence or two


@dataclass(frozen=True)
class KeySection:
    """A table of the design: its dotted name ("" for the top), what it is about, its keys."""

    name: str
    description: str
    keys: tuple[Key, ...]


@cache
def key_sections() -> tuple[KeySection, ...]:
    """All sections of a design, in its order, the top first."""
    return tuple(_sections(Spec, "", inspect.cleandoc(Spec.__doc__ or "")))


def _sections(model: type[BaseModel], name: str, description: str) -> Iterator[KeySection]:
    prefix = f"{name}." if name else ""
    texts = _descriptions(model)
    fields = {field.alias or own: (own, field) for own, field in model.model_fields.items()}
    keys = [
        _key(prefix + key, field, texts[own])
        for key, (own, field) in fields.items()
        if section_of(field) is None
    ]
    yield KeySection(name, description, tuple(keys))
    for key, (own, field) in fields.items():
        if section := section_of(field):
            about = texts.get(own) or inspect.cleandoc(section.__doc__ or "")
            yield from _sections(section, prefix + key, about)


def _key(name: str, field: FieldInfo, description: str) -> Key:
    allowed = allowed_text(field.annotation, field.metadata)
    default = toml_text(field.default)
    return Key(name, _type(field.annotation), default, unit_of(name), allowed, description)


def unit_of(name: str) -> str:
    """The unit that the name of a key ends with; empty where it has none."""
    words = name.rpartition(".")[2].split("_")
    ends = ("_".join(words[-2:]), words[-1]) if len(words) > 1 else ()
    return next((UNITS[end] for end in ends if end in UNITS), "")


def _type(kind: Any) -> str:
    if get_origin(kind) is tuple:
        return "list"
    if get_origin(kind) is Literal:
        texts = all(isinstance(choice, str) for choice in get_args(kind))
        return "one of several words" if texts else "whole number"
    return TYPES.get(kind, "whole number or word")


def _descriptions(model: type[BaseModel]) -> dict[str, str]:
    """The texts below the keys of a model and of those that it is derived from."""
    texts: dict[str, str] = {}
    for one in reversed(model.__mro__):
        if one is not BaseModel and issubclass(one, BaseModel):
            texts |= _texts_by_class(one.__module__).get(one.__name__, {})
    return texts


@cache
def _texts_by_class(module: str) -> dict[str, dict[str, str]]:
    """The texts below the fields of all classes of a module, from its source."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    classes = [one for one in tree.body if isinstance(one, ast.ClassDef)]
    return {one.name: dict(_texts(one)) for one in classes}


def _texts(section: ast.ClassDef) -> Iterator[tuple[str, str]]:
    for key, text in pairwise(section.body):
        match key, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(
                value=ast.Constant(value=str(words))
            ):
                yield name, " ".join(words.split())

"""The keys of a design with type, default, range and text, and a design file with all of them."""

import inspect
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, TypeAlias, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tbcad.cad.formats.checked_files import toml_text
from tbcad.core.spec.csv_rows import Table, read_text, read_toml
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import allowed_text, section_of
from tbcad.core.spec.load import PAPER, shipped_designs
from tbcad.options.call import field_texts

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


WORDS = "one of several words"


@dataclass(frozen=True)
class Key:
    """One key of a design."""

    name: str  # dotted
    type: str  # "number", "one of several words" ...
    default: str  # as TOML
    unit: str  # empty where it has none
    allowed: str
    description: str  # one sentence or two

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that it may be, where it is one of several."""
        return tuple(self.allowed.split(" or ")) if self.type == WORDS else ()


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
    texts = field_texts(model)
    fields = {info.alias or own: (own, info) for own, info in model.model_fields.items()}
    keys = [
        _key(prefix + key, info, texts[own])
        for key, (own, info) in fields.items()
        if section_of(info) is None
    ]
    yield KeySection(name, description, tuple(keys))
    for key, (own, info) in fields.items():
        if section := section_of(info):
            about = texts.get(own) or inspect.cleandoc(section.__doc__ or "")
            yield from _sections(section, prefix + key, about)


def _key(name: str, info: FieldInfo, description: str) -> Key:
    allowed = allowed_text(info.annotation, info.metadata)
    default = toml_text(info.default)
    return Key(name, _type(info.annotation), default, unit_of(name), allowed, description)


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
        return WORDS if texts else "whole number"
    return TYPES[kind]


WIDTH = 100
# Set in the file, so that they are seen; all others are comments until a user takes the # away.
MAIN = ("name", "schema", "optics", "camera", "mirrors.radius_rule", "mirrors.margin_mm")
HEAD = """\
Every key of a design, with what it may be. A key that begins with # has its default, which is
shown: take the # away to set it. "auto": tbcad chooses, and design.json says what.
  tbcad build FILE                 builds and verifies it
  tbcad explain mirrors.margin_mm  explains a key, or any other word"""

# What a design says of keys that it leaves out; here they are all.
ELSEWHERE = "All keys, with units and ranges: tbcad init. What is not set here has its default."


Remarks: TypeAlias = dict[str, list[str]]
"""Comments of a design by the dotted name of a key or section; of the whole by ""."""


def design_template(name: str = PAPER) -> str:
    """A TOML file with every key of a design of tbcad, by its name."""
    file = shipped_designs()[name]
    values = _dotted(read_toml(file, name, "design"))
    remarks = _remarks(read_text(file, name, "design"))
    whole = "\n".join(remarks.get("", [])).removesuffix(ELSEWHERE).rstrip()
    lines = [f"# {line}".rstrip() for line in (*whole.splitlines(), "", *HEAD.splitlines())]
    for section in key_sections():
        lines += _section_lines(section, values, remarks)
    return "\n".join(lines) + "\n"


def _section_lines(section: KeySection, values: Table, remarks: Remarks) -> Iterator[str]:
    if section.name:
        yield ""
        yield from _comment(section.description)
        yield from (f"# {line}" for line in remarks.get(section.name, ()))
        yield f"[{section.name}]"
    for key in section.keys:
        yield ""
        yield from _key_lines(key, values, remarks.get(key.name, []))


def _key_lines(key: Key, values: Table, remarks: list[str]) -> Iterator[str]:
    unit = f", {key.unit}" if key.unit else ""
    yield from _comment(key.description)
    yield from _comment(f"Allowed: {key.allowed}{unit}. Default: {key.default}.")
    yield from (f"# {line}" for line in remarks)
    value = toml_text(values[key.name]) if key.name in values else key.default
    main = any(f"{key.name}.".startswith(f"{one}.") for one in MAIN)
    mark = "" if key.name in values or main else "# "
    yield from _fitting(f"{mark}{key.name.rpartition('.')[2]} = {value}")


def _fitting(line: str) -> Iterator[str]:
    """A line, or several where it ends with a list that does not fit."""
    start, bracket, items = line.partition("[")
    if len(line) <= WIDTH or not bracket:
        yield line
        return
    yield start + bracket
    yield from textwrap.wrap(
        items.removesuffix("]"), WIDTH, initial_indent="    ", subsequent_indent="    "
    )
    yield "]"


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# ")


def _dotted(table: Table, prefix: str = "") -> Table:
    """The values of a table by dotted key."""
    values: Table = {}
    for key, value in table.items():
        values |= _dotted(value, f"{prefix}{key}.") if isinstance(value, dict) else {}
        values |= {} if isinstance(value, dict) else {prefix + key: value}
    return values


def _remarks(text: str) -> Remarks:
    """The comments of a design: a block belongs to the line below it, else to the whole."""
    remarks, section, block = dict[str, list[str]](), "", list[str]()
    for line in [*text.splitlines(), ""]:
        if line.startswith("#"):
            block.append(line.removeprefix("#").removeprefix(" "))
            continue
        if header := re.fullmatch(r"\[(.+)\]", line):
            section = header[1] + "."
        key = re.match(r"(\w+) = ", line)
        name = header[1] if header else section + key[1] if key else ""
        if block:
            whole = [*remarks[""], ""] if not name and "" in remarks else []
            remarks[name] = [*whole, *block]
        block = []
    return remarks

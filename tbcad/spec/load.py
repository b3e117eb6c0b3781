"""Reading a design: a TOML file or the built-in design, with options on top."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import ValidationError

from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError, fields, refused, section_of, unknown_key

_LARGEST_FILE = 1_000_000  # bytes; a design is a few thousand
_BUILT_IN = "built-in design"

Table: TypeAlias = dict[str, Any]


def load_spec(path: Path | None, overrides: Mapping[str, str] | Sequence[str] = ()) -> Spec:
    """Return the design in a TOML file, or the built-in one, with options on top.

    Args:
        path: a TOML file; None for the built-in design.
        overrides: "key=value" texts, or a mapping of them, the later over the earlier. A key is
            dotted, or the end of exactly one dotted key; a value is TOML, or else text.

    Raises:
        SpecError: anything that cannot be read, is unknown, or is not allowed.
    """
    table = {} if path is None else _read(path)
    options = [_option(text) for text in _texts(overrides)]
    for key, value in options:
        _put(table, key.split("."), value)
    try:
        return Spec.model_validate(table)
    except ValidationError as error:
        where = _BUILT_IN if path is None else str(path)
        raise refused(error, Spec, where, {key for key, _ in options}) from None


def spec_dict(spec: Spec) -> Table:
    """Return the design as plain JSON values, keys in the order of the spec."""
    return spec.model_dump(mode="json", by_alias=True)


def _read(path: Path) -> Table:
    text = _read_text(path)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SpecError(f"{path}: tables nested too deeply: flatten them") from None
    except ValueError as error:
        raise SpecError(f"{path}: not valid TOML: {error}: correct that line") from None


def _read_text(path: Path) -> str:
    try:
        if path.exists() and not path.is_file():
            raise SpecError(f"{path}: not a file: name a design file (.toml)")
        with path.open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
        if len(data) > _LARGEST_FILE:
            raise SpecError(f"{path}: over 1 MB, no design: name a design file (.toml)")
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise SpecError(f"{path}: not UTF-8 text (line {line}): save it as UTF-8") from None
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        if isinstance(error, SpecError):
            raise
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SpecError(f"{path}: cannot be read: {reason}: check the path") from None


def _texts(overrides: Mapping[str, str] | Sequence[str]) -> list[str]:
    if isinstance(overrides, Mapping):
        return [f"{key}={value}" for key, value in overrides.items()]
    return list(overrides)


def _option(text: str) -> tuple[str, object]:
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise SpecError(f"option {text!r} is not key=value: write for instance optics.n=18")
    return _full_key(key.strip()), _value(value.strip())


def _full_key(key: str) -> str:
    """The whole key that a key or its end means: the one nearest to the top of the design."""
    known = {name for name, field in fields(Spec) if section_of(field) is None}
    if key in known:
        return key
    ending = [name for name in known if name.endswith("." + key)]
    top = min((name.count(".") for name in ending), default=0)
    match sorted(name for name in ending if name.count(".") == top):
        case [only]:
            return only
        case []:
            raise unknown_key("option", key, Spec)
        case several:
            raise SpecError(f"option {key} may be {' or '.join(several)}: write the whole key")


def _value(text: str) -> object:
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text


def _put(table: Table, path: list[str], value: object) -> None:
    *sections, leaf = path
    for section in sections:
        inner = table.setdefault(section, {})
        if not isinstance(inner, dict):
            return  # the file is wrong here, which validation will say
        table = inner
    table[leaf] = value

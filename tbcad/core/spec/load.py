"""Reading a design: a TOML file or the built-in design, with options on top."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from pydantic import ValidationError

from tbcad.core.spec.csv_rows import Table, read_toml, toml_value
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import (
    SpecError,
    dotted_fields,
    section_of,
    unknown_key,
    validation_error,
)

PAPER = "turtleback"  # equal to the defaults of all keys
LIKENESS = 0.8
_BUILT_IN = "built-in design"


def shipped_designs() -> dict[str, Traversable]:
    """The files of all designs that come with tbcad, by name, the paper's first."""
    found = [one for one in _folder().iterdir() if one.name.endswith(".toml")]
    by_name = {one.name.removesuffix(".toml"): one for one in found}
    return {name: by_name[name] for name in sorted(by_name, key=lambda name: (name != PAPER, name))}


def _folder() -> Traversable:
    """Where a wheel puts designs/, or where a checkout has it."""
    installed = files("tbcad") / "designs"
    return installed if installed.is_dir() else Path(__file__).parents[3] / "designs"


def design_source(path: Path) -> Path | Traversable:
    """The file that a user means: the name of a design that comes with tbcad, or a path.

    SpecError if there is no such file, and the name is nearly that of a design.
    """
    known = shipped_designs()
    near = get_close_matches(str(path), known, 1, LIKENESS)
    if not near or os.path.lexists(path):
        return path
    if str(path) not in known:
        raise SpecError(f"{path}: no such file, and no such design: did you mean {near[0]}?")
    return known[str(path)]


def load_spec(path: Path | None, overrides: Mapping[str, str] | Sequence[str] = ()) -> Spec:
    """Return the design in a TOML file or of a name, or (None) the built-in one, with options.

    Options are "key=value" texts, or a mapping of them, the later over the earlier. A key is
    dotted, or the end of exactly one dotted key; a value is TOML, or else text. SpecError for
    anything that cannot be read, is unknown, or is not allowed.
    """
    table = {} if path is None else read_toml(design_source(path), str(path), "design")
    options = [_option(text) for text in option_texts(overrides)]
    for key, value in options:
        _put(table, key.split("."), value)
    try:
        return Spec.model_validate(table)
    except ValidationError as error:
        where = _BUILT_IN if path is None else str(path)
        raise validation_error(error, Spec, where, {key for key, _ in options}) from None


def spec_dict(spec: Spec) -> Table:
    """Return the design as plain JSON values, keys in the order of the spec."""
    return spec.model_dump(mode="json", by_alias=True)


def option_texts(overrides: Mapping[str, str] | Sequence[str]) -> list[str]:
    """Return options as "key=value" texts."""
    if isinstance(overrides, Mapping):
        return [f"{key}={value}" for key, value in overrides.items()]
    return list(overrides)


def _option(text: str) -> tuple[str, object]:
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise SpecError(f"option {text!r} is not key=value: write for instance optics.n=18")
    return _full_key(key.strip()), toml_value(value.strip())


def _full_key(key: str) -> str:
    """The whole key that a key or its end means: the one nearest to the top of the design."""
    known = {name for name, field in dotted_fields(Spec) if section_of(field) is None}
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


def _put(table: Table, path: list[str], value: object) -> None:
    *sections, leaf = path
    for section in sections:
        inner = table.setdefault(section, {})
        if not isinstance(inner, dict):
            return  # the file is wrong here, which validation will say
        table = inner
    table[leaf] = value

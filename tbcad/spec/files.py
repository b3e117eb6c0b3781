"""Text and TOML files that users write: limited in size, with errors of one line."""

import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeAlias

from tbcad.spec.errors import SpecError

_MAX_BYTES = 1_000_000  # designs, processes and lists have a few thousand

Table: TypeAlias = dict[str, Any]


def read_toml(file: Path | Traversable, name: str, kind: str) -> Table:
    """Return a TOML file as a table.

    Args:
        file: UTF-8 text.
        name: of the file in error messages.
        kind: what it should be, for error messages: "design", "process".

    Raises:
        SpecError: it cannot be read or is not TOML.
    """
    text = read_text(file, name, kind)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SpecError(f"{name}: tables nested too deeply: flatten them") from None
    except ValueError as error:
        raise SpecError(f"{name}: not valid TOML: {error}: correct that line") from None


def read_text(file: Path | Traversable, name: str, kind: str) -> str:
    """Return a UTF-8 text without byte order mark and carriage returns; as for `read_toml`.

    Raises:
        SpecError: it cannot be read.
    """
    if isinstance(file, Path) and file.exists() and not file.is_file():
        raise SpecError(f"{name}: not a file: name a {kind} file")
    try:
        with file.open("rb") as stream:
            data: bytes = stream.read(_MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SpecError(f"{name}: cannot be read: {reason}: check the path") from None
    if len(data) > _MAX_BYTES:
        raise SpecError(f"{name}: over 1 MB, too large for a {kind}: name a {kind} file")
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise SpecError(f"{name}: not UTF-8 text (line {line}): save it as UTF-8") from None


def toml_value(text: str) -> object:
    """Return the value of an option: TOML, or else text."""
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text

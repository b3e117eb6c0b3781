"""Text and TOML files that users write: limited in size, with errors of one line."""

import codecs
import re
import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeAlias

from tbcad.core.spec.errors import SpecError

MAX_BYTES = 1_000_000  # designs, processes and lists have a few thousand
# Byte order marks; that of UTF-32 begins with that of UTF-16.
ENCODINGS = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
    codecs.BOM_UTF8: "utf-8-sig",
}
# A key of very many parts: the time that tomllib takes grows with their number squared.
DOTTED = re.compile(
    r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){20}""", re.ASCII
)

Table: TypeAlias = dict[str, Any]


def read_toml(file: Path | Traversable, name: str, kind: str) -> Table:
    """Return a TOML file as a table; names and kinds are for errors, as of `read_text`."""
    text = read_text(file, name, kind)
    if found := DOTTED.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise SpecError(f"{name}: line {line}: tables nested too deeply: flatten them")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SpecError(f"{name}: tables nested too deeply: flatten them") from None
    except ValueError as error:
        reason = str(error).partition(" for integer string conversion")[0]
        raise SpecError(f"{name}: not valid TOML: {reason}: correct that line") from None


def read_text(file: Path | Traversable, name: str, kind: str, max_bytes: int = MAX_BYTES) -> str:
    """Return a text without byte order mark, its lines ended by line feeds alone; or SpecError.

    It is UTF-8, or UTF-16 or UTF-32 with a byte order mark; lines end as on any system.
    """
    if isinstance(file, Path) and file.exists() and not file.is_file():
        raise SpecError(f"{name}: not a file: name a {kind} file")
    try:
        with file.open("rb") as stream:
            data: bytes = stream.read(max_bytes + 1)
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SpecError(f"{name}: cannot be read: {reason}: check the path") from None
    if len(data) > max_bytes:
        size = max_bytes // 1_000_000
        raise SpecError(f"{name}: over {size} MB, too large for a {kind}: name a {kind} file")
    return _decoded(data, name).replace("\r\n", "\n").replace("\r", "\n")


def _decoded(data: bytes, name: str) -> str:
    encoding = next((code for mark, code in ENCODINGS.items() if data.startswith(mark)), "utf-8")
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        before = data[: error.start].decode(encoding, "replace")
        line = len(before.replace("\r\n", "\n").replace("\r", "\n").split("\n"))
        kind = encoding.upper().removesuffix("-SIG")
        raise SpecError(f"{name}: not {kind} text (line {line}): save it as UTF-8") from None
    if "\0" in text:
        raise SpecError(f"{name}: no text, it has null characters: save it as UTF-8")
    return text


def toml_value(text: str) -> object:
    """Return the value of an option: TOML, or else text."""
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text

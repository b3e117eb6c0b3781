"""JSON and CSV files of a build, checked against pydantic models; tables and TOML written."""

import csv
import json
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from tbcad.errors import InputError

if TYPE_CHECKING:
    from tbcad.types import Floats

REBUILD = "build it again with tbcad build"
MAX_DIGITS = 30  # of whole numbers
SHOWN = 20  # characters of what is not allowed
HALF = re.compile(rb"\\u[dD][89a-fA-F]")  # of a character, as JSON writes those beyond 16 bits
MAX_BYTES = 200_000_000  # n = 60 takes 12 million

Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Model = TypeVar("Model", bound=BaseModel)
Cell = str | int | float | None
Row = dict[str, Cell]


class Record(BaseModel):
    """A JSON object or a CSV row; keys that the model does not name are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore")


def read_json(path: Path, model: type[Model], schema: str | None, missing: str) -> Model:
    """The JSON object in a file, which must fit a model and name a schema (None: it names none).

    InputError if the file is missing (the error says what to do), too large, not JSON, or does not
    fit.
    """
    text = _text(path, missing)
    try:
        value = parse_json(text)
    except ValueError as error:
        raise InputError(f"{path} cannot be read: {error}: {REBUILD}") from None
    version = value.get("schema") if isinstance(value, dict) else None
    if version != schema:
        raise InputError(
            f"{path}: schema is {version!r:.40}, this version of tbcad reads {schema!r}: {REBUILD}"
        )
    try:
        return model.model_validate(value)
    except ValidationError as error:
        raise _refused(path, error) from None


def parse_json(text: str | bytes) -> Any:
    """The value of a JSON text with finite numbers, keys once, whole characters; or ValueError."""
    try:
        value = json.loads(
            text,
            parse_constant=_number,
            parse_float=_number,
            parse_int=_whole,
            object_pairs_hook=_table,
        )
        if HALF.search(text if isinstance(text, bytes) else text.encode()):
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("lists or tables nested too deeply") from None
    except UnicodeEncodeError:
        raise ValueError("a character that is half of one (\\ud800 to \\udfff)") from None
    return value


def _number(text: str) -> float:
    if not math.isfinite(number := float(text)):
        raise ValueError(f"the number {text[:SHOWN]} is not finite")
    return number


def _whole(text: str) -> int:
    if len(text) > MAX_DIGITS:
        raise ValueError(f"the number {text[:SHOWN]}... has {len(text)} digits")
    return int(text)


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice[:SHOWN]!r} is there twice")
    return table


def read_csv(path: Path, model: type[Model], missing: str) -> list[Model]:
    """The rows of a CSV file with a header line, each of which must fit a model.

    InputError if the file is missing (the error says what to do), too large, not CSV, or does not
    fit.
    """
    text = _text(path, missing)
    try:
        rows = list(csv.DictReader(text.splitlines()))
        return TypeAdapter(list[model]).validate_python(rows)  # type: ignore[valid-type]
    except ValidationError as error:
        raise _refused(path, error) from None
    except csv.Error as error:
        raise InputError(f"{path} cannot be read: {error}: {REBUILD}") from None


def columns(rows: Sequence[Record], names: str) -> "Floats":
    """Columns of numbers of a table, by their names with spaces between, (rows, columns)."""
    import numpy as np  # not for help and bad input

    wanted = names.split()
    numbers = [[getattr(row, name) for name in wanted] for row in rows]
    return np.array(numbers, dtype=np.float64).reshape(len(rows), len(wanted))


def _refused(path: Path, error: ValidationError) -> InputError:
    """What is wrong first, in one line; rows are counted from 1."""
    first = error.errors(include_url=False, include_context=False)[0]
    row, *keys = first["loc"] or ("",)
    key = ".".join(str(part) for part in keys)
    where = f"row {row + 1} {key}" if isinstance(row, int) else ".".join(filter(None, (row, key)))
    wrong = first["msg"].removeprefix("Value error, ").lower()
    return InputError(": ".join(filter(None, (str(path), where, wrong, REBUILD))))


def _text(path: Path, missing: str) -> str:
    if not path.is_file():
        raise InputError(f"{path} is not there: {missing}")
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path} has more than {MAX_BYTES} bytes: {REBUILD}")
    try:
        return path.read_text(encoding="utf-8")
    except (ValueError, OSError) as error:
        raise InputError(f"{path} cannot be read: {error}: {REBUILD}") from None


def write_table(path: Path, columns: tuple[str, ...], rows: Iterable[Row]) -> None:
    """Write rows under a header line, None as an empty cell; ValueError if a key is no column."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def toml_text(value: object) -> str:
    """A value as TOML, whose lists are tuples here."""
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(toml_text, value)) + "]"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    return str(value).lower() if isinstance(value, bool) else repr(value)

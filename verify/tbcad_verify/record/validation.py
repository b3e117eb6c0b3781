"""Untrusted values, validated by pydantic models; every refusal is one clear line."""

from __future__ import annotations

import json
from collections.abc import Callable
from difflib import get_close_matches
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetPydanticSchema,
    ValidationError,
)
from pydantic_core import ErrorDetails, core_schema

from tbcad_verify.errors import BadExport
from tbcad_verify.record.files import AGAIN, FileBytes
from tbcad_verify.types import Floats

FARTHEST_MM = 1e6  # of any point in a JSON file from the origin
SHOWN = 60  # characters of a refused value that are shown


class Strict(BaseModel):
    """An object of a JSON file: no conversions, finite numbers, other keys ignored."""

    model_config = ConfigDict(
        frozen=True, strict=True, extra="ignore", allow_inf_nan=False, arbitrary_types_allowed=True
    )


Model = TypeVar("Model", bound=BaseModel)


def _in_the_folder(name: str) -> str:
    if name in {".", ".."}:
        raise ValueError(f"is {name}, allowed is a plain file name")
    return name


def array(items: Any, build: Callable[[list[Any]], Any] = np.array) -> GetPydanticSchema:
    """Validate a list as this type, and make an array of it."""
    return GetPydanticSchema(
        lambda _, handler: core_schema.no_info_after_validator_function(
            build, handler.generate_schema(items)
        )
    )


Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,64}$")]
PlainFile = Annotated[str, Field(pattern=r"^[^/\\:\x00]{1,255}$"), AfterValidator(_in_the_folder)]
FileOrNone = Annotated[str, Field(pattern=r"^[^/\\:\x00]{0,255}$"), AfterValidator(_in_the_folder)]
_Length = Annotated[float, Field(ge=-FARTHEST_MM, le=FARTHEST_MM)]
_Three = Annotated[list[_Length], Field(min_length=3, max_length=3)]
Vector = Annotated[Floats, array(_Three)]
"""Three numbers, (3,)."""
Matrix = Annotated[Floats, array(Annotated[list[_Three], Field(min_length=3, max_length=3)])]
"""Three rows of three numbers, (3, 3)."""


class PartFiles(Strict):
    """A part's name and files; an empty name is no file."""

    name: Name
    stl: PlainFile
    step: FileOrNone = ""
    threemf: FileOrNone = Field("", alias="3mf")


def parse_json(blob: FileBytes, schema: str) -> dict[str, Any]:
    """The JSON object in a file.

    BadExport: broken JSON, NaN or infinities, a key twice, no object, or another schema.
    """
    try:
        value = json.loads(
            blob.text(), parse_constant=_refuse_constant, object_pairs_hook=refuse_doubles
        )
    except (ValueError, RecursionError) as error:
        raise BadExport(f"{blob.name}: broken JSON ({error}); {AGAIN}") from error
    if not isinstance(value, dict):
        raise BadExport(f"{blob.name}: must be a JSON object; {AGAIN}")
    if value.get("schema") != schema:
        raise BadExport(
            f"{blob.name}: schema is {shown(value.get('schema'))}, this version verifies {schema}; "
            f"{AGAIN} of this version"
        )
    return value


def validated(file: str, model: type[Model], value: Any) -> Model:
    """The value as the model has it. BadExport: the value does not fit."""
    try:
        return model.model_validate(value)
    except ValidationError as error:
        raise BadExport(f"{file}: {fault(model, error)}; {AGAIN}") from error


def key_path(location: tuple[int | str, ...]) -> str:
    """Keys joined by points, numbers from 0 in brackets."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{shown(part)}" for part in location)
    return "".join(parts).removeprefix(".")


def fault(
    model: type[BaseModel],
    error: ValidationError,
    where: Callable[[tuple[int | str, ...]], str] = key_path,
) -> str:
    """The first fault of a value that does not fit: its place, the value, and what is allowed."""
    # An unknown key first: it is often why another is missing.
    faults = sorted(
        error.errors(include_url=False), key=lambda one: one["type"] != "extra_forbidden"
    )
    first, *others = faults
    more = f" (and {len(others)} more)" if others else ""
    return f"{_described(model, first, where(first['loc']))}{more}"


def shown(value: object) -> str:
    """A value in at most `SHOWN` printable characters."""
    try:
        text = value if isinstance(value, str) and value.isprintable() else repr(value)
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        text = "a number of thousands of digits"
    text = text or "''"
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


def _described(model: type[BaseModel], error: ErrorDetails, place: str) -> str:
    if error["type"] == "extra_forbidden":
        return _unknown(model, str(error["loc"][0]))
    if error["type"] == "value_error":
        return f"{place} {error['ctx']['error']}".strip()
    if error["type"] == "missing":
        return f"{place} is missing"
    message = error["msg"].replace("Input should", "it should")
    return f"{place} is {shown(error['input'])}: {message}"


def _unknown(model: type[BaseModel], key: str) -> str:
    likely = get_close_matches(key, model.model_fields, 1)
    hint = f"did you mean {likely[0]}? " if likely else ""
    return f"unknown key {shown(key)}: {hint}allowed are {', '.join(model.model_fields)}"


def refuse_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object; programs differ in which of two values with the same key they take."""
    value = dict(pairs)
    if len(value) != len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {shown(twice)} is there twice")
    return value


def _refuse_constant(constant: str) -> float:
    raise ValueError(f"{constant} is no JSON number")

"""Strict access to values that come from JSON nobody vouches for."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.errors import BadExport
from tbcad_verify.record.files import AGAIN, FileBytes

NAME = re.compile(r"[A-Za-z0-9_]{1,64}")
Record = Mapping[str, Any]
DESIGN = "design.json"


def parse(blob: FileBytes) -> dict[str, Any]:
    """The JSON object in a file.

    Raises:
        BadExport: broken JSON, NaN or infinities, or no object.
    """
    try:
        value = json.loads(blob.text(), parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise BadExport(f"{blob.name}: broken JSON ({error}); {AGAIN}") from error
    if not isinstance(value, dict):
        raise BadExport(f"{blob.name}: must be a JSON object; {AGAIN}")
    return value


def typed(record: Record, key: str, kind: type[Any], file: str = DESIGN) -> Any:
    """A value of one type; `file` is named when it is not.

    Raises:
        BadExport: it is missing or of another type.
    """
    value = record.get(key)
    if not isinstance(value, kind) or isinstance(value, bool):
        raise BadExport(f"{file}: {key} must be a {kind.__name__}, not {value!r:.60}; {AGAIN}")
    return value


def number(record: Record, key: str, least: float, most: float, file: str = DESIGN) -> float:
    """A finite number in a range.

    Raises:
        BadExport: it is missing, no number or out of range.
    """
    return limited(f"{file}: {key}", record.get(key), least, most)


def limited(what: str, value: Any, least: float, most: float) -> float:
    """The value, if it is a number in a range.

    Raises:
        BadExport: it is not; the message begins with `what`.
    """
    good = isinstance(value, int | float) and not isinstance(value, bool)
    if not good or not least <= value <= most:
        raise BadExport(
            f"{what} must be a number from {least:g} to {most:g}, not {value!r:.60}; {AGAIN}"
        )
    return float(value)


def vector(record: Record, key: str, file: str = DESIGN) -> NDArray[np.float64]:
    """Three finite numbers, (3,).

    Raises:
        BadExport: it is anything else.
    """
    return three(f"{file}: {key}", typed(record, key, list, file))


def three(what: str, value: Any) -> NDArray[np.float64]:
    """The value as three finite numbers, (3,).

    Raises:
        BadExport: it is anything else; the message begins with `what`.
    """
    if not isinstance(value, list) or len(value) != 3:
        raise BadExport(f"{what} must be three numbers, not {value!r:.60}; {AGAIN}")
    return np.array([limited(what, item, -1e6, 1e6) for item in value])


def triple(record: Record, key: str, file: str = DESIGN) -> NDArray[np.float64]:
    """Three rows of three finite numbers, (3, 3).

    Raises:
        BadExport: it is anything else.
    """
    value = typed(record, key, list, file)
    if len(value) != 3:
        raise BadExport(f"{file}: {key} must be three rows of three numbers; {AGAIN}")
    return np.array([three(f"{file}: {key}", row) for row in value])


def word(record: Record, key: str, file: str = DESIGN) -> str:
    """A name of letters, digits and underscores.

    Raises:
        BadExport: it is anything else.
    """
    value = typed(record, key, str, file)
    if not NAME.fullmatch(value):
        raise BadExport(f"{file}: {key} {value!r:.80} must be letters, digits and _; {AGAIN}")
    return str(value)


def plain_file(record: Record, key: str, file: str = DESIGN) -> str:
    """The name of a file that lies in the export itself.

    Raises:
        BadExport: it is anything else.
    """
    name = str(typed(record, key, str, file))
    if not re.fullmatch(r"[^/\\:\0]{1,255}", name) or name in {".", ".."}:
        raise BadExport(f"{file}: {key} {name!r:.80} must be a plain file name; {AGAIN}")
    return name


def objects(record: Record, key: str, file: str = DESIGN) -> Sequence[dict[str, Any]]:
    """A list of JSON objects.

    Raises:
        BadExport: it is anything else.
    """
    items: list[Any] = typed(record, key, list, file)
    if not all(isinstance(item, dict) for item in items):
        raise BadExport(f"{file}: {key} must be a list of objects; {AGAIN}")
    return items


def _no_constant(constant: str) -> float:
    raise ValueError(f"{constant} is no JSON number")

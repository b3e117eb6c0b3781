"""Random changes to a file that leave its meaning, judged without the verification's readers."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from tests.helpers import read_3mf
from tests.verify.corpus import part21
from tests.verify.synthetic_export import facets_of

# Nothing that the verification promises hangs on these.
FREE = re.compile(
    r"spec\.(name|schema|step|printer|prototype|shell|mesh|mirrors\.(radius_rule|margin_mm|own_|max_))"
)
FREE_COLUMN = "coverage_mm"
TINY = 1e-8  # mm or of the value: what the verification's tightest limits let pass
STEP_TINY = 2e-6  # mm; a face's area and middle are held to about this
FREE_STEP = re.compile(
    r"(APPLICATION|PRODUCT|SHAPE_ASPECT|PROPERTY_DEFINITION|SHAPE_DEFINITION|REPRESENTATION|"
    r"MEASURE_REP|DERIVED|\( GEOMETRIC|UNCERTAINTY|\( NAMED_UNIT|SHAPE_REP)"
)


def same(before: Path, after: Path) -> bool:
    """Whether a file that was changed still says the same, as far as the verification promises."""
    kind = {".json": _json, ".csv": _table, ".stl": _stl, ".3mf": _model, ".step": _step}
    return kind[before.suffix](before, after)


def _json(before: Path, after: Path) -> bool:
    one, two = (dict(_leaves(json.loads(path.read_bytes()))) for path in (before, after))
    if before.name == "manifest.json":
        one, two = ({k: v for k, v in d.items() if k.startswith("files")} for d in (one, two))
    keys = {key for key in one | two if not FREE.match(key)}
    return all(_close(one.get(key), two.get(key)) for key in keys)


def _leaves(value: Any, path: str = "") -> list[tuple[str, Any]]:
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        found = (_leaves(inner, f"{path}.{key}" if path else str(key)) for key, inner in items)
        return [leaf for leaves in found for leaf in leaves]
    return [(path, value)]


def _close(one: Any, two: Any) -> bool:
    if isinstance(one, float) and isinstance(two, float):
        return abs(one - two) <= TINY * max(1.0, abs(one))
    if isinstance(one, str) and isinstance(two, str):
        return one.lower() == two.lower()
    return bool(one == two)


def _table(before: Path, after: Path) -> bool:
    one, two = (list(csv.DictReader(path.read_text().splitlines())) for path in (before, after))
    return len(one) == len(two) and all(
        _close(_value(row.get(key)), _value(other.get(key)))
        for row, other in zip(one, two, strict=True)
        for key in row.keys() | other.keys()
        if key != FREE_COLUMN
    )


def _value(word: str | None) -> str | float | None:
    try:
        return word if word is None else float(word)
    except ValueError:
        return word


def _stl(before: Path, after: Path) -> bool:
    return np.array_equal(*(facets_of(path) for path in (before, after)))


def _model(before: Path, after: Path) -> bool:
    one, two = (read_3mf(path) for path in (before, after))
    return all(np.array_equal(*pair) for pair in zip(one, two, strict=True))


def _step(before: Path, after: Path) -> bool:
    one, two = (part21.parsed(_body(path)) for path in (before, after))
    return one.keys() == two.keys() and all(_alike(one[key], two[key]) for key in one)


def _body(path: Path) -> str:
    """The statements; readers take any control character for a space."""
    body = part21.split(path.read_text(encoding="latin-1"))[1]
    return re.sub(r";[\0-\x20]+(?=#)", ";\n", body)


def _alike(one: str, two: str) -> bool:
    if one == two or FREE_STEP.match(one):
        return True
    numbers = [np.array(part21.NUMBER.findall(said), float) for said in (one, two)]
    words = [part21.NUMBER.sub("0.", said) for said in (one, two)]
    if one.startswith("DIRECTION("):  # of any length
        numbers = [vector / np.linalg.norm(vector) for vector in numbers]
    return words[0] == words[1] and bool(np.abs(numbers[0] - numbers[1]).max(initial=0) < STEP_TINY)

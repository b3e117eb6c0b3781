"""JSON keys and CSV columns of an export, but its paper, are those in the list of ties."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tbcad_verify.shell.integrity import is_paper

from tests.prototype_records import UPPER_LAMPS

pytestmark = pytest.mark.corpus

TIE = re.compile(r"- (?P<kind>[a-z ]+): (?P<names>.*?): (?P<by>[^`]+)")
FIELDS = Path(__file__).parents[3] / "docs" / "fields.md"
KINDS = {"measured", "worked out", "spec", "form", "hash"}
TOTALS = {f"totals.{name}_price" for name in ("bought", "tools", "filament")}
MAPS = {"files", "versions", *TOTALS}  # keys are data


def json_fields(value: Any, path: str = "") -> Iterator[str]:
    """Paths of all values: keys joined by points, [] for the items of a list."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from json_fields(inner, f"{path}.{'*' if path in MAPS else key}".strip("."))
    elif isinstance(value, list) and value:
        for inner in value:
            yield from json_fields(inner, f"{path}[]")
    else:
        yield path


def fields(folder: Path) -> dict[str, set[str]]:
    """Fields of JSON and CSV files but paper and the verdict; closed grammars read the others."""
    found: dict[str, set[str]] = {}
    for path in folder.iterdir():
        text = path.read_text("utf-8") if path.suffix in {".json", ".csv"} else ""
        if not text or is_paper(path.name) or path.name == "verify.json":
            continue
        names = json_fields(json.loads(text)) if path.suffix == ".json" else None
        found[path.name] = set(names or next(csv.reader(text.splitlines())))
    return found


def ties() -> dict[str, set[str]]:
    """Fields of the list, by file."""
    text = FIELDS.read_text(encoding="utf-8")
    lists = text.partition("<!-- ties: begin -->")[2].partition("<!-- ties: end -->")[0]
    found: dict[str, set[str]] = {}
    files: list[str] = []
    for line in filter(None, lists.splitlines()):
        if line.startswith("**"):
            files = re.findall("`([^`]+)`", line)
            continue
        tie = TIE.fullmatch(line)
        assert tie, line
        mine = set(re.findall("`([^`]+)`", tie["names"]))
        assert tie["kind"] in KINDS, line
        for file in files:
            assert not found.get(file, set()) & mine, f"{file}: two ties in {line}"
            found.setdefault(file, set()).update(mine)
    return {name: some for name, some in found.items() if name.endswith((".json", ".csv"))}


def test_fields_and_ties_are_the_same(good: Path, good_prototype: Path) -> None:
    found = fields(good_prototype)
    for name, some in fields(good).items():
        found[name] = found.get(name, set()) | some
    # Of LEDs above the object, which the small prototype has no room for.
    found["prototype.json"] -= {"lamps.upper"}
    found["prototype.json"] |= {*json_fields({"lamps": {"upper": UPPER_LAMPS}})}
    assert found == ties()
    some = set(json_fields({"drive": {"colour": 1}, "seats": [{"ball": 1}]}))
    assert some - ties()["prototype.json"] == {"drive.colour"}

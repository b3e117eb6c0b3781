"""The verification knows the ranges that tbcad gives the keys that it uses."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import tbcad_verify
from pydantic import BaseModel
from tbcad_verify.record.spec import Spec

from tbcad.core.spec.design import Spec as DesignSpec

LIMITS = ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "minItems", "maxItems")
# Chosen by a build, so that an export has numbers; checked in words instead of ranges by tbcad.
CHOSEN = {"prototype.k", "prototype.base.hold"}
PROPERTIES = {"chord_error_mm", "structure_error_mm", "name"}  # used by spec.py itself
IN_WORDS = {"schema"}


def keys(model: type[BaseModel]) -> dict[str, Any]:
    """What is said of every key, by its path."""
    whole = model.model_json_schema()

    def walk(node: dict[str, Any], path: str) -> Iterator[tuple[str, Any]]:
        if "$ref" in node:
            node = whole["$defs"][node["$ref"].rpartition("/")[2]]
        if "properties" not in node:
            yield path, node
        for key, inner in node.get("properties", {}).items():
            yield from walk(inner, f"{path}.{key}".strip("."))

    return dict(walk(whole, ""))


def allowed(node: dict[str, Any]) -> list[object]:
    """Limits and choices, those of a list's items too."""
    inner = [*node.get("prefixItems", ()), *([node["items"]] if node.get("items") else ())]
    unique = [allowed(one) for one in inner]
    return [
        [node[limit] for limit in LIMITS if limit in node],
        sorted(node.get("enum", ())),
        node.get("pattern"),
        unique[:1] if unique[1:] == unique[:-1] else unique,
    ]


OURS, THEIRS = keys(Spec), keys(DesignSpec)


def test_every_key_is_one_of_a_design_and_used() -> None:
    folder = Path(tbcad_verify.__file__).parent
    texts = [path.read_text("utf-8") for path in folder.rglob("*.py") if path.name != "spec.py"]
    assert OURS.keys() <= THEIRS.keys()
    assert OURS.keys() >= CHOSEN | IN_WORDS
    names = {key.rpartition(".")[2] for key in OURS} - {"schema", *PROPERTIES}
    assert [name for name in names if not any(f".{name}" in text for text in texts)] == []


def test_ranges_are_those_of_a_design() -> None:
    keys = OURS.keys() - CHOSEN - IN_WORDS
    assert {key: allowed(OURS[key]) for key in keys} == {key: allowed(THEIRS[key]) for key in keys}


def test_every_key_is_read_or_free_for_a_reason() -> None:
    path = Path(tbcad_verify.__file__).parent / "record" / "free_keys.toml"
    rows = tomllib.loads(path.read_text(encoding="utf-8"))["keys"]
    free = [name for row in rows for name in row["names"]]
    assert sorted([*keys(Spec), *free]) == sorted(keys(DesignSpec))
    assert all(row["why"] for row in rows)

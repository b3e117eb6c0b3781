"""Every field of an export, but for its paper, is in the list of ties, and nothing else is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tbcad_verify.shell.integrity import is_paper

from tests.verify.corpus.fields import fields

pytestmark = pytest.mark.corpus

README = Path(__file__).parents[3] / "verify" / "README.md"
KINDS = {"measured", "worked out", "spec", "form", "hash"}


def ties() -> dict[str, set[str]]:
    """Fields of the list, by file."""
    text = README.read_text(encoding="utf-8")
    table = text.partition("<!-- ties: begin -->")[2].partition("<!-- ties: end -->")[0]
    found: dict[str, set[str]] = {}
    for line in table.strip().splitlines()[2:]:
        files, kind, names, by = (cell.strip() for cell in line.strip("|").split(" | "))
        assert kind in KINDS, line
        assert by, line
        for file in re.findall("`([^`]+)`", files):
            mine = re.findall("`([^`]+)`", names)
            assert not found.get(file, set()) & set(mine), f"{file}: two ties in {line}"
            found.setdefault(file, set()).update(mine)
    return found


def all_fields(*folders: Path) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for folder in folders:
        for name, some in fields(folder).items():
            if not is_paper(name):
                found.setdefault(name, set()).update(some)
    return found


def test_every_field_has_a_tie(good: Path, good_prototype: Path) -> None:
    listed = ties()
    for name, some in all_fields(good, good_prototype).items():
        assert some - listed.get(name, set()) == set(), name


def test_every_tie_has_a_field(good: Path, good_prototype: Path) -> None:
    found = all_fields(good, good_prototype)
    # A kind of entity may be in one sort of STEP file only.
    for name, listed in ties().items():
        also = found["*.step"] | found["prototype.step"] if name.endswith(".step") else set()
        assert listed - found[name] - also == set(), name


def test_a_new_field_has_no_tie() -> None:
    from tests.verify.corpus.fields import json_fields

    some = set(json_fields({"drive": {"colour": 1}, "seats": [{"ball": 1}]}))
    assert some - ties()["prototype.json"] == {"drive.colour"}

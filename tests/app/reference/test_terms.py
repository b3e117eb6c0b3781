"""The record of terms: what it refers to exists, and the pages are written from it."""

import csv
import pkgutil
import runpy
from pathlib import Path

import pytest

from tbcad.app.reference.entries import glossary
from tbcad.app.reference.keys import key_sections

ROOT = Path(__file__).parents[3]
TERMS = glossary().terms
KEYS = {key.name for section in key_sections() for key in section.keys}


def test_there_are_terms_of_every_subject() -> None:
    assert len(glossary().sections) == 5
    assert len({term.name for term in TERMS}) == len(TERMS) > 50


def test_every_term_names_keys_and_code_that_exist_and_is_a_sentence() -> None:
    for term in TERMS:
        assert set(term.keys) <= KEYS, term
        assert all(pkgutil.resolve_name(name) for name in term.code), term
        assert term.meaning[0].isupper() or term.meaning[0].isdigit(), term
        assert term.meaning.endswith("."), term
        assert "|" not in term.meaning + term.equation + term.symbol + term.name, term


def test_columns_are_those_of_an_export(prototype_columns: dict[str, set[str]]) -> None:
    for term in TERMS:
        for name, _, columns in (file.partition(": ") for file in term.files):
            assert set(columns.split(", ")) <= prototype_columns[name], term.name


@pytest.fixture(scope="module")
def prototype_columns() -> dict[str, set[str]]:
    """Columns by file: of the sample export, and of the modules that write a prototype's."""
    from tbcad.prototype.files import tables

    with (ROOT / "docs" / "sample" / "mirrors.csv").open(encoding="utf-8") as stream:
        mirrors = set(next(csv.reader(stream)))
    return {
        "mirrors.csv": mirrors,
        "balls.csv": set(tables.BALL_COLUMNS),
        "stops.csv": set(tables.STOP_COLUMNS),
        "rotation_plan.csv": set(tables.PICTURE_COLUMNS),
    }


@pytest.mark.parametrize("page", ["docs/glossary.md", "verify/README.md"])
def test_pages_are_written_from_the_records(page: str) -> None:
    """If not: python docs/reference.py."""
    pages = runpy.run_path(str(ROOT / "docs" / "reference.py"))["pages"]()
    assert (ROOT / page).read_text(encoding="utf-8") == pages[ROOT / page]

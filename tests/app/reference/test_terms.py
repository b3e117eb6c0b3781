"""The record of terms: what it refers to exists, and the pages are written from it."""

import csv
import pkgutil
import re
import runpy
import tomllib
from pathlib import Path

import pytest

from tbcad.app.reference.entries import explained, glossary, terms_and_keys
from tbcad.app.reference.keys import ELSEWHERE, design_template, key_sections, unit_of
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import dotted_fields, section_of
from tbcad.core.spec.load import PAPER, load_spec, shipped_designs

ROOT = Path(__file__).parents[3]
TERMS = glossary().terms
KEYS = {key.name for section in key_sections() for key in section.keys}
NAMES = list(shipped_designs())
DESIGN_KEYS = [key for section in key_sections() for key in section.keys]


def test_every_term_names_keys_and_code_that_exist_and_is_a_sentence() -> None:
    assert len({term.name for term in TERMS}) == len(TERMS) > 50
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


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "design.toml"


@pytest.mark.parametrize("name", NAMES[:2])
class TestTemplate:
    def test_gives_the_design_that_it_begins_from(self, name: str, file: Path) -> None:
        file.write_text(design_template(name), encoding="utf-8")
        assert load_spec(file) == load_spec(Path(name))

    def test_gives_the_same_with_every_key_set(self, name: str, file: Path) -> None:
        """What is a comment is a key and its default."""
        text = re.sub(r"^# (\w+ = )", r"\1", design_template(name), flags=re.MULTILINE)
        file.write_text(text, encoding="utf-8")
        assert load_spec(file) == load_spec(Path(name))
        assert sum(text.count(f"\n{key.name.rpartition('.')[2]} = ") for key in DESIGN_KEYS) >= len(
            DESIGN_KEYS
        )

    def test_tells_all_about_every_key(self, name: str, file: Path) -> None:
        text = " ".join(re.sub(r"^# ?", "", design_template(name), flags=re.MULTILINE).split())
        for key in DESIGN_KEYS:
            assert key.description in text
            assert f"Allowed: {key.allowed}" in text

    def test_keeps_what_the_design_says(self, name: str, file: Path) -> None:
        """Every comment, but for where the keys are that it leaves out: here they are all."""
        template = design_template(name)
        lines = shipped_designs()[name].read_text(encoding="utf-8").splitlines()
        assert f"# {ELSEWHERE}" in lines
        assert ELSEWHERE not in template
        for line in lines:
            assert not line.startswith("# ") or line == f"# {ELSEWHERE}" or line in template


def test_the_main_keys_are_set() -> None:
    table = tomllib.loads(design_template())
    assert table["optics"]["n"] == 18
    assert set(table["mirrors"]) == {"radius_rule", "margin_mm"}
    assert load_spec(None) == Spec()


def test_every_key_and_section_of_the_models_is_described() -> None:
    assert NAMES[0] == PAPER
    known = {name for name, field in dotted_fields(Spec) if section_of(field) is None}
    assert {key.name for key in DESIGN_KEYS} == known
    assert all(section.description for section in key_sections())
    for key in DESIGN_KEYS:
        assert key.description.endswith("."), key
        assert key.allowed, key
        assert "a table" not in key.allowed, key
        assert tomllib.loads(f"x = {key.default}"), key
        last = key.name.rpartition(".")[2].rpartition("_")[2]
        named = last in {"mm", "deg", "um", "px", "percent", "s", "ma", "v"}
        assert bool(key.unit) == (named or key.name.endswith(("widths", "g_cm3", "_min", "_s2")))
    assert unit_of("mirrors.margin_mm") == "mm"
    assert unit_of("prototype.motion.feed_deg_min") == "degrees per minute"
    assert unit_of("optics.n") == unit_of("prototype.motion.safety") == ""


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("fillets", "cutter radius"),
        ("medians", "median minimum"),
        ("structure error", "mesh.structure_error_mm"),
    ],
)
def test_words_are_found_in_the_plural_and_keys_without_their_unit(word: str, name: str) -> None:
    assert [one.name for one in explained(word, terms_and_keys())] == [name]

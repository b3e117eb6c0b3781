"""The gallery of designs: all of them, as `python docs/gallery.py` writes it from its figures."""

import json
import re
from types import ModuleType

import pytest

import tbcad
from tbcad.core.spec.load import shipped_designs
from tbcad.output.overview import overview
from tests.docs_scripts import docs_script


@pytest.fixture(scope="module")
def gallery() -> ModuleType:
    return docs_script("gallery")


def test_page_has_every_design_and_the_figures_that_were_found(gallery: ModuleType) -> None:
    results = json.loads(gallery.RESULTS.read_text(encoding="utf-8"))
    assert set(results) == set(shipped_designs())
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.page(results)


def test_designs_that_more_chains_make_come_first(gallery: ModuleType) -> None:
    """As the page's table says, and as its sections follow; planar mirrors are last."""
    text = gallery.PAGE.read_text(encoding="utf-8")
    rows = re.findall(r"(?m)^\| \[(.+?)\]\(#.+?\) \| (.*?) \| (.*?) \|", text)
    ranks = [
        (0 if by.startswith("none") else -len(by.split(", ")), -float(share.strip(" %") or 0))
        for _, by, share in rows
    ]
    assert ranks == sorted(ranks)
    assert ranks[0] < ranks[-1] == (0, 0)
    assert [name for name, *_ in rows] == re.findall(r"(?m)^## ([a-z0-9-]+)$", text)
    assert {name for name, *_ in rows} == set(shipped_designs())


@pytest.mark.slow
def test_figures_are_those_of_the_present_code(gallery: ModuleType) -> None:
    name = "afternoon-print"  # with a prototype
    results = json.loads(gallery.RESULTS.read_text(encoding="utf-8"))
    found = overview(tbcad.design(name), optional_prototype=True)
    assert results[name] == gallery.figures(found)

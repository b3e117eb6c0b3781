"""Solids as parts that users model on."""

import math
import re
import sys
from pathlib import Path

import cadquery
import pytest

import tbcad

HOW_TO = Path(__file__).parents[2] / "docs" / "how-to.md"


@pytest.fixture(scope="module")
def design() -> tbcad.Design:
    return tbcad.design(n=3)


def test_a_shell_in_cadquery_is_the_same_solid(design: tbcad.Design) -> None:
    part = design.shell("a")
    workplane = tbcad.to_cadquery(part)
    assert workplane.solids().size() == 1
    assert workplane.val().Volume() == part.volume
    assert workplane.val().isValid()
    assert workplane._getTagged("shell_a") is workplane


def test_the_example_puts_the_shell_on_feet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = HOW_TO.read_text(encoding="utf-8")
    example = re.search(r"<!-- test: cadquery -->\n```python\n(.*?)```", text, re.DOTALL)
    assert example is not None
    monkeypatch.chdir(tmp_path)
    names: dict[str, cadquery.Workplane] = {}
    exec(example[1], names)
    read = cadquery.importers.importStep(str(tmp_path / "shell_on_feet.step"))
    assert read.solids().size() == 1
    feet = 4 * math.pi * 8**2 * 20
    volume = names["shell"].val().Volume()  # type: ignore[union-attr]
    assert read.val().Volume() == pytest.approx(volume + feet, rel=1e-6)  # type: ignore[union-attr]


def test_without_cadquery_says_how_to_install_it(
    design: tbcad.Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cadquery", None)
    with pytest.raises(tbcad.InputError, match=r"pip install 'tbcad\[cadquery\]'"):
        tbcad.to_cadquery(design.shell("a"))

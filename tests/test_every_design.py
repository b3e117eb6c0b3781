"""Designs of many sizes are built and verified, both parts."""

from pathlib import Path

import pytest

import tbcad

pytestmark = pytest.mark.designs


# The README's main job builds 18; other sizes are laid out in tests/prototype/test_arrangement.py.
@pytest.mark.parametrize("n", [36, 13, 7, 3])
def test_subdivisions(n: int, tmp_path: Path) -> None:
    built = tbcad.build(tbcad.load_spec(None, [f"n={n}"]), tmp_path / "exports")
    assert built.report is not None
    assert built.passed, built.report
    assert (built.parts, built.note) == (("shell", "prototype"), "")

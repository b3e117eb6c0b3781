"""Designs of many sizes are built and verified, both parts."""

from pathlib import Path

import pytest

import tbcad

DESIGNS = Path(__file__).parents[1] / "designs"

pytestmark = [pytest.mark.designs, pytest.mark.usefixtures("standing")]


def test_more_subdivisions(tmp_path: Path) -> None:
    """The README's main job builds 18, the tour 6, tests/app/test_edit_loop.py 3.

    Other sizes are laid out in tests/prototype/test_arrangement.py.
    """
    built = tbcad.build(tbcad.load_spec(None, ["n=24"]), tmp_path / "exports")
    assert built.report is not None
    assert built.report.passed, built.report
    assert (built.parts, built.note) == (("shell", "prototype"), "")


# Grooves that are narrow and wide for the mirrors: at n = 9 a mirror's border with the foot is as
# long as the wide groove, but the bottoms at its ends meet. Narrow mirrors of turtleback-even reach
# the seam.
@pytest.mark.parametrize(
    ("name", "n", "groove"),
    [(None, 9, 0.4), (None, 3, 0.05), ("turtleback-even", 13, 0.1)],
)
def test_pedestals(name: str | None, n: int, groove: float, tmp_path: Path) -> None:
    path = DESIGNS / f"{name}.toml" if name else None
    spec = tbcad.load_spec(path, [f"n={n}", "shell.edges=pedestal", f"groove_mm={groove}"])
    built = tbcad.build(spec, tmp_path / "exports", parts="shell")
    assert built.report is not None
    assert built.passed, built.report

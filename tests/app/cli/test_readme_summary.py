"""What the README shows of a build is what the build prints; `.ci/run` compares every word."""

import re
from pathlib import Path

import pytest
from tbcad_verify.report.as_made import as_made_lines
from tbcad_verify.report.methods import KEY_FIGURES
from tbcad_verify.report.summary import MAX_LINES

from tbcad.common.screen import WIDTH
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.montecarlo.builds import as_made

README = Path(__file__).parents[3] / "README.md"


@pytest.fixture(scope="module")
def lines() -> list[str]:
    text = README.read_text(encoding="utf-8")
    found = re.search(r"<!-- output: main -->\n```text\n(.*?)```", text, re.DOTALL)
    assert found is not None
    return found[1].splitlines()


def test_it_fits(lines: list[str]) -> None:
    assert len(lines) <= MAX_LINES
    assert max(map(len, lines)) <= WIDTH


def test_it_has_all_key_figures(lines: list[str]) -> None:
    text = "\n".join(lines)
    # The paper's design has no mandrels.
    labels = [one.label for one in KEY_FIGURES if one.label != "mandrel draft"]
    assert [label for label in labels if f"  {label} " not in text] == []


def test_it_has_the_design(lines: list[str], paper_design: MirrorDesign) -> None:
    a, b = paper_design.arrays
    halved = int((a.u[:, 0] == 0).sum())
    assert f"{len(a) + len(b) - halved} virtual cameras" in lines[0]
    shown = re.search(r"coverage, spheres ([\d.]+) >= 60 mm", lines[1])
    assert shown is not None
    assert float(shown[1]) == pytest.approx(min(a.coverage.min(), b.coverage.min()), abs=0.01)


@pytest.mark.slow
def test_it_has_the_simulated_builds(lines: list[str], paper_design: MirrorDesign) -> None:
    spec = paper_design.spec
    made = as_made(
        reflectors(paper_design), spec.optics.capture_diameter_mm, spec.mirrors.coating_um
    )
    expected = as_made_lines(made)
    assert [line for line in lines if line in expected] == expected

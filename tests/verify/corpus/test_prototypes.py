"""Broken copies of a real prototype must be caught, each for its reason; edited paper is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tbcad_verify import main
from tbcad_verify.prototype.light.ball_views import ball_views, pixel_rays
from tbcad_verify.shell.integrity import is_paper

from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.prototype.gravity import read_gravity
from tbcad.tolerancing.prototype.windows import draw_prototypes, prototype_model, prototype_result
from tests.verify.corpus.broken_prototypes import GOOD, PROTOTYPES
from tests.verify.corpus.copies import change, copy, load
from tests.verify.corpus.mutation import Batch, batches
from tests.verify.prototype.test_measured_prototype import context_of, measured_of

pytestmark = pytest.mark.corpus


# Without a STEP file no body can be measured.
SOLITARY = {"no STEP of the carrier"}


@pytest.mark.parametrize("batch", batches([*GOOD, *PROTOTYPES], SOLITARY), ids=str)
def test_caught(batch: Batch, good_prototype: Path, tmp_path: Path) -> None:
    assert batch.attempt(good_prototype, tmp_path) == ""


def test_what_balls_show_is_what_the_tolerance_model_says(good_prototype: Path) -> None:
    """With weight at each stop and windows that follow; halves of mirrors on the seam left out."""
    measured = measured_of(context_of(good_prototype))
    found = ball_views(measured, pixel_rays(measured)).coverage
    export = read_export(good_prototype)
    plan = read_plan(export)
    model = prototype_model(export.reflectors, plan, read_gravity(export, plan))
    errors = Errors(sag=Error(mean=1.0), wind_up=Error(mean=1.0))
    exact = draw_prototypes(errors, 0, [0], model.is_cap, model.gravity)
    expected = prototype_result(model, exact).calibrated_coverage[0, : found.size]
    whole = ~measured.context.halved
    assert np.linalg.norm(measured.context.sag_at_stops, axis=2).max() > 0.2
    # Corners between two of the 96 directions of an outline are not seen.
    assert found[whole] == pytest.approx(expected[whole], abs=0.05)
    assert found[whole].min() == pytest.approx(expected[whole].min(), abs=5e-3)


def tied_list(data: bytes) -> bytes:
    return data + b"18,1,TIES,cable ties,,,,,,,,,,,,,bought\n"


def edited_pdf(data: bytes) -> bytes:
    return data.replace(b"(Title)", b"(Name)")


def test_edited_paper_is_told_and_refused_only_strictly(
    good_prototype: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(good_prototype, tmp_path / "export")
    paper = [name for name in load(folder, "manifest.json")["files"] if is_paper(name)]
    assert {"assembly.pdf", "bom.csv", "wiring.csv", "camera.json", "drawing_plate.pdf"} <= {*paper}
    for name in paper:
        change(folder, name, edited_pdf if name.endswith(".pdf") else tied_list)
    assert main([str(folder), "-q"]) == 0
    verdict, line = capsys.readouterr().out.splitlines()
    assert verdict.startswith("Files: PASS")
    assert line.startswith("changed since the build: assembly.pdf, bom.csv, camera.json, ")
    assert main([str(folder), "-q", "--strict"]) == 1
    assert capsys.readouterr().out == "Files: FAIL, failed: paper\n"
    change(folder, "plate_holes.csv", lambda data: data + b"\n")
    assert main([str(folder), "-q"]) in (1, 2)

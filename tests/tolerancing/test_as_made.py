"""Yields that come with every build: of prototypes, and how many are simulated."""

from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.report.as_made import enough_bad

from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.tolerancing.as_made import BUILDS, PRINTED_BY, SEED, prototype_as_made
from tbcad.tolerancing.montecarlo.builds import simulate
from tbcad.tolerancing.process.process import load_process, process_errors
from tbcad.tolerancing.prototype.gravity import read_gravity
from tbcad.tolerancing.prototype.windows import PrototypeCase, prototype_model


def test_prototypes_are_those_of_the_analysis_after_calibration(
    export_with_wind_up: Path,
) -> None:
    """Fewer where enough are bad, with any number at once; pointing is left out."""
    export = read_export(export_with_wind_up)
    spec = export.spec
    plan = read_plan(export)
    model = prototype_model(export.reflectors, plan, read_gravity(export, plan))
    errors = process_errors(load_process(PRINTED_BY), caps=spec.prototype.caps)
    every = simulate(PrototypeCase(model, errors, SEED), 10).calibrated
    quick = simulate(PrototypeCase(model, errors, SEED).calibrated, 10)
    assert quick.coverage.tolist() == every.coverage.tolist()
    worst = simulate(PrototypeCase(model, errors, SEED).calibrated, BUILDS).worst
    bad = np.append(0, (worst < export.capture_mm).cumsum())
    made = prototype_as_made(export)
    assert made.process == PRINTED_BY
    assert made.builds == BUILDS or bad[made.builds] >= enough_bad(BUILDS) > bad[made.builds - 5]
    assert made.share == pytest.approx(1 - bad[made.builds] / made.builds)
    assert made.coverage_mm == np.median(worst[: made.builds])

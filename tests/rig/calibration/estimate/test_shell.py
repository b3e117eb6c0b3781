"""One shell: many mirrors, one photograph."""

import numpy as np
import pytest
from scipy.stats import chi2

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.estimate.solve import Estimate, estimate
from tbcad.rig.calibration.priors import shell_prior
from tbcad.rig.calibration.uncertainty import ray_uncertainty
from tbcad.rig.machine.designed import designed_shell
from tbcad.tolerancing.process.process import load_process, process_errors
from tests.rig.calibration.machines import LEDS, drawn, every_highlight

HIGHLIGHTS = 4


def _prior(design: MirrorDesign) -> Prior:
    machine = designed_shell(reflectors(design)[0], LEDS)
    return shell_prior(machine, process_errors(load_process("sla")))


def _estimated(prior: Prior, seed: int) -> tuple[Estimate, float]:
    """An estimate and d^T C^-1 d of its error."""
    values, machine = drawn(prior, seed)
    found = estimate(prior, every_highlight(machine, 10 + seed))
    off = found.values - values
    return found, float(off @ (found.information @ off))


def test_errors_are_as_large_as_the_covariance_says(small_design: MirrorDesign) -> None:
    prior = _prior(small_design)
    found, square = _estimated(prior, 2)
    low, high = chi2.ppf([0.001, 0.999], len(prior.free))
    assert low < square < high
    assert len(found.highlights) <= HIGHLIGHTS * len(prior.mean.radius)


@pytest.mark.slow
def test_the_whole_shell(paper_design: MirrorDesign) -> None:
    prior = _prior(paper_design)
    count = len(prior.mean.radius)
    _, square = found = _estimated(prior, 1)
    known = ray_uncertainty(found[0], np.zeros(count, dtype=np.int64), np.arange(count))
    assert square < chi2.ppf(0.999, len(prior.free))
    assert len(known.relative.place_mm) == count == 847

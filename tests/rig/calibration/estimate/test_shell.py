"""One shell: many mirrors, one photograph."""

from scipy.stats import chi2

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.rig.calibration.estimate.solve import estimate
from tbcad.rig.calibration.priors import shell_prior
from tbcad.rig.machine.designed import designed_shell
from tbcad.tolerancing.process.process import load_process, process_errors
from tests.rig.calibration.machines import LEDS, drawn, every_highlight

HIGHLIGHTS = 4


def test_errors_are_as_large_as_the_covariance_says(small_design: MirrorDesign) -> None:
    machine = designed_shell(reflectors(small_design)[0], LEDS)
    prior = shell_prior(machine, process_errors(load_process("sla")))
    values, true = drawn(prior, 2)
    found = estimate(prior, every_highlight(true, 12))
    off = found.values - values
    low, high = chi2.ppf([0.001, 0.999], len(prior.free))
    assert low < off @ (found.information @ off) < high
    assert len(found.highlights) <= HIGHLIGHTS * len(prior.mean.radius)

"""Priors follow the process, what was measured, and what is given."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.rig.calibration.estimate.parameters import Block, Prior
from tbcad.rig.calibration.priors import (
    MEASURED_MM,
    parse_measured,
    prototype_prior,
    shell_prior,
)
from tbcad.tolerancing.process.process import load_process, process_errors
from tests.rig.calibration.machines import small_machine

MACHINE = small_machine()
BALLS = len(MACHINE.radius)
ERRORS = process_errors(load_process("fdm"))
CAP, ARM = 2, 9.0
BODY = MACHINE.centre + np.where(np.arange(BALLS)[:, None] == CAP, [ARM, 0, 0], 0.0)
SERIES = np.repeat([0, 1], len(MACHINE.angle) // 2)
UNIFORM = np.sqrt(3)


def prior_of(**known: Any) -> Prior:
    return prototype_prior(MACHINE, ERRORS, BODY, np.arange(BALLS) == CAP, SERIES, 0.01, **known)


def test_figures_are_those_of_the_process() -> None:
    sigma = prior_of().sigma
    assert sigma[Block.CENTRES][0] == pytest.approx(np.full(3, ERRORS.seat.spread))
    tilted = np.hypot(ERRORS.seat.spread, ARM * ERRORS.cap_tilt.spread / UNIFORM)
    assert sigma[Block.CENTRES][CAP] == pytest.approx(np.full(3, tilted))
    assert sigma[Block.RADII][CAP] == pytest.approx(ERRORS.whole_radius.spread)
    assert sigma[Block.RADII][0] == pytest.approx(ERRORS.ball_radius.spread / UNIFORM)
    assert sigma[Block.ANGLES] == pytest.approx(
        np.full(len(MACHINE.angle), ERRORS.rotation_angle.spread)
    )
    assert sigma[Block.RUNOUT].shape == (len(MACHINE.angle), 2)
    expected = np.hypot(0.01 / UNIFORM, ERRORS.rotation_angle.spread)
    assert sigma[Block.OFFSET] == pytest.approx(np.full(2, expected))


def test_a_measured_radius_replaces_the_drawing() -> None:
    parsed = parse_measured(("1=43.2", "2 = 34.61:0.005"), 5)
    assert parsed == ((0, 43.2, MEASURED_MM), (1, 34.61, 0.005))
    prior = prior_of(measured=((CAP, 17.61, 0.004),))
    assert (prior.mean.radius[CAP], prior.sigma[Block.RADII][CAP]) == (17.61, 0.004)
    assert np.delete(prior.mean.radius, CAP) == pytest.approx(np.delete(MACHINE.radius, CAP))
    assert MACHINE.radius[CAP] != 17.61


@pytest.mark.parametrize("of_shell", [False, True])
def test_a_known_lens_is_fixed(of_shell: bool) -> None:
    still = replace(MACHINE, angle=np.zeros(1))
    known = shell_prior(still, ERRORS, lens_known=True) if of_shell else prior_of(lens_known=True)
    for block in (Block.FOCAL, Block.PRINCIPAL, Block.DISTORTION):
        assert not known.sigma[block].any()


FORM = ("", "1", "1=", "1=-4", "a=4", "1=4:", "1=4.3.2", "1=nan")
VALUE = ("0=4", "6=4", "1=0", "1=4:0")


@pytest.mark.parametrize("text", [*FORM, *VALUE])
def test_wrong_texts_are_refused(text: str) -> None:
    says = "is not BALL=RADIUS_MM" if text in FORM else "allowed is ball 1 to 5"
    with pytest.raises(InputError, match=says):
        parse_measured((text,), 5)

"""Caps whose powers and forms are drawn from their prior, and estimated with the machine."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import perpendicular_axes
from tbcad.core.optics.sphere_forms import TERM_COUNT, Forms, sagitta
from tbcad.errors import InputError
from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes
from tbcad.rig.calibration.estimate.parameters import Block, Prior
from tbcad.rig.calibration.estimate.slopes import base_slopes
from tbcad.rig.calibration.estimate.solve import estimate
from tbcad.rig.calibration.priors import prototype_prior
from tbcad.rig.machine.designed import sag_motion
from tbcad.rig.machine.machine import Machine
from tbcad.tolerancing.process.process import load_process, process_errors
from tests.rig.calibration.machines import (
    drawn,
    every_highlight,
    outward,
    seats,
    small_machine,
    small_prior,
)

HALF = np.array([0.0, 0.0, 0.0, 6.0, 8.0])
STEP = 1e-4  # of the prior standard deviations


def capped_machine() -> Machine:
    """Two of its balls are caps."""
    machine = small_machine()
    forms = Forms(np.zeros((len(HALF), TERM_COUNT)), perpendicular_axes(outward(machine)), HALF)
    return replace(machine, forms=forms)


@pytest.fixture(scope="module")
def prior() -> Prior:
    return small_prior(capped_machine())


def of_block(prior: Prior, block: Block) -> np.ndarray:
    """Places of its parameters among the free ones."""
    first = prior.first[block]
    return np.flatnonzero((prior.free >= first) & (prior.free < first + prior.sigma[block].size))


def test_only_caps_have_a_form(prior: Prior) -> None:
    assert ((prior.sigma[Block.POWER] > 0) == (HALF > 0)).all()
    assert ((prior.sigma[Block.FORM] > 0) == (HALF > 0)[:, None]).all()
    assert prior.sigma[Block.POWER].max() == pytest.approx(0.01)  # a hand's


def test_a_power_moves_no_apex_and_is_the_sagitta(prior: Prior) -> None:
    values = np.zeros(len(prior.free))
    values[of_block(prior, Block.POWER)] = 1.0
    before, after = prior.mean, prior.machine(values)
    forms = before.forms
    assert forms is not None
    apices = [one.centre + one.radius[:, None] * forms.outward for one in (before, after)]
    assert apices[1] == pytest.approx(apices[0], abs=1e-12)
    caps = HALF > 0
    grown = sagitta(after.radius[caps], HALF[caps]) - sagitta(before.radius[caps], HALF[caps])
    assert grown == pytest.approx(prior.sigma[Block.POWER][caps])


@pytest.mark.parametrize(
    "block",
    [
        *(Block.POWER, Block.FORM, Block.CENTRES, Block.CAP_TILT, Block.RADII),
        *(Block.CARRIER, Block.TILT, Block.TURN, Block.CAMERA_TURN, Block.PRINCIPAL),
    ],
)
def test_slopes_are_those_of_finite_differences(prior: Prior, block: Block) -> None:
    values, machine = drawn(prior, 3)
    seen = every_highlight(machine, 1)
    places = seen.frame, seen.sphere, seen.led
    pixel, slopes = highlights_with_slopes(prior, values, *places)
    assert pixel == pytest.approx(machine.highlights(*places), abs=1e-9)
    for k in of_block(prior, block).tolist():
        step = STEP * np.eye(len(values))[k]
        ends = [prior.machine(values + sign * step).highlights(*places) for sign in (-1, 1)]
        slope = (ends[1] - ends[0]).ravel() / (2 * STEP)
        found = slopes[:, [k]].toarray().ravel()
        # A tilt that forms did not follow would tell of the axis what nothing tells.
        assert found == pytest.approx(slope, abs=1e-3 * np.abs(slope).max())


def test_errors_are_as_large_as_the_covariance_says(prior: Prior) -> None:
    squares: dict[Block, list[np.ndarray]] = {Block.POWER: [], Block.FORM: [], Block.RADII: []}
    tables = []
    for seed in range(4):
        values, machine = drawn(prior, seed)
        found = estimate(prior, every_highlight(machine, seed))
        off = (found.values - values) / np.sqrt(np.diag(found.covariance))
        for block, ones in squares.items():
            ones.append(off[of_block(prior, block)] ** 2)
        spread = found.covariances(base_slopes(prior, found.values))[:, 3, 3]
        tables.append((found.machine.radius - machine.radius) ** 2 / spread)
    for block, ones in squares.items():
        assert 0.4 < np.mean(ones) < 2, block
    assert 0.3 < np.mean(np.array(tables)[:, HALF > 0]) < 2.5


def test_a_measured_radius_is_one_of_the_cap_about_its_apex() -> None:
    machine, errors = capped_machine(), process_errors(load_process("fdm"))
    none = [sag_motion(machine, machine.centre, np.zeros((len(machine.angle), len(HALF), 3)))]
    series = np.zeros(len(machine.angle), dtype=np.int64)
    seat = seats(machine, np.where(HALF > 0, 8.0, 0.0))

    def measured(value: float) -> Prior:
        return prototype_prior(machine, none, errors, seat, series, measured=((4, value, 0.01),))

    prior, forms = measured(25.3), machine.forms
    assert forms is not None
    assert prior.mean.radius[4] == pytest.approx(25.3)
    apices = [one.centre[4] + one.radius[4] * forms.outward[4] for one in (machine, prior.mean)]
    assert apices[1] == pytest.approx(apices[0])
    # A hundredth of a millimetre of the radius is half a micrometre of the sagitta.
    assert prior.sigma[Block.POWER][4] == pytest.approx(0.01 * 8**2 / (2 * 25**2), rel=0.1)
    with pytest.raises(InputError, match=r"16\.0 mm wide"):
        measured(7.0)


def test_a_tilted_cap_takes_its_form_along_about_its_seat(prior: Prior) -> None:
    values = np.zeros(len(prior.free))
    values[of_block(prior, Block.CAP_TILT)] = 1.0
    tilted, forms = prior.machine(values), prior.mean.forms
    assert tilted.forms is not None
    assert forms is not None
    arm = prior.seat - tilted.centre
    length = np.linalg.norm(arm, axis=1)
    assert length == pytest.approx(np.linalg.norm(prior.arm, axis=1))
    assert arm == pytest.approx(length[:, None] * tilted.forms.outward)
    assert np.abs(tilted.forms.outward - forms.outward)[4].max() > 1e-3


def test_a_camera_is_aimed_by_its_picture(prior: Prior) -> None:
    """What was in the middle stays where it was, as far as the picture is not distorted."""
    values = np.zeros(len(prior.free))
    values[of_block(prior, Block.PRINCIPAL)] = 1.0
    before, after = prior.mean.camera, prior.machine(values).camera
    ahead = (before.pinhole + 100 * before.axes[2])[None]
    assert np.abs(after.principal - before.principal).min() > 10
    assert after.project(ahead) == pytest.approx(before.project(ahead), abs=0.05)

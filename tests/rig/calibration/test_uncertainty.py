"""Uncertainties against finite differences, dense algebra, and machines solved again and again."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from tbcad.common.results import study_files
from tbcad.core.geometry.vectors import dot, perpendicular_axes
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.calibration.estimate.jacobian import base_slopes
from tbcad.rig.calibration.estimate.parameters import Block, Prior, covariance
from tbcad.rig.calibration.estimate.solve import Estimate, estimate
from tbcad.rig.calibration.led_layout import NUMBERS
from tbcad.rig.calibration.priors import (
    MEASURED_MM,
    parse_measured,
    prototype_prior,
    shell_prior,
)
from tbcad.rig.calibration.report.recovered import at_plane, centre_pixels, traced
from tbcad.rig.calibration.study import (
    NOISES_PX,
    ONE_BALL,
    PROCESSES,
    SHARES,
    calibration_study,
)
from tbcad.rig.calibration.uncertainty import (
    SPHERE_MM,
    ray_slopes,
    ray_uncertainty,
    rigid_motions,
)
from tbcad.tolerancing.process.process import load_process, process_errors
from tests.rig.calibration.machines import drawn, every_highlight, small_machine, small_prior

STEP = 1e-3
FEW, MANY = 10, 100
MARGIN_PX = 100
MACHINE = small_machine()
BALLS = len(MACHINE.radius)
ERRORS = process_errors(load_process("fdm"))
CAP, ARM = 2, 9.0
BODY = MACHINE.centre + np.where(np.arange(BALLS)[:, None] == CAP, [ARM, 0, 0], 0.0)
SERIES = np.repeat([0, 1], len(MACHINE.angle) // 2)
UNIFORM = np.sqrt(3)


@pytest.fixture(scope="module")
def prior() -> Prior:
    return small_prior(small_machine(stops=6))


@pytest.fixture(scope="module")
def found(prior: Prior) -> Estimate:
    return estimate(prior, every_highlight(drawn(prior, 1)[1], 2))


def _all_rays(prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """All that show the object's centre well within the picture."""
    shape = (len(prior.mean.angle), len(prior.mean.radius))
    frame, sphere = (one.ravel() for one in np.indices(shape))
    pixel, camera = centre_pixels(prior.mean, frame, sphere), prior.mean.camera
    size = np.array([camera.width_px, camera.height_px])
    inside = ((pixel > MARGIN_PX) & (pixel < size - MARGIN_PX)).all(axis=1)
    return frame[inside], sphere[inside]


def test_blocks_are_those_of_the_dense_inverse(found: Estimate) -> None:
    known = covariance(found.prior, found.information)
    dense = np.linalg.inv(found.information.toarray())
    slopes, _ = ray_slopes(found.prior, found.values, *_all_rays(found.prior))
    full = slopes @ dense @ slopes.T
    blocks = known.of(slopes, 4)
    for k, block in enumerate(blocks):
        expected = full[4 * k : 4 * k + 4, 4 * k : 4 * k + 4]
        assert block == pytest.approx(expected, rel=1e-6, abs=1e-12)
    assert known.sigma() == pytest.approx(np.sqrt(np.diag(dense)), rel=1e-7)
    vectors = np.random.default_rng(0).standard_normal((len(dense), 3))
    assert known.times(vectors) == pytest.approx(dense @ vectors, rel=1e-7, abs=1e-9)


def test_motions_are_taken_off_as_by_a_fit_to_each_error(found: Estimate) -> None:
    """Errors drawn from the covariance, each less the shift and rotation that fit it best."""
    frame, sphere = _all_rays(found.prior)
    slopes, direction = ray_slopes(found.prior, found.values, frame, sphere)
    dense = np.linalg.inv(found.information.toarray())
    turned = found.prior.series[frame] > 0
    motions = rigid_motions(direction, np.where(turned[:, None], HALF_TURN, np.ones(3)))
    weight = np.tile([1.0, 1.0, SPHERE_MM, SPHERE_MM], len(frame))
    errors = slopes @ np.linalg.cholesky(dense)
    known = ray_uncertainty(found, frame, sphere)
    row_turned = np.repeat(turned, 4)
    for groups, blocks in (
        ([np.ones(len(row_turned), dtype=bool)], known.relative.covariance),
        ([~row_turned, row_turned], known.in_run.covariance),
    ):
        rest = errors.copy()
        for rows in groups:
            scale = weight[rows, None]
            fit = np.linalg.lstsq(scale * motions[rows], scale * errors[rows], rcond=None)[0]
            rest[rows] -= motions[rows] @ fit
        by_ray = rest.reshape(len(frame), 4, -1)
        assert blocks == pytest.approx(by_ray @ by_ray.swapaxes(1, 2), rel=1e-5, abs=1e-11)


def test_slopes_of_rays_are_those_of_traced_rays(prior: Prior) -> None:
    """A ray through a fixed pixel, traced in the machine with each parameter a little off."""
    values, machine = drawn(prior, 4)
    rays = _all_rays(prior)
    slopes, direction = ray_slopes(prior, values, *rays)
    pixel, across = centre_pixels(machine, *rays), perpendicular_axes(direction)
    dense = slopes.toarray().reshape(len(pixel), 4, -1)
    for k, step in enumerate(STEP * np.eye(len(values))):
        ends = [traced(prior.machine(values + sign * step), pixel, *rays) for sign in (-1, 1)]
        places = [at_plane(*end, direction) for end in ends]
        moved = (places[1] - places[0]) / (2 * STEP)
        turned = (ends[1][1] - ends[0][1]) / (2 * STEP)
        for row, change in ((0, moved), (2, turned)):
            for i in (0, 1):
                slope = dot(change, across[:, i])
                assert dense[:, row + i, k] == pytest.approx(slope, rel=1e-5, abs=1e-6), k


def test_slopes_of_spheres_on_the_base(prior: Prior) -> None:
    values, _ = drawn(prior, 5)
    dense = base_slopes(prior, values).matrix(prior).toarray()
    for k, step in enumerate(STEP * np.eye(len(values))):
        ends = [_spheres(prior, values + sign * step) for sign in (-1, 1)]
        slope = (ends[1] - ends[0]).ravel() / (2 * STEP)
        assert dense[:, k] == pytest.approx(slope, rel=1e-6, abs=1e-9), k


def _spheres(prior: Prior, values: np.ndarray) -> np.ndarray:
    machine = prior.machine(values)
    return np.column_stack([machine.centre, machine.radius])


def _errors_over_sigmas(prior: Prior, solves: int) -> np.ndarray:
    """Squares of the rays' errors at the object over their variances, (solves, m)."""
    rays, squares = _all_rays(prior), []
    for seed in range(solves):
        _, machine = drawn(prior, 1000 + seed)
        result = estimate(prior, every_highlight(machine, 2000 + seed))
        known = ray_uncertainty(result, *rays)
        pixel = centre_pixels(result.machine, *rays)
        missed = at_plane(*traced(machine, pixel, *rays), known.direction)
        squares.append((missed**2).sum(axis=1) / known.whole.place_mm**2)
    return np.array(squares)


def test_rays_are_off_by_what_the_covariance_says(prior: Prior) -> None:
    """Rays share errors: the bound is that of as many independent pairs as there are solves."""
    mean = _errors_over_sigmas(prior, FEW).mean()
    low, high = chi2.ppf([0.001, 0.999], 2 * FEW) / (2 * FEW)
    assert low < mean < high


@pytest.mark.slow
def test_every_case_has_figures(export: ExportedDesign) -> None:
    """More of the best LEDs and less noise bring rays closer."""
    found = calibration_study(export, lambda _: None)
    alone, whole, places = found.tables
    layouts = len(NUMBERS) + 1
    assert len(alone.rows) == 3 * layouts + 1
    assert len(whole.rows) == len(NOISES_PX) + len(PROCESSES) - 1 + len(NUMBERS)
    assert len(places.rows) == sum(NUMBERS) + 4
    for table in (alone, whole):
        for unit in ("mm", "mrad"):
            low, high = (
                np.array(table.column(f"{unit}_{share}"), dtype=np.float64) for share in SHARES
            )
            assert (low > 0).all()
            assert (low <= high).all()
    assert ONE_BALL in alone.column("centre and radius")
    files = study_files(found)
    assert files["calibration.png"].startswith(b"\x89PNG")
    records = whole.records()
    leds = [row["mm_50"] for row in records if row["layout"] == "best"]
    noises = [row["mm_50"] for row in records if row["layout"] == "design"][: len(NOISES_PX)]
    assert leds == sorted(leds, reverse=True)
    assert noises == sorted(noises)


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

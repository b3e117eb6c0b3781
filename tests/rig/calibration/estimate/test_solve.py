"""Machines recovered from noisy highlights, with wrong ones among them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.stats import chi2

from tbcad.common.results import study_files
from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import dot, perpendicular_axes, unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.reflection import reflection_points
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.light.simulate.scene.reflector import ExportedDesign, reflectors
from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes, reflections
from tbcad.rig.calibration.estimate.parameters import Block, Prior, prior_of
from tbcad.rig.calibration.estimate.slopes import base_slopes, covariances
from tbcad.rig.calibration.estimate.solve import Estimate, estimate, outlier_limit
from tbcad.rig.calibration.led_layout import NUMBERS, only_spheres, ray_errors, shell_information
from tbcad.rig.calibration.priors import (
    MEASURED_MM,
    parse_measured,
    prototype_prior,
    shell_prior,
)
from tbcad.rig.calibration.report.recovered import at_plane, centre_pixels, traced
from tbcad.rig.calibration.study import (
    NOISES_PX,
    PROCESSES,
    SHARES,
    calibration_study,
)
from tbcad.rig.calibration.uncertainty import (
    SPHERE_MM,
    known_rays,
    ray_slopes,
    rigid_motions,
)
from tbcad.rig.machine.designed import designed_shell, read_leds, sag_motion
from tbcad.rig.machine.machine import Highlights, Machine
from tbcad.tolerancing.process.process import load_process, process_errors
from tests.rig.calibration.machines import (
    LEDS,
    NOISE_PX,
    drawn,
    every_highlight,
    seats,
    small_machine,
    small_prior,
)

SIGMA_MM, RADIUS_MM = 0.025, 0.002  # of centres and radii
STEP = 1e-3  # of the prior standard deviations
FEW = 10
MARGIN_PX = 100
MACHINE = small_machine()
BALLS = len(MACHINE.radius)
ERRORS = process_errors(load_process("fdm"))
CAP, ARM = 2, 9.0
SEATS = seats(MACHINE, np.where(np.arange(BALLS) == CAP, ARM, 0.0))
NONE = np.zeros((len(MACHINE.angle), BALLS, 3))
SERIES = np.repeat([0, 1], len(MACHINE.angle) // 2)
UNIFORM = np.sqrt(3)


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


def test_covariances_are_blocks_of_that_of_all_figures(found: Estimate) -> None:
    slopes, _ = ray_slopes(found.prior, found.values, *_all_rays(found.prior))
    full = slopes @ found.covariance @ slopes.T
    for k, block in enumerate(covariances(found.covariance, slopes, 4)):
        expected = full[4 * k : 4 * k + 4, 4 * k : 4 * k + 4]
        assert block == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_motions_are_taken_off_as_by_a_fit_to_each_error(found: Estimate) -> None:
    """Errors drawn from the covariance, each less the shift and rotation that fit it best."""
    frame, sphere = _all_rays(found.prior)
    slopes, direction = ray_slopes(found.prior, found.values, frame, sphere)
    dense = np.linalg.inv(found.information.toarray())
    turned = found.prior.series[frame] > 0
    motions = rigid_motions(direction, np.where(turned[:, None], HALF_TURN, np.ones(3)))
    weight = np.tile([1.0, 1.0, SPHERE_MM, SPHERE_MM], len(frame))
    errors = slopes @ np.linalg.cholesky(dense)
    known = known_rays(found.prior, found.values, found.covariance, frame, sphere)
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
    check_slopes(_spheres, prior, values, base_slopes(prior, values).matrix(prior), abs=1e-9)


def _spheres(machine: Machine) -> np.ndarray:
    return np.column_stack([machine.centre, machine.radius])


def check_slopes(
    figures: Callable[[Machine], np.ndarray],
    prior: Prior,
    values: np.ndarray,
    slopes: csr_array,
    abs: float,
) -> None:
    """Compare derivatives (n, q) of a machine's figures with differences."""
    for k, step in enumerate(STEP * np.eye(len(values))):
        low, high = (figures(prior.machine(values + sign * step)) for sign in (-1, 1))
        slope = (high - low).ravel() / (2 * STEP)
        assert slopes[:, [k]].toarray().ravel() == pytest.approx(slope, rel=1e-6, abs=abs), k


def _errors_over_sigmas(prior: Prior, solves: int) -> np.ndarray:
    """Squares of the rays' errors at the object over their variances, (solves, m)."""
    rays, squares = _all_rays(prior), []
    for seed in range(solves):
        _, machine = drawn(prior, 1000 + seed)
        result = estimate(prior, every_highlight(machine, 2000 + seed))
        known = known_rays(prior, result.values, result.covariance, *rays)
        pixel = centre_pixels(result.machine, *rays)
        missed = at_plane(*traced(machine, pixel, *rays), known.direction)
        squares.append((missed**2).sum(axis=1) / known.whole.place_mm**2)
    return np.array(squares)


def test_rays_are_off_by_what_the_covariance_says(prior: Prior) -> None:
    """Rays share errors: the bound is that of as many independent pairs as there are solves."""
    mean = _errors_over_sigmas(prior, FEW).mean()
    low, high = chi2.ppf([0.001, 0.999], 2 * FEW) / (2 * FEW)
    assert low < mean < high


def test_single_spheres_are_the_whole_model_with_all_else_fixed(export: ExportedDesign) -> None:
    leds = read_leds(export.folder)
    information = shell_information(export, leds)
    mm, mrad = ray_errors(information, [*range(len(leds))], NOISE_PX, (SIGMA_MM, RADIUS_MM))
    led, sphere = np.nonzero(information.by_led.any(axis=(2, 3)))
    free = only_spheres(designed_shell(export.reflectors[0], leds))
    known_to = {Block.CENTRES: SIGMA_MM, Block.RADII: RADIUS_MM}
    prior = prior_of(free.mean, free.series, known_to)
    values, every = np.zeros(len(prior.free)), np.arange(len(mm))
    _, slopes = highlights_with_slopes(prior, values, 0 * led, sphere, led)
    known = np.linalg.inv((slopes.T @ slopes).toarray() / NOISE_PX**2 + np.eye(len(values)))
    rays = known_rays(prior, values, known, 0 * every, every).whole
    assert mm == pytest.approx(rays.place_mm, rel=1e-6)
    assert mrad == pytest.approx(rays.turn_mrad, rel=1e-6)


@pytest.mark.slow
def test_every_case_has_figures(export: ExportedDesign) -> None:
    """More of the best LEDs and less noise bring rays closer."""
    found = calibration_study(export, lambda _: None)
    alone, whole, places = found.tables
    assert len(alone.rows) == 3 * (len(NUMBERS) + 1) + 1
    assert len(whole.rows) == len(NOISES_PX) + len(PROCESSES) - 1 + len(NUMBERS)
    assert len(places.rows) == sum(NUMBERS) + 4
    for table in (alone, whole):
        for one in ("mm", "mrad"):
            low, high = (table.numbers(f"{one}_{share}") for share in SHARES)
            assert ((low > 0) & (low <= high)).all()
    assert study_files(found)["calibration.svg"].startswith(b"<?xml")
    records = whole.records()
    leds = [row["mm_50"] for row in records if row["layout"] == "best"]
    noises = [row["mm_50"] for row in records if row["layout"] == "design"][: len(NOISES_PX)]
    assert leds == sorted(leds, reverse=True)
    assert noises == sorted(noises)


def of_prototype(**known: Any) -> Prior:
    still = [sag_motion(MACHINE, MACHINE.centre, NONE)]
    return prototype_prior(MACHINE, still, ERRORS, SEATS, SERIES, 0.01, **known)


def test_figures_are_those_of_the_process() -> None:
    sigma = of_prototype().sigma
    assert sigma[Block.CENTRES][0] == pytest.approx(np.full(3, ERRORS.seat.spread))
    assert sigma[Block.CENTRES][CAP] == pytest.approx(np.full(3, ERRORS.seat.spread))
    assert sigma[Block.CAP_TILT][CAP] == pytest.approx(np.full(2, ERRORS.cap_tilt.spread / UNIFORM))
    assert np.flatnonzero(sigma[Block.CAP_TILT].any(axis=1)).tolist() == [CAP]
    assert sigma[Block.RADII][CAP] == pytest.approx(ERRORS.whole_radius.spread)
    assert sigma[Block.RADII][0] == pytest.approx(ERRORS.ball_radius.spread / UNIFORM)
    assert sigma[Block.ANGLES] == pytest.approx(
        np.full(len(MACHINE.angle), ERRORS.rotation_angle.spread)
    )
    assert sigma[Block.SHIFT] == pytest.approx(np.full((len(MACHINE.angle), 3), 0.01))
    assert sigma[Block.TURN] == pytest.approx(ERRORS.axis_wobble.spread * np.ones((24, 2)))
    assert (sigma[Block.SAG] == 0.25).all()
    expected = np.hypot(0.01 / UNIFORM, ERRORS.rotation_angle.spread)
    assert sigma[Block.OFFSET] == pytest.approx(np.full(2, expected))


def test_weight_moves_frames_as_it_is_expected_to_and_by_as_much_as_that_may_be_off() -> None:
    """The motion and what is left put every ball where its weight does."""
    bends = 0.01 * np.random.default_rng(2).standard_normal((2, *NONE.shape))
    prior = prototype_prior(
        MACHINE, [sag_motion(MACHINE, MACHINE.centre, one) for one in bends], ERRORS, SEATS, SERIES
    )
    frame, sphere = np.repeat(np.arange(24), BALLS), np.tile(np.arange(BALLS), 24)
    moved = prior.mean.centres(frame, sphere) - MACHINE.centres(frame, sphere)
    expected = rotated(bends.sum(axis=0)[frame, sphere], MACHINE.axis, MACHINE.angle[frame])
    assert moved == pytest.approx(expected, abs=3e-5)  # turns of 0.5 mrad to first order
    assert prior.sigma[Block.SHIFT][0, 0] > of_prototype().sigma[Block.SHIFT][0, 0]


def test_weight_turns_a_flat_cap_with_its_seat() -> None:
    """The centre of its sphere, metres behind the seat, moves by as much as its arm is long."""
    turn = np.array([1e-4, -2e-4, 3e-4])
    far = replace(MACHINE, centre=MACHINE.centre + 3000.0 * np.eye(3)[0])
    moved = sag_motion(far, MACHINE.centre, np.cross(turn, MACHINE.centre) + NONE)
    assert moved.sag == pytest.approx(0, abs=1e-9)
    bent = replace(far, angle=far.angle + moved.angle, turn=moved.turn, shift=moved.shift)
    frame, sphere = np.repeat(np.arange(24), BALLS), np.tile(np.arange(BALLS), 24)
    found = bent.centres(frame, sphere) - far.centres(frame, sphere)
    expected = rotated(np.cross(turn, far.centre)[sphere], MACHINE.axis, MACHINE.angle[frame])
    assert found == pytest.approx(expected, abs=1e-3)


def test_a_seat_that_turns_its_own_way_takes_its_cap_along_and_leaves_balls_in_place() -> None:
    own = 1e-3 * np.random.default_rng(4).standard_normal(NONE.shape)
    moved = sag_motion(MACHINE, SEATS, NONE, own)
    assert moved.sag[:, CAP] == pytest.approx(np.cross(own, MACHINE.centre - SEATS)[:, CAP])
    assert np.delete(moved.sag, CAP, axis=1) == pytest.approx(0, abs=1e-12)
    bent = replace(MACHINE, sag=moved.sag, seat_turn=moved.seat_turn)
    frame = np.arange(len(MACHINE.angle))
    sphere = np.full_like(frame, CAP)
    body = np.broadcast_to(SEATS[CAP], (len(frame), 3))
    still = MACHINE.placed(body, frame)
    assert bent.on_spheres(body, frame, sphere) == pytest.approx(still, abs=1e-4)


def test_a_measured_radius_replaces_the_drawing() -> None:
    parsed = parse_measured(("1=43.2", "2 = 34.61:0.005"), 5)
    assert parsed == ((0, 43.2, MEASURED_MM), (1, 34.61, 0.005))
    prior = of_prototype(measured=((CAP, 17.61, 0.004),))
    assert (prior.mean.radius[CAP], prior.sigma[Block.RADII][CAP]) == (17.61, 0.004)
    assert np.delete(prior.mean.radius, CAP) == pytest.approx(np.delete(MACHINE.radius, CAP))
    assert MACHINE.radius[CAP] != 17.61


@pytest.mark.parametrize("of_shell", [False, True])
def test_a_known_lens_is_fixed(of_shell: bool) -> None:
    still = replace(MACHINE, angle=np.zeros(1))
    known = (
        shell_prior(still, ERRORS, lens_known=True) if of_shell else of_prototype(lens_known=True)
    )
    for block in (Block.FOCAL, Block.PRINCIPAL, Block.DISTORTION):
        assert not known.sigma[block].any()


FORM = ("", "1", "1=", "1=-4", "a=4", "1=4:", "1=4.3.2", "1=nan")
VALUE = ("0=4", "6=4", "1=0", "1=4:0")


@pytest.mark.parametrize("text", [*FORM, *VALUE])
def test_wrong_texts_are_refused(text: str) -> None:
    says = "is not BALL=RADIUS_MM" if text in FORM else "allowed is ball 1 to 5"
    with pytest.raises(InputError, match=says):
        parse_measured((text,), 5)


@pytest.mark.parametrize("ball", [0, CAP])
@pytest.mark.parametrize("factor", [0.5, 2, 100])
def test_a_diameter_or_a_shifted_point_is_no_radius(ball: int, factor: float) -> None:
    value = factor * MACHINE.radius[ball]
    with pytest.raises(InputError, match=r"the design has a radius of|not its sagitta"):
        of_prototype(measured=((ball, value, 0.01),))


def test_two_radii_of_one_ball_are_refused() -> None:
    with pytest.raises(InputError, match="ball 1 has a radius already"):
        parse_measured(("1=43.2", "2=34.61", "1=44"), 5)


BUILDS = 8
FIRST_SEED = 10  # of a machine: the lens of seed 5 nearly folds within its picture
PRIOR = small_prior(small_machine(stops=3))
HIGHLIGHTS = 4


def test_errors_are_as_large_as_the_covariance_says(prior: Prior) -> None:
    """Over machines drawn from the prior, d^T C^-1 d is chi-squared: also the builds' sum."""
    total = 0.0
    for seed in range(BUILDS):
        values, machine = drawn(prior, FIRST_SEED + seed)
        found = estimate(prior, every_highlight(machine, 100 + seed))
        off = found.values - values
        total += float(off @ (found.information @ off))
    low, high = chi2.ppf([0.001, 0.999], BUILDS * len(prior.free))
    assert low < total < high


def test_wrong_highlights_are_named_and_left_out(prior: Prior) -> None:
    _, machine = drawn(prior, 3)
    right = every_highlight(machine, 4)
    wrong = np.array([5, 80, 133, 190])
    pixel = right.pixel.copy()
    pixel[wrong] += np.array([[2.0, 0.0], [0.0, -40.0], [0.6, 0.6], [-300.0, 200.0]])
    found = estimate(prior, replace(right, pixel=pixel))
    assert np.flatnonzero(~found.used).tolist() == wrong.tolist()
    assert (found.sigmas_off[wrong] > outlier_limit(len(right))).all()
    exact = estimate(prior, right)
    assert np.abs(found.machine.centre - exact.machine.centre).max() < 0.05


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_noise_that_is_larger_than_said_is_found(prior: Prior, factor: float) -> None:
    _, machine = drawn(prior, 5)
    noisy = every_highlight(machine, 6, factor * NOISE_PX)
    found = estimate(prior, replace(noisy, sigma=np.full(len(noisy), NOISE_PX)))
    assert found.noise_factor == pytest.approx(factor, rel=0.1)
    assert np.sqrt((found.sigmas_off**2).mean() / 2) == pytest.approx(1, rel=0.15)
    assert found.used.all()


def test_two_series_have_offsets_of_their_own(prior: Prior) -> None:
    offsets = prior.first[Block.OFFSET]
    values = np.zeros(len(prior.free))
    values[np.searchsorted(prior.free, [offsets, offsets + 1])] = 3.0, -3.0
    machine = prior.machine(values)
    found = estimate(prior, every_highlight(machine, 7)).machine
    stops = len(machine.angle) // 2
    apart = found.angle[:stops] - found.angle[stops:]
    assert apart == pytest.approx(machine.angle[:stops] - machine.angle[stops:], abs=1e-3)
    assert np.abs(apart).min() > 5e-3


def test_nothing_to_calibrate_from(prior: Prior) -> None:
    none = np.zeros(0, dtype=np.int64)
    empty = Highlights(none, none, none, np.zeros((0, 2)), np.zeros(0))
    with pytest.raises(InputError, match="no highlights"):
        estimate(prior, empty)


def _case(seed: int, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    pinhole, light = np.array([100.0, 0.0, -100.0]), rng.uniform(-25, 25, size=(5, 3))
    apex = unit(rng.normal(loc=(0, 0, 1.5), size=(5, 3))) * 150
    normal = unit(unit(light - apex) + unit(pinhole - apex) + 0.05 * rng.normal(size=(5, 3)))
    return apex - radius * normal, np.full(5, radius), light, pinhole


@given(st.integers(0, 2**32 - 1), st.floats(1, 2000))
@example(3008991829, 246.0)  # Newton's steps from the bisector at the centre go astray
@settings(max_examples=40)
def test_the_point_is_that_of_the_law_of_reflection(seed: int, radius: float) -> None:
    case = _case(seed, radius)
    assert reflections(*case).point == pytest.approx(reflection_points(*case), abs=1e-8)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=2)
def test_slopes_are_those_of_finite_differences(seed: int) -> None:
    values, machine = drawn(PRIOR, seed)
    shape = (len(machine.angle), len(machine.radius), len(machine.leds))
    picked = [one.ravel()[::7] for one in np.indices(shape)]
    pixel, slopes = highlights_with_slopes(PRIOR, values, *picked)
    assert pixel == pytest.approx(machine.highlights(*picked), abs=1e-8)
    check_slopes(lambda one: one.highlights(*picked), PRIOR, values, slopes, abs=1e-5)


def test_errors_of_a_shell_are_as_large_as_the_covariance_says(small_design: MirrorDesign) -> None:
    machine = designed_shell(reflectors(small_design)[0], LEDS)
    prior = shell_prior(machine, process_errors(load_process("sla")))
    values, true = drawn(prior, 2)
    found = estimate(prior, every_highlight(true, 12))
    off = found.values - values
    low, high = chi2.ppf([0.001, 0.999], len(prior.free))
    assert low < off @ (found.information @ off) < high
    assert len(found.highlights) <= HIGHLIGHTS * len(prior.mean.radius)

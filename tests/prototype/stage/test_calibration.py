"""What LEDs tell of spheres' centres, against reflection and simulated photographs."""

import numpy as np
import pytest

from tbcad.core.optics.reflection import reflection_points
from tbcad.core.spec.load import load_spec
from tbcad.prototype.stage.leds import (
    MIN_SEEN,
    NOISE_PX,
    calibration_estimate,
    hidden_by_object,
)
from tests.mirror_arrays import mirror_array

STAGE = load_spec(None).prototype.stage
LEDS = np.array(STAGE.leds_mm)
CAPTURE = 30.0


def test_the_covariance_is_that_of_centres_solved_from_noisy_highlights() -> None:
    """Least squares on 400 noisy photographs of the LEDs that a mirror sees."""
    array, mirror = mirror_array("n=6"), 20
    seen = ~hidden_by_object(
        STAGE, LEDS, array.ellipsoid.camera_distance * array.u[[mirror]], CAPTURE
    )
    leds, rng = LEDS[seen[0]], np.random.default_rng(2)
    centre, radius = array.mirrors.centre[mirror], array.mirrors.radius[mirror]
    pinhole = array.camera.pinhole

    def highlights(centres: np.ndarray) -> np.ndarray:
        radii = np.full(len(centres), radius)
        points = [reflection_points(centres, radii, place, pinhole) for place in leds]
        return np.concatenate([array.camera.project(point) for point in points], axis=1)

    true = highlights(centre[None])
    noisy = true + NOISE_PX * rng.normal(size=(400, true.shape[1]))
    solved = np.repeat(centre[None], 400, axis=0)
    for _ in range(6):
        steps = [highlights(solved + 1e-4 * axis) for axis in np.eye(3)]
        slope = np.stack([(one - highlights(solved)) / 1e-4 for one in steps], axis=2)
        rest = noisy - highlights(solved)
        solved += np.stack(
            [np.linalg.lstsq(a, b, rcond=None)[0] for a, b in zip(slope, rest, strict=True)]
        )
    spread = np.sqrt(np.linalg.eigvalsh(np.cov(solved.T))[-1])
    estimate = calibration_estimate(STAGE, array, LEDS, CAPTURE)
    assert spread == pytest.approx(estimate.worst[mirror], rel=0.1)
    assert estimate.seen.min() >= MIN_SEEN
    assert (estimate.across < estimate.worst).all()


def test_more_leds_tell_more() -> None:
    array = mirror_array("n=6")
    more = np.vstack([LEDS, [[0.0, -23.4, -6.0]]])
    few, many = (calibration_estimate(STAGE, array, leds, CAPTURE) for leds in (LEDS, more))
    assert (many.worst <= few.worst * (1 + 1e-9)).all()
    assert many.record().centre_um_median < few.record().centre_um_median

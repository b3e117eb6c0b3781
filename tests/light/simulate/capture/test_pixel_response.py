"""Point spread functions as rays of a pixel, against closed forms."""

import numpy as np
import pytest

from tbcad.light.simulate.capture.photograph import photograph, subpixel_shifts
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.studies.low_pass import defocus_shifts, low_pass_shifts


def contrast(shifts: tuple[tuple[float, float], ...], frequency: float) -> float:
    """What is left of a sine along the rows, cycles a pixel."""
    x = np.array(shifts)[:, 0]
    return float(np.abs(np.exp(2j * np.pi * frequency * x).mean()))


@pytest.mark.parametrize("separation", [0.75, 1.0, 2.0])
@pytest.mark.parametrize("frequency", [0.1, 0.25, 0.4])
def test_low_pass_filter_passes_its_cosine(separation: float, frequency: float) -> None:
    """|cos(pi s f)|, times the pixel's own response."""
    pixel = contrast(tuple(subpixel_shifts(3)), frequency)
    expected = abs(np.cos(np.pi * separation * frequency)) * pixel
    assert contrast(low_pass_shifts(separation, 3), frequency) == pytest.approx(expected, abs=1e-12)


def test_defocus_fills_its_circle() -> None:
    """Radius of gyration: that of the circle and of the pixel, d^2 / 8 + 1 / 6."""
    places = np.array(defocus_shifts(6.0, 400))
    assert np.abs(places.mean(axis=0)).max() < 0.02
    assert (places**2).sum(axis=1).mean() == pytest.approx(36 / 8 + 1 / 6, rel=0.01)


def test_photograph_is_the_mean_at_these_places(
    cameras: tuple[Reflector, Reflector], knot: Scene
) -> None:
    at = cameras[0]
    trace = exact_tracer(at)
    same = list(photograph(at.camera, trace, knot, tuple(subpixel_shifts(2))))
    square = list(photograph(at.camera, trace, knot, 2))
    blurred = list(photograph(at.camera, trace, knot, low_pass_shifts(2.0, 1)))
    assert all(np.array_equal(a.colour, b.colour) for a, b in zip(same, square, strict=True))
    assert all(
        np.array_equal(a.rays.mirror, b.rays.mirror) for a, b in zip(blurred, square, strict=True)
    )
    one, four = (
        np.concatenate([band.colour for band in bands]).astype(float) for bands in (square, blurred)
    )
    assert np.diff(four, axis=1).std() < 0.8 * np.diff(one, axis=1).std()

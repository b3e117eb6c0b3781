"""A sensor's numbers have the mean, the noise and the limits that its figures say."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from tbcad.core.optics.camera import LensCamera
from tbcad.rig.simulated_run.sensor import (
    PixelMaps,
    SimulatedSensor,
    generator,
    pixel_directions,
    pixel_maps,
    recorded,
)

SENSOR = SimulatedSensor(grains=0, hot_share=0.0)
CAMERA = LensCamera(
    np.zeros(3), np.eye(3), np.full(2, 300.0), np.array([159.5, 119.5]), np.zeros(5), 320, 240
)
FLAT = PixelMaps(np.ones((240, 320), dtype=np.float32), np.zeros(0, dtype=np.int64), np.zeros(0))


def photographed(
    sensor: SimulatedSensor, light: float | None, maps: PixelMaps = FLAT
) -> np.ndarray:
    even = None if light is None else np.full((240, 320), light, dtype=np.float32)
    return recorded(sensor, maps, even, generator(1, 2))


def test_mean_and_variance_of_light() -> None:
    image = photographed(SENSOR, 0.5).astype(float)
    number = SENSOR.largest / SENSOR.full_electrons
    mean = 0.5 * SENSOR.full_electrons + SENSOR.dark_electrons
    variance = (mean + SENSOR.read_electrons**2) * number**2 + 1 / 12
    pixels = image.size
    assert image.mean() == pytest.approx(number * mean, abs=4 * np.sqrt(variance / pixels))
    # The variance of a normal sample's variance is 2 / n of its square.
    assert image.var() == pytest.approx(variance, rel=4 * np.sqrt(2 / pixels) + 0.01)


def test_colours_have_noise_of_their_own() -> None:
    image = photographed(SENSOR, 0.5).astype(float).reshape(-1, 3)
    assert abs(np.corrcoef(image[:, 0], image[:, 1])[0, 1]) < 4 / np.sqrt(len(image))


def test_darkness_is_drawn_one_by_one_as_often_as_the_noise_says() -> None:
    sensor = replace(SENSOR, read_electrons=6.0)
    image = photographed(sensor, None)
    spread = np.sqrt(sensor.dark_electrons + sensor.read_electrons**2)
    step = sensor.full_electrons / sensor.largest
    share = norm.sf((step / 2 - sensor.dark_electrons) / spread)
    count = int((image > 0).sum())
    assert count == pytest.approx(share * image.size, abs=4 * np.sqrt(share * image.size))


def test_saturation_and_bits() -> None:
    assert (photographed(SENSOR, 2.0) == 255).all()
    sixteen = photographed(replace(SENSOR, bits=16, noise=0.0), 0.5)
    assert sixteen.dtype == np.uint16
    assert sixteen.shape == (240, 320)
    assert (sixteen == round((5000 + SENSOR.dark_electrons) * 65535 / 10_000)).all()
    for seconds in (0.5, 2.0):  # the dark signal grows with the exposure
        sensor = replace(SENSOR, bits=16, noise=0.0)
        image = recorded(sensor, FLAT, None, generator(3), seconds)
        assert (image == round(seconds * sensor.dark_electrons * 65535 / 10_000)).all()


def test_hot_pixels_are_hot_in_every_photograph() -> None:
    sensor = SimulatedSensor(grains=0, hot_share=1e-3, hot_electrons=4000.0)
    maps = pixel_maps(CAMERA, pixel_directions(CAMERA), sensor, seed=3)
    assert len(maps.hot) == round(1e-3 * 320 * 240)
    dark, light = (photographed(sensor, level, maps).reshape(-1, 3) for level in (None, 0.1))
    # Neither dark nor, with 1000 electrons of light more, full.
    bright = maps.hot[(maps.hot_electrons > 1000) & (maps.hot_electrons < 7000)]
    assert len(bright) > 10
    assert (dark[bright] > 15).all()
    assert (light[bright].mean(axis=1) > dark[bright].mean(axis=1)).all()


def test_a_lens_loses_light_as_the_fourth_power_of_the_cosine() -> None:
    maps = pixel_maps(CAMERA, pixel_directions(CAMERA), SENSOR, seed=3)
    tangent = np.hypot(159.5, 119.5) / 300
    assert maps.transmission[0, 0] == pytest.approx(1 / (1 + tangent**2) ** 2, rel=1e-5)


def test_dust_darkens_some_pixels_and_brightens_none() -> None:
    directions = pixel_directions(CAMERA)
    clean = pixel_maps(CAMERA, directions, SENSOR, seed=3).transmission
    dusty = pixel_maps(CAMERA, directions, replace(SENSOR, grains=5), seed=3).transmission
    assert (dusty <= clean).all()
    assert 0.75 < (dusty / clean).min() < 0.98

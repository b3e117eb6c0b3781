"""From light to numbers: vignetting, dust, noise, dark signal, quantisation and saturation.

The sensor is linear. Signals are shares of a full pixel until electrons are counted.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from tbcad.core.optics.camera import LensCamera, vignetting
from tbcad.types import Bools, Floats, Ints

Signal = NDArray[np.float32]
Image16 = NDArray[np.uint8] | NDArray[np.uint16]

CHANNELS = 3
DUST_STREAM, HOT_STREAM = 3000, 3001
DUST_RADIUS_PX, DUST_DEPTH = (2.0, 8.0), (0.02, 0.2)  # smallest and largest of a grain
# Where so few empty pixels leave zero, they are drawn one by one instead of all.
RARE = 1e-3
EMPTY = 0.5  # electrons: less light than this is as none


@dataclass(frozen=True)
class SimulatedSensor:
    """A sensor; figures as of data sheets of pixels of 3.45 um."""

    full_electrons: float = 10_000.0  # that fill a pixel, and give the largest number
    read_electrons: float = 4.0  # standard deviation of the read noise
    dark_electrons: float = 2.0  # mean dark signal of an exposure of 1 s
    hot_share: float = 1e-5  # share of pixels with a large dark signal
    hot_electrons: float = 400.0  # their mean dark signal, likewise, exponentially distributed
    grains: int = 30  # of dust, on the whole sensor
    bits: int = 8  # 8 or 16 a channel; 16 without colour
    noise: float = 1.0  # factor of all noise; 0 for none

    @property
    def largest(self) -> int:
        """The largest number of a pixel."""
        return int(2**self.bits - 1)


@dataclass(frozen=True)
class PixelMaps:
    """Pattern that is fixed to the pixels (h, w) of one camera."""

    transmission: Signal  # of lens and dust, 0 to 1, (h, w)
    hot: Ints  # numbers of the hot pixels, counted row by row, (p,)
    hot_electrons: Floats  # of each, (p,)


def pixel_directions(camera: LensCamera) -> Floats:
    """Unit directions (h, w, 3) through all pixels."""
    return camera.directions(pixel_places(camera))


def pixel_places(camera: LensCamera) -> Floats:
    """Column and row of all pixels, (h, w, 2)."""
    row, column = np.mgrid[: camera.height_px, : camera.width_px]
    return np.stack([column, row], axis=-1).astype(np.float64)


def pixel_maps(
    camera: LensCamera, directions: Floats, sensor: SimulatedSensor, seed: int
) -> PixelMaps:
    """The maps of one simulated camera, with the directions (h, w, 3) of its pixels."""
    count = camera.width_px * camera.height_px
    random = generator(seed, HOT_STREAM)
    hot = np.sort(random.choice(count, round(sensor.hot_share * count), replace=False))
    electrons = sensor.hot_electrons * random.standard_exponential(len(hot))
    return PixelMaps(_transmission(camera, directions, sensor, seed), hot, electrons)


def _transmission(
    camera: LensCamera, directions: Floats, sensor: SimulatedSensor, seed: int
) -> Signal:
    share = vignetting(camera, directions).astype(np.float32)
    pixels = pixel_places(camera)
    random = generator(seed, DUST_STREAM)
    for _ in range(sensor.grains):
        place = random.uniform(0, 1, 2) * (camera.width_px, camera.height_px)
        radius, depth = random.uniform(*DUST_RADIUS_PX), random.uniform(*DUST_DEPTH)
        first = np.maximum(np.floor(place - 4 * radius).astype(int), 0)
        last = np.ceil(place + 4 * radius).astype(int)
        box = np.s_[first[1] : last[1], first[0] : last[0]]
        away = ((pixels[box] - place) ** 2).sum(axis=-1)
        share[box] *= 1 - depth * np.exp(-away / (2 * radius**2))
    return share


def generator(seed: int, *stream: int) -> np.random.Generator:
    """Random numbers of a stream, whatever else is drawn."""
    key = np.random.SeedSequence(seed, spawn_key=stream)
    return np.random.Generator(np.random.Philox(key))


def recorded(
    sensor: SimulatedSensor,
    maps: PixelMaps,
    light: Signal | None,
    random: np.random.Generator,
    seconds: float = 1.0,
) -> Image16:
    """The numbers of a photograph, (h, w, 3) of 8 bits or (h, w) of 16; more than full is clipped.

    Light, (h, w) or (h, w, 3), falls on the pixels before lens and dust, 1 fills one; None for
    darkness. The dark signal grows with the exposure time, s.
    """
    sensor = replace(sensor, dark_electrons=sensor.dark_electrons * seconds)
    shape = maps.transmission.shape
    colours = CHANNELS if sensor.bits == 8 else 1
    image = _empty(sensor, (maps.transmission.size, colours), random)
    pixels = None if light is None else light.reshape(maps.transmission.size, -1)
    faint = EMPTY / sensor.full_electrons
    shining: Bools = np.zeros(maps.transmission.size, dtype=bool)
    if pixels is not None:
        for colour in pixels.T:  # much quicker than any() of three
            shining |= colour > faint
    shining[maps.hot] = True
    bright = np.flatnonzero(shining)
    electrons = np.full((len(bright), colours), sensor.dark_electrons)
    electrons[np.searchsorted(bright, maps.hot)] += seconds * maps.hot_electrons[:, None]
    if pixels is not None:
        through = sensor.full_electrons * maps.transmission.ravel()[bright, None]
        shown = pixels[bright]
        electrons += through * (shown if colours == CHANNELS else shown.mean(axis=1, keepdims=True))
    image[bright] = _numbers(sensor, electrons, random)
    whole: Image16 = image.reshape(*shape, colours) if colours == CHANNELS else image.reshape(shape)
    return whole


def _numbers(
    sensor: SimulatedSensor, electrons: NDArray[np.floating], random: np.random.Generator
) -> Image16:
    """Numbers for mean numbers of electrons; shot noise as its normal limit."""
    spread = sensor.noise * np.sqrt(electrons + sensor.read_electrons**2)
    noise = random.standard_normal(electrons.shape, dtype=np.float32)
    share = (electrons + spread * noise) / sensor.full_electrons
    return _whole(sensor, share * sensor.largest)


def _whole(sensor: SimulatedSensor, numbers: NDArray[np.floating]) -> Image16:
    kind = np.uint8 if sensor.bits == 8 else np.uint16
    found: Image16 = np.clip(np.rint(numbers), 0, sensor.largest).astype(kind)
    return found


def _empty(sensor: SimulatedSensor, shape: tuple[int, int], random: np.random.Generator) -> Image16:
    """Numbers of pixels without light."""
    spread = sensor.noise * np.sqrt(sensor.dark_electrons + sensor.read_electrons**2)
    step = sensor.full_electrons / sensor.largest
    to_one = (step / 2 - sensor.dark_electrons) / spread if spread > 0 else np.inf
    share = float(norm.sf(to_one)) if sensor.dark_electrons < step / 2 else 1.0
    if share > RARE:
        return _numbers(sensor, np.full(shape, sensor.dark_electrons, dtype=np.float32), random)
    image = np.zeros(shape, dtype=np.uint8 if sensor.bits == 8 else np.uint16)
    count = random.binomial(image.size, share)
    where = random.integers(0, image.size, count)
    beyond = norm.isf(share * random.uniform(0, 1, count))
    image.flat[where] = _whole(sensor, (sensor.dark_electrons + spread * beyond) / step)
    return image

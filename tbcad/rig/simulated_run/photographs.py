"""The photographs of a simulated run, each by itself: the same whatever else is photographed."""

from dataclasses import dataclass, field
from functools import cached_property
from math import erf, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d, find_objects, label

from tbcad.common.compiled import compiled
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.pedestals.cells import NO_WALLS, GrooveWalls
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.capture.sensor import (
    Image16,
    PixelMaps,
    Signal,
    SimulatedSensor,
    generator,
    pixel_directions,
    pixel_maps,
    recorded,
)
from tbcad.light.simulate.parallel import chunks
from tbcad.light.simulate.prototype.ball_rays import ball_hits, camera_colours
from tbcad.light.simulate.prototype.run import HALF_TURN, turned_balls
from tbcad.light.simulate.scene.ray_casting import RAYS_PER_CHUNK, Scene
from tbcad.records.camera_sheet import RealOpticsRecord
from tbcad.records.run import DARK, DARK_LIT, LIT, Frame, PhaseTimes
from tbcad.rig.machine.designed import BuiltPrototype
from tbcad.rig.simulated_run.led_light import (
    DOME_MM,
    FAINT_PX2,
    Occluders,
    balls_of_frame,
    led_light,
)
from tbcad.rig.simulated_run.real_light import RealFrame
from tbcad.types import Bools, Colours, Floats, Ints

SIDE = 16  # pixels
ROUNDING = 1e-9  # radians
ALL = np.ones((3, 3))  # neighbours, across corners too


@dataclass(frozen=True)
class PixelBlocks:
    """Cones that hold all rays through the pixels of each block, (r, c)."""

    shape: tuple[int, int]  # of the picture, rows and columns
    middle: Floats  # unit vectors, (r, c, 3)
    half_angle: Floats  # radians, (r, c)

    def about(self, place: Floats, radius: Floats) -> Bools:
        """Blocks (r, c) of which a ray may meet one of some spheres, without a miss.

        Their places (k, 3) are from the pinhole, radii (k,) in the same unit.
        """
        distance = norm(place)
        width = np.arcsin(np.minimum(radius / distance, 1.0))
        width[radius >= distance] = np.pi
        found = np.zeros(self.half_angle.shape, dtype=bool)
        for way, half in zip(place / distance[:, None], width, strict=True):
            apart = 2 * np.arcsin(np.minimum(norm(self.middle - way) / 2, 1.0))
            found |= apart <= half + self.half_angle + ROUNDING
        return found

    def pixels(self, blocks: Bools) -> Ints:
        """Numbers of the pixels of some blocks (r, c), counted row by row, ascending, (n,)."""
        whole = blocks.repeat(SIDE, axis=0).repeat(SIDE, axis=1)
        return np.flatnonzero(whole[: self.shape[0], : self.shape[1]])


def pixel_blocks(directions: Floats) -> PixelBlocks:
    """The blocks of a picture whose pixels have unit directions (h, w, 3)."""
    height, width = shape = directions.shape[:2]
    first = np.arange(0, height, SIDE), np.arange(0, width, SIDE)
    last = (np.minimum(begin + SIDE, size) for begin, size in zip(first, shape, strict=True))
    near = [(begin + end - 1) // 2 for begin, end in zip(first, last, strict=True)]
    middle = unit(directions[np.ix_(*near)])
    spread = middle.repeat(SIDE, axis=0)[:height].repeat(SIDE, axis=1)[:, :width]
    chord = norm(directions - spread)
    farthest = np.maximum.reduceat(np.maximum.reduceat(chord, first[0], axis=0), first[1], axis=1)
    return PixelBlocks((height, width), middle, 2 * np.arcsin(farthest / 2))


def boxes_about(picture: NDArray[np.floating], reach: int) -> list[tuple[slice, slice]]:
    """Boxes that hold all that is not zero in a picture (h, w, c), and `reach` pixels about it.

    Boxes may overlap, but what is not zero in one block or in neighbours is in one box.
    """
    height, width, channels = picture.shape
    rows = np.logical_or.reduceat(picture != 0, np.arange(0, height, SIDE), axis=0)
    columns = np.arange(0, width * channels, SIDE * channels)
    groups, _ = label(np.logical_or.reduceat(rows.reshape(len(rows), -1), columns, axis=1), ALL)
    boxes = find_objects(groups)
    return [(_pixels(rows, reach), _pixels(columns, reach)) for rows, columns in boxes]


def _pixels(blocks: slice, reach: int) -> slice:
    return slice(max(SIDE * blocks.start - reach, 0), SIDE * blocks.stop + reach)


EXPOSURE_S = 1.0  # in which LEDs and object give the light that follows
LED_LIGHT = 0.9  # of a full pixel: brightness of an LED's image on the optical axis
OBJECT_LIGHT = 0.9  # likewise: of white, where the object is lit best
NOISE_STREAM = 4000
WHITE = 255.0
REACH = 4.0  # standard deviations beyond which a point gives no light


@dataclass(frozen=True)
class PointSpread:
    """Spread of a point's light, the same along rows and columns."""

    separation_px: float = 1.0  # of the low-pass filter's images
    lens_px: float = 0.4  # standard deviation of the lens's spread

    @property
    def half_px(self) -> int:
        """Pixels that a point's light reaches on each side."""
        return int(np.ceil(REACH * self.lens_px + self.separation_px / 2 + 0.5))


@dataclass(frozen=True)
class ImagingChain:
    """From light to numbers."""

    sensor: SimulatedSensor = field(default_factory=SimulatedSensor)  # of the camera
    spread: PointSpread = field(default_factory=PointSpread)  # of a point's light
    dome: float = DOME_MM  # radius of the LEDs' domes, mm
    # of each LED, on the optical axis, 1 fills a pixel in an exposure of `EXPOSURE_S`; one for all,
    # or (l,)
    led_light: float | tuple[float, ...] = LED_LIGHT
    object_light: float = OBJECT_LIGHT  # of the lit object where it is white, likewise
    # of exposure; `EXPOSURE_S` where they are not said
    times: PhaseTimes = field(default_factory=PhaseTimes)
    # lens and mirrors, in place of the spread; None: a pinhole before it. Noise is the sensor's
    real: RealOptics | None = None
    told: RealOpticsRecord | None = None  # what a record says of it

    def exposure(self, phase: str) -> float:
        """Exposure time of a phase over `EXPOSURE_S`."""
        return (self.times.of(phase) or EXPOSURE_S) / EXPOSURE_S


@dataclass(frozen=True)
class SimulatedRun:
    """A prototype that is photographed."""

    built: BuiltPrototype  # the prototype
    frames: tuple[Frame, ...]  # in the order of the machine's
    scene: Scene  # the lit object
    occluders: Occluders  # what may hide LEDs
    chain: ImagingChain  # from light to numbers
    seed: int  # of noise, dust and hot pixels

    @cached_property
    def maps(self) -> PixelMaps:
        """Pattern that is fixed to the pixels."""
        return pixel_maps(self.built.machine.camera, self.directions, self.chain.sensor, self.seed)

    @cached_property
    def directions(self) -> Floats:
        """Unit directions through the pixels, (h, w, 3)."""
        return pixel_directions(self.built.machine.camera)

    @cached_property
    def blocks(self) -> PixelBlocks:
        """Blocks of its pixels."""
        return pixel_blocks(self.directions)

    def frame_photographs(self, number: int, phases: tuple[str, ...]) -> dict[str, Image16]:
        """The photographs of a frame, from 0, in some phases."""
        frame = self.frames[number]
        light: dict[str, Signal | None] = {DARK: None, DARK_LIT: None}
        real = self._real(number)
        if LIT in phases:
            light[LIT] = self._object(number) if real is None else self._real_object(real)
        if set(phases) - {LIT, *light}:
            light.update(self._leds(number, real))
        return {phase: self._recorded(frame, phase, light[phase]) for phase in phases}

    def _recorded(self, frame: Frame, phase: str, light: Signal | None) -> Image16:
        # Two more than an LED's own number: those before it are of the other phases.
        kind = {DARK: 0, LIT: 1, DARK_LIT: 2}
        number = kind[phase] if phase in kind else 2 + int(phase.removeprefix("led_"))
        stream = (NOISE_STREAM, frame.object_turn_deg, frame.stop, number)
        random, exposure = generator(self.seed, *stream), self.chain.exposure(phase)
        return recorded(self.chain.sensor, self.maps, light, random, exposure)

    def _real(self, number: int) -> RealFrame | None:
        optics, turned = self.chain.real, self._turned(number)
        if optics is None:
            return None
        return RealFrame(self.built, number, turned, self.directions, optics)

    def _real_object(self, real: RealFrame) -> Signal:
        brightness = self.chain.object_light * self.chain.exposure(LIT)
        return real.object_light(self.scene) * np.float32(brightness / WHITE)

    def _object(self, number: int) -> Signal:
        pinhole = self.built.machine.camera.pinhole
        balls, turned = balls_of_frame(self.built, number), self._turned(number)
        walls = self.built.walls
        colour = object_light(
            pinhole, self.directions, balls, self.scene, turned, walls, self.blocks
        )
        brightness = self.chain.object_light * self.chain.exposure(LIT)
        share = colour.astype(np.float32) * np.float32(brightness / WHITE)
        return blurred(share, self.chain.spread)

    def _leds(self, number: int, real: RealFrame | None) -> dict[str, Signal]:
        camera = self.built.machine.camera
        leds = len(self.built.machine.leds)
        times = np.array([self.chain.exposure(f"led_{led + 1}") for led in range(leds)])
        light = np.broadcast_to(self.chain.led_light, leds) * times
        faint = FAINT_PX2 / max(1.0, float(light.max(initial=0.0)))
        turned, chain = self._turned(number), self.chain
        if real is not None:
            images = real.led_images(self.occluders, chain.dome, light, faint)
            return {f"led_{led}": image for led, image in enumerate(images, 1)}
        points = led_light(self.built, number, turned, self.occluders, chain.dome, faint)
        found: dict[str, Signal] = {}
        for led, brightness in enumerate(light.tolist()):
            image = np.zeros((camera.height_px, camera.width_px), dtype=np.float32)
            pixel, area = points.of(led)
            add_points(image, pixel, brightness * area, self.chain.spread)
            found[f"led_{led + 1}"] = image
        return found

    def _turned(self, number: int) -> bool:
        return self.frames[number].object_turn_deg != 0


def phases_of(leds: int) -> tuple[str, ...]:
    """All phases at a stop, in the order of photographing."""
    return (DARK, *(f"led_{led}" for led in range(1, leds + 1)), LIT)


def object_light(
    pinhole: Floats,
    directions: Floats,
    balls: Floats,
    scene: Scene,
    turned: bool,
    walls: GrooveWalls = NO_WALLS,
    blocks: PixelBlocks | None = None,
) -> Colours:
    """Picture of a lit object by a camera, 0 to 255, (h, w, 3).

    Its pixels have directions (h, w, 3), and blocks; balls are (k, 8) in the frame, or with forms
    behind these columns. The scene is the object as it stands in the first run; it may be turned by
    180 degrees.
    """
    blocks = blocks or pixel_blocks(directions)
    # A front ends within the sphere in its seat; nothing else is seen but the object itself.
    place = np.concatenate([balls[:, 4:7], np.zeros((1, 3))]) - pinhole
    pixels = blocks.pixels(blocks.about(place, np.append(balls[:, 7], scene.radius)))
    # Seen from the object, which rests, camera and balls are turned instead.
    flip = HALF_TURN if turned else np.ones(3)
    pinhole, walls = pinhole * flip, walls.flipped(flip)
    balls, every = turned_balls(balls, flip), directions.reshape(-1, 3)
    picture = np.zeros(directions.shape, dtype=np.float32)
    for part in chunks(len(pixels), RAYS_PER_CHUNK):
        own = pixels[part]
        picture.reshape(-1, 3)[own] = _colours(pinhole, balls, walls, scene, every[own] * flip)
    return picture


def _colours(
    pinhole: Floats, balls: Floats, walls: GrooveWalls, scene: Scene, direction: Floats
) -> Colours:
    stop = np.zeros(len(direction), dtype=np.int64)
    hits = ball_hits(pinhole, balls[None], direction, stop, walls)
    return camera_colours(scene, pinhole, direction, hits)


def add_points(image: NDArray[np.float32], pixel: Floats, light: Floats, psf: PointSpread) -> None:
    """Add the light (n,) of points at columns and rows (n, 2) to an image (h, w).

    A pixel takes what falls on its area: the integral of the spread over it.
    """
    _add_points(image, pixel, light, psf.separation_px, psf.lens_px, psf.half_px)


def blurred(picture: NDArray[np.float32], psf: PointSpread) -> NDArray[np.float32]:
    """A picture (h, w, c), of one ray a pixel, behind filter and lens."""
    half = psf.half_px
    line = np.zeros((1, 2 * half + 1), dtype=np.float32)
    centre = np.array([[half, 0.0]])
    # The middle row of a point's image is its spread along the row; its sum is made one.
    _add_points(line, centre, np.ones(1), psf.separation_px, psf.lens_px, half)
    kernel = (line[0] / line.sum()).astype(np.float32)
    found = np.zeros_like(picture)
    for box in boxes_about(picture, half):
        across = convolve1d(picture[box], kernel, axis=1, mode="constant")
        # Where another box has more, light from beyond this one is missing here.
        found[box] = np.maximum(found[box], convolve1d(across, kernel, axis=0, mode="constant"))
    return found


@compiled
def _add_points(
    image: NDArray[np.float32],
    pixel: Floats,
    light: Floats,
    separation: float,
    lens: float,
    half: int,
) -> None:
    height, width = image.shape
    size = 2 * half + 2
    share = np.empty((2, size))
    for i in range(len(pixel)):
        first = np.empty(2, dtype=np.int64)
        for axis in range(2):
            first[axis] = int(np.floor(pixel[i, axis])) - half
            for k in range(size):
                share[axis, k] = 0.0
                for side in (-0.5, 0.5):
                    place = pixel[i, axis] + side * separation
                    near = (first[axis] + k - 0.5 - place) / lens
                    far = (first[axis] + k + 0.5 - place) / lens
                    share[axis, k] += 0.25 * (erf(far / sqrt(2.0)) - erf(near / sqrt(2.0)))
        for b in range(size):
            y = first[1] + b
            if 0 <= y < height:
                for a in range(size):
                    x = first[0] + a
                    if 0 <= x < width:
                        image[y, x] += light[i] * share[0, a] * share[1, b]

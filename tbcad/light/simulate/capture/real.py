"""A photograph as a real camera takes it: its lens, what mirrors scatter, and the sensor's noise.

Each of a pixel's rays goes through a point of its own of the pupil, off the exact mirrors: defocus
and astigmatism of the virtual images, and pixels that show two mirrors, are those of the rays.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import Camera, vignetting, without_distortion
from tbcad.core.optics.lens import (
    FINE,
    KERNEL_PX,
    RAY_SHARE,
    PupilLens,
    kernel_factors,
    pixel_kernel,
    pixels_of_samples,
    pupil_points,
)
from tbcad.core.optics.reflection import scattered_shares
from tbcad.light.simulate.capture.photograph import CENTRE, RowBand, Tracer, row_bands, to_bytes
from tbcad.light.simulate.capture.sensor import (
    PixelMaps,
    Signal,
    SimulatedSensor,
    generator,
    recorded,
)
from tbcad.light.simulate.parallel import in_batches
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays, object_in_front
from tbcad.light.simulate.scene.rays import (
    MirrorNumbers,
    PupilPoint,
    Shift,
    TracedRays,
    exact_tracer,
    unit_directions,
)
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Bools, Bytes, Colours, Floats, Ints, Progress

WHITE, WHITE_SHARE = 255.0, 0.9  # of a full pixel on the optical axis: white by its mirrors
HALO_PX = 25  # width over which light of the Airy pattern beyond the kernel is spread
NOISE_STREAM = 5000


@dataclass(frozen=True)
class RealOptics:
    """What stands between the object and the numbers of a photograph."""

    lens: PupilLens
    reflectance: float  # of the mirrors
    roughness_nm: Floats  # their RMS roughness Rq, of all mirrors (1,), or of each ball (k,)
    sensor: SimulatedSensor = field(default_factory=SimulatedSensor)
    ray_share: float = RAY_SHARE  # of the pupil's diameter that rays go through
    fine: int = FINE  # rays of a pixel along its sides
    seed: int = 0  # of the noise
    filter_px: float = 0.0  # separation of the four images of a low-pass filter; 0: none

    def kernel(self, camera: Camera) -> Floats:
        """Shares of fine samples in a pixel of a camera, as of `pixel_kernel`."""
        cutoff = self.lens.cutoff(camera.pixel_pitch)
        return pixel_kernel(cutoff, self.fine, filter_px=self.filter_px)


@dataclass(frozen=True)
class LensSample:
    """One of the rays of each pixel."""

    row: int  # among the fine samples of a pixel
    column: int
    shift: Shift  # its place from the pixel's centre, pixels
    point: PupilPoint  # that it goes through

    def own(self, samples: Signal, fine: int) -> Signal:
        """Its samples among those of `no_samples`, one of each pixel, (h, w, 3), to be filled."""
        edge = KERNEL_PX * fine
        return samples[self.row :: fine, edge + self.column : samples.shape[1] - edge : fine]


def no_samples(rows: int, columns: int, fine: int) -> Signal:
    """Fine samples of pixels, black, with the reach of the kernel beside each row."""
    return np.zeros((fine * rows, fine * (columns + 2 * KERNEL_PX), 3), dtype=np.float32)


def lens_samples(axes: Floats, optics: RealOptics, margin_px: int = 0) -> list[LensSample]:
    """The rays of each pixel of a camera with axes (3, 3), over its fine samples and its pupil."""
    lens, count = optics.lens, optics.fine
    aside = optics.ray_share * lens.pupil_mm / 2 * pupil_points(count) @ axes[:2]
    places = ((np.arange(count) + 0.5) / count - 0.5).tolist()
    return [
        LensSample(
            row,
            column,
            (places[column], places[row]),
            PupilPoint(aside[row, column], lens.focus_mm, margin_px),
        )
        for row, column in np.ndindex(count, count)
    ]


def mirror_rays(reflector: Reflector, optics: RealOptics) -> list[tuple[LensSample, Tracer]]:
    """The rays of each pixel, each with what traces it off a camera's mirrors."""
    camera = reflector.camera
    nearest = ((reflector.mirrors.apex - camera.pinhole) @ camera.forward).min()
    blur = float(optics.lens.blur_px(nearest, camera.pixel_pitch))
    samples = lens_samples(camera.axes, optics, 1 + int(np.ceil(blur / 2)))
    return [(one, exact_tracer(reflector, one.point)) for one in samples]


def real_photograph(
    reflector: Reflector, scene: Scene, optics: RealOptics, progress: Progress = lambda _: None
) -> Iterator[RowBand]:
    """The bands of a camera's picture from top to bottom; their rays go through the pinhole.

    The picture is developed: a matt white surface in the best light is 255 by the mirrors.
    """
    camera, bands = reflector.camera, row_bands(reflector.camera.height_px)
    work = partial(
        _band, camera, exact_tracer(reflector), mirror_rays(reflector, optics), scene, optics
    )
    told = in_batches(work, bands, lambda rows: progress(f"row {rows.start} of {camera.height_px}"))
    rays, light = zip(*told, strict=True)
    whole = with_halo(np.concatenate(light), optics.kernel(camera))
    mirror = np.concatenate([number for number, *_ in rays])
    whole = with_scatter(whole, mirror, mirror_scatter(reflector, optics)[mirror])
    fall = vignetting(without_distortion(camera), unit_directions(camera, range(camera.height_px)))
    picture = developed(whole, fall, optics, ord(reflector.camera_id))
    for rows, own in zip(bands, rays, strict=True):
        yield RowBand(rows, TracedRays(*own), picture[rows.start : rows.stop])


def _band(
    camera: Camera,
    centre: Tracer,
    through: list[tuple[LensSample, Tracer]],
    scene: Scene,
    optics: RealOptics,
    rows: range,
) -> tuple[tuple[MirrorNumbers, Any, Any], Signal]:
    """Rays through the pinhole, in the file's precision, and light of pixels (h, w, 3)."""
    n = optics.fine
    rays = centre(rows, CENTRE)
    front, _ = _in_front(scene, camera.pinhole, unit_directions(camera, rows), rays)
    rays = rays.without(front)
    wide = range(rows.start - KERNEL_PX, rows.stop + KERNEL_PX)
    samples = no_samples(len(wide), camera.width_px, n)
    for one, trace in through:
        one.own(samples, n)[:] = _seen(
            camera, one, trace(wide, one.shift), scene, (optics.reflectance, wide)
        )
    light = pixels_of_samples(samples, kernel_factors(optics.kernel(camera)), n)
    places = rays.origin.astype(np.float32), rays.direction.astype(np.float32)
    return (rays.mirror, *places), light


def _seen(
    camera: Camera,
    one: LensSample,
    rays: TracedRays,
    scene: Scene,
    bright: tuple[float, range],
) -> Colours:
    """What a ray of each pixel of some rows sees, (h, w, 3); without mirrors it is brighter."""
    reflectance, rows = bright
    colour = cast_rays(scene, rays.origin.reshape(-1, 3), rays.direction.reshape(-1, 3)).colour
    direction = one.point.directions(camera, rows, one.shift)
    front, direct = _in_front(scene, camera.pinhole + one.point.aside, direction, rays)
    colour = colour.reshape(direction.shape)
    colour[front] = direct.reshape(direction.shape)[front] / np.float32(reflectance)
    return colour


def _in_front(
    scene: Scene, start: Floats, direction: Floats, rays: TracedRays
) -> tuple[Bools, Colours]:
    """Where (h, w) the object hides the mirrors, and its colours there, (h w, 3)."""
    distance = np.where(rays.mirror == 0, np.inf, norm(rays.origin - start))
    front, direct = object_in_front(scene, start, direction.reshape(-1, 3), distance.ravel())
    return front.reshape(rays.mirror.shape), direct


def with_halo(light: Signal, kernel: Floats) -> Signal:
    """Light (h, w, c) with what of the Airy pattern is beyond the kernel, spread evenly."""
    size = (HALO_PX, HALO_PX, 1)
    return light + np.float32(1 - kernel.sum()) * uniform_filter(light, size, mode="constant")


def mirror_scatter(reflector: Reflector, optics: RealOptics) -> Floats:
    """Share (1 + m,) of what mirrors reflect that they scatter, by number; 0 of no mirror."""
    sight = unit(reflector.camera.pinhole - reflector.mirrors.apex)
    cosine = dot(sight, reflector.mirrors.normal)
    return np.append(0.0, scattered_shares(optics.roughness_nm * cosine))


def with_scatter(light: Signal, mirror: Ints, share: Floats) -> Signal:
    """Light (..., c) of mirrors (...), from 1, of which each pixel's share (...) is scattered.

    A veil: each mirror scatters alike over all that it shows.
    """
    number, flat = mirror.ravel(), light.reshape(-1, light.shape[-1])
    area = np.maximum(np.bincount(number), 1)
    mean = np.column_stack([np.bincount(number, one) / area for one in flat.T])
    lost = share.astype(np.float32).reshape(-1, 1)
    return (flat + lost * (mean.astype(np.float32)[number] - flat)).reshape(light.shape)


def developed(light: Signal, fall: Floats, optics: RealOptics, *stream: int) -> Bytes:
    """The picture (..., 3) of light: counted by the sensor, without the lens's own fall of light.

    Noise and steps grow where that, a share (...), is corrected. Without dust and hot pixels.
    """
    maps = PixelMaps(fall.astype(np.float32), np.zeros(0, dtype=np.int64), np.zeros(0))
    sensor = replace(optics.sensor, dark_electrons=0.0)
    random = generator(optics.seed, NOISE_STREAM, *stream)
    share = np.maximum(light, 0) * np.float32(WHITE_SHARE / WHITE)
    numbers = recorded(sensor, maps, share, random)
    gain = np.float32(WHITE / WHITE_SHARE / sensor.largest) / maps.transmission
    return to_bytes(numbers * gain[..., None])

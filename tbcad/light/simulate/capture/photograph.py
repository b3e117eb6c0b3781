"""A camera's photograph through its mirrors, in bands of rows; how many pixels each mirror has."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.camera import Camera, fitted_camera
from tbcad.errors import InputError
from tbcad.light.simulate.parallel import chunks, in_batches
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays, object_in_front
from tbcad.light.simulate.scene.rays import Shift, TracedRays, exact_tracer, unit_directions
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Bytes, Colours, Floats, Progress

Tracer = Callable[[range, Shift], TracedRays]
Samples = int | tuple[Shift, ...]
"""Rays whose mean is a pixel: k x k over its area, or these places from its centre, pixels."""

BAND_ROWS = 64  # also the height of a chunk of the light field's file
CENTRE: Shift = (0.0, 0.0)
# Beyond this, one ray represents a block of pixels: the largest sensor of Table II, 8320 x 6208,
# counted with 2080 x 1552 rays differs from all its pixels by less than 5e-5 of the count.
MAX_RAYS = 4_000_000
LEAST_SIDE, LARGEST_SIDE = 16, 32_768


@dataclass(frozen=True)
class RowBand:
    """Rows of a photograph."""

    rows: range  # which, from the top
    rays: TracedRays  # through the pixels' centres; none where the object itself is in front
    colour: Bytes  # red, green, blue, (h, w, 3)


CameraPhotographs = list[tuple[Reflector, Callable[[], Iterable[RowBand]]]]
"""Cameras, each with what takes its photograph."""


def photograph(
    view: Camera,
    trace: Tracer,
    scene: Scene,
    samples: Samples = 1,
    progress: Progress = lambda _: None,
) -> Iterator[RowBand]:
    """The bands of a camera's picture from top to bottom; few are in memory at a time.

    `trace` gives the rays of rows after the mirrors; a pixel is the mean of `samples`.
    """
    height = view.height_px
    work = partial(_band, view, trace, scene, samples)
    return in_batches(
        work, row_bands(height), lambda rows: progress(f"row {rows.start} of {height}")
    )


def row_bands(height: int) -> list[range]:
    """Rows of a picture in bands, which are worked on one by one."""
    return [range(part.start, part.stop) for part in chunks(height, BAND_ROWS)]


def to_bytes(colours: NDArray[np.floating]) -> Bytes:
    """Colours 0 to 255 as whole numbers; brighter ones are 255."""
    return np.asarray(np.rint(np.minimum(colours, 255)), dtype=np.uint8)


def _band(view: Camera, trace: Tracer, scene: Scene, samples: Samples, rows: range) -> RowBand:
    rays, colour = _through(view, trace, scene, rows, CENTRE)
    shifts = sample_shifts(samples)
    if shifts != [CENTRE]:
        colours = (_through(view, trace, scene, rows, shift)[1] for shift in shifts)
        colour = sum(colours, np.zeros_like(colour)) / np.float32(len(shifts))
    return RowBand(rows, rays, to_bytes(colour))


def sample_shifts(samples: Samples) -> list[Shift]:
    """Places of a pixel's rays, from its centre."""
    return subpixel_shifts(samples) if isinstance(samples, int) else list(samples)


def subpixel_shifts(samples: int) -> list[Shift]:
    """Places of samples x samples rays in a pixel, from its centre."""
    places = ((np.arange(samples) + 0.5) / samples - 0.5).tolist()
    return [(x, y) for y in places for x in places]


def _through(
    view: Camera, trace: Tracer, scene: Scene, rows: range, shift: Shift
) -> tuple[TracedRays, Colours]:
    """Rays after the mirrors, and what they see; the object may hide mirrors from the camera."""
    rays = trace(rows, shift)
    return seen_by(view, rays, unit_directions(view, rows, shift), scene)


def seen_by(
    view: Camera, rays: TracedRays, direction: Floats, scene: Scene
) -> tuple[TracedRays, Colours]:
    """What rays after the mirrors see, (h, w, 3), and those that the object itself does not hide.

    `direction`: unit vectors from the camera through the pixels, (h, w, 3).
    """
    hits = cast_rays(scene, rays.origin.reshape(-1, 3), rays.direction.reshape(-1, 3))
    colour = hits.colour.reshape(*rays.mirror.shape, 3)
    distance = np.where(rays.mirror == 0, np.inf, norm(rays.origin - view.pinhole))
    flat = direction.reshape(-1, 3)
    front, direct = object_in_front(scene, view.pinhole, flat, distance.ravel())
    colour.reshape(-1, 3)[front] = direct[front]
    return rays.without(front.reshape(rays.mirror.shape)), colour


@dataclass(frozen=True)
class Sensor:
    """Columns and rows of a sensor with square pixels."""

    width_px: int
    height_px: int

    def __str__(self) -> str:
        return f"{self.width_px}x{self.height_px}"


@dataclass(frozen=True)
class PixelCounts:
    """Pixels of one camera's picture, over its m mirrors."""

    on: Floats  # pixels whose ray meets the mirror, (m,)
    seen: Floats  # those whose ray then meets the capture sphere, (m,)
    # those that also lie in the largest cone about the apex, as the pinhole sees it, that fits in
    # the flat mirror (theta_0, Fig. 3 of the paper), (m,).
    disc: Floats
    fill: float  # how far the mirrors fill the frame; beyond 1 some lie outside it
    rays: int  # number of rays that were traced


def parse_sensor(text: str) -> Sensor:
    """A sensor from text like 2080x1552.

    InputError: it is none, or sides are not from 16 to 32768.
    """
    width, _, height = text.lower().partition("x")
    if width.isdecimal() and height.isdecimal() and len(text) < 20:
        sides = int(width), int(height)
        if allowed(*sides):
            return Sensor(*sides)
    raise InputError(
        f"sensor {text!r}: allowed is columns x rows, each from {LEAST_SIDE} to {LARGEST_SIDE}: "
        "write for instance 2080x1552"
    )


def allowed(width_px: int, height_px: int) -> bool:
    """Whether a sensor may have these sides."""
    return all(LEAST_SIDE <= side <= LARGEST_SIDE for side in (width_px, height_px))


def count_pixels(
    array: MirrorArray,
    sensor: Sensor,
    radius: float,
    most_rays: int = MAX_RAYS,
    axes: tuple[Floats, Floats] | None = None,
) -> PixelCounts:
    """Count the pixels of a camera with a sensor, the lens and mirrors as they are.

    With the sensor in place of the design's the camera is turned so that the mirrors fit it best,
    or has `axes`: forward and right, (3,) each. `radius`: of the capture sphere, mm. Sensors beyond
    `most_rays` are sampled by one ray for each square block of pixels.
    """
    camera, corners = array.camera, array.cells.corners
    step = math.ceil(math.sqrt(sensor.width_px * sensor.height_px / most_rays))
    width, height = -(-sensor.width_px // step), -(-sensor.height_px // step)
    if axes is None:
        sides = sensor.width_px, sensor.height_px
        full = fitted_camera(camera.pinhole, corners, *sides, camera.hfov)
    else:
        full = Camera(camera.pinhole, *axes, sensor.width_px, sensor.height_px, camera.hfov)
    sampled = replace(full, width_px=width, height_px=height)
    reflector = Reflector(array.camera_id, sampled, array.u, array.cells)
    scale = (sensor.width_px / width) ** 2
    on, seen, disc = (scale * one for one in traced_pixels(reflector, array.theta0, radius))
    return PixelCounts(on, seen, disc, full.fill(corners), width * height)


def traced_pixels(
    reflector: Reflector, theta0: Floats, radius: float
) -> tuple[Floats, Floats, Floats]:
    """Rays on each mirror, those that go on to the capture sphere, those in its cone, each (m,).

    `theta0` (m,): half angles of the cones about the apices, radians; `radius`: of the sphere, mm.
    """
    trace, m = exact_tracer(reflector), len(reflector)
    pinhole, cosine = reflector.camera.pinhole, np.cos(theta0)
    axis = unit(reflector.mirrors.apex - pinhole)
    counts = np.zeros((3, m))
    for rows in row_bands(reflector.camera.height_px):
        rays = trace(rows, CENTRE)
        seeing = rays.meeting(radius)
        mirror = rays.mirror[seeing] - 1
        in_cone = dot(unit(rays.origin[seeing] - pinhole), axis[mirror]) >= cosine[mirror]
        for k, numbers in enumerate((rays.mirror[rays.mirror > 0] - 1, mirror, mirror[in_cone])):
            counts[k] += np.bincount(numbers, minlength=m)
    return counts[0], counts[1], counts[2]


def virtual_cameras(array: MirrorArray) -> int:
    """Virtual cameras of both halves together; those that the seam halves count once."""
    return 2 * len(array) - int((array.u[:, 0] == 0).sum())


def virtual_camera_pixels(array: MirrorArray, radius: float) -> Floats:
    """Pixels that see a capture sphere, over the v virtual cameras of both halves, (v,).

    The array is camera a's; both halves of a mirror on the seam count together.
    """
    sensor = Sensor(array.camera.width_px, array.camera.height_px)
    seen, halved = count_pixels(array, sensor, radius).seen, array.u[:, 0] == 0
    return np.concatenate([np.where(halved, 2 * seen, seen), seen[~halved]])

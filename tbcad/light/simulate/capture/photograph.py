"""A camera's photograph through its mirrors, band after band of pixel rows."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.parallel import chunks, in_batches
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays, object_in_front
from tbcad.light.simulate.scene.rays import Shift, TracedRays, unit_directions
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Bytes, Colours, Floats, Progress

Tracer = Callable[[range, Shift], TracedRays]
Samples = int | tuple[Shift, ...]
"""Rays whose mean is a pixel: k x k over its area, or these places from its centre, pixels."""

BAND_ROWS = 64  # also the height of a chunk of the light field's file
CENTRE: Shift = (0.0, 0.0)


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

"""Pixels of a prototype's photographs as a real camera takes them, off its balls.

As tbcad.light.simulate.capture.real does it off a shell's mirrors, for those pixels of a stop that
are asked for.
"""

import numpy as np
from scipy.ndimage import maximum_filter

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.camera import vignetting
from tbcad.core.optics.lens import KERNEL_PX, kernel_factors, pixels_of_samples
from tbcad.core.optics.reflection import scattered_shares
from tbcad.light.simulate.capture.photograph import row_bands
from tbcad.light.simulate.capture.real import (
    LensSample,
    RealOptics,
    developed,
    lens_samples,
    no_samples,
    with_scatter,
)
from tbcad.light.simulate.capture.sensor import Signal
from tbcad.light.simulate.prototype.ball_rays import ball_hits, camera_colours, trace_balls
from tbcad.light.simulate.prototype.run import PrototypeRun
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

REACH = 2 * KERNEL_PX + 1


def real_pixels(
    run: PrototypeRun, scene: Scene, stop: int, optics: RealOptics, pixels: Ints
) -> Bytes:
    """Pixels (n,) of the photograph of a stop, counted row by row, (n, 3).

    The veil of each ball is the mean of those of its pixels that are asked for; what of the Airy
    pattern is beyond the kernel adds to it.
    """
    camera = run.camera
    kept = optics.kernel(run.reflector.camera).sum()
    light = _light(run, scene, stop, optics, pixels) / np.float32(kept)
    row, column = np.divmod(pixels, camera.width_px)
    direction = camera.directions(np.column_stack([column, row]).astype(np.float64))
    hits = trace_balls(run, direction, np.full(len(pixels), stop))
    cosine = norm(hits.direction - direction) / 2  # of incidence: the normal bisects both
    rough = np.append(0.0, optics.roughness_nm)[hits.ball] * cosine
    light = with_scatter(light, hits.ball, scattered_shares(rough) + 1 - kept)
    half = ord(run.reflector.camera_id)
    return developed(light, vignetting(camera, direction), optics, half, stop)


def _light(run: PrototypeRun, scene: Scene, stop: int, optics: RealOptics, pixels: Ints) -> Signal:
    """Light (n, 3) of pixels (n,) behind the lens, band by band."""
    camera = run.camera
    asked = np.zeros((camera.height_px + 2 * KERNEL_PX, camera.width_px), dtype=bool)
    asked[KERNEL_PX : KERNEL_PX + camera.height_px].flat[pixels] = True
    factors = kernel_factors(optics.kernel(run.reflector.camera))
    found = np.zeros((len(pixels), 3), dtype=np.float32)
    for rows in row_bands(camera.height_px):
        first, last = np.searchsorted(pixels, camera.width_px * np.array([rows.start, rows.stop]))
        if first < last:
            near = asked[rows.start : rows.stop + 2 * KERNEL_PX]
            samples = _samples(run, scene, stop, optics, (rows, maximum_filter(near, REACH)))
            whole = pixels_of_samples(samples, factors, optics.fine).reshape(-1, 3)
            found[first:last] = whole[pixels[first:last] - rows.start * camera.width_px]
    return found


def _samples(
    run: PrototypeRun,
    scene: Scene,
    stop: int,
    optics: RealOptics,
    part: tuple[range, Bools],
) -> Signal:
    """Fine samples of rows, with the reach of the kernel round them; 0 where none is needed."""
    rows, needed = part
    samples = no_samples(len(needed), needed.shape[1], optics.fine)
    row, column = np.nonzero(needed)
    centres = np.column_stack([column, row + rows.start - KERNEL_PX]).astype(np.float64)
    for one in lens_samples(run.camera.axes, optics):
        own = one.own(samples, optics.fine)
        own[row, column] = _seen(run, scene, stop, optics.reflectance, (one, centres))
    return samples


def _seen(
    run: PrototypeRun,
    scene: Scene,
    stop: int,
    reflectance: float,
    ray: tuple[LensSample, Floats],
) -> Colours:
    """What a ray of each of n pixels sees, (n, 3); without balls it is brighter."""
    one, centres = ray
    camera, aside = run.camera, one.point.aside
    straight = camera.directions(centres + one.shift)
    depth = one.point.focus / (straight @ camera.axes[2])
    direction = unit(depth[:, None] * straight - aside)
    start = camera.pinhole + aside
    hits = ball_hits(start, run.balls, direction, np.full(len(centres), stop))
    colour = camera_colours(scene, start, direction, hits)
    colour[hits.ball == 0] /= np.float32(reflectance)
    return colour

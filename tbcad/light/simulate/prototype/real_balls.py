"""Pixels of a prototype's photographs as a real camera takes them, off its balls.

As tbcad.light.simulate.capture.real does it off a shell's mirrors, for those pixels of a stop that
are asked for.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.camera import Camera, LensCamera, vignetting
from tbcad.core.optics.lens import KERNEL_PX, kernel_factors, pixels_of_samples
from tbcad.core.optics.pedestals.cells import NO_WALLS, GrooveWalls
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
from tbcad.light.simulate.prototype.ball_rays import BallHits, ball_hits, camera_colours
from tbcad.light.simulate.prototype.run import PrototypeRun
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

REACH = 2 * KERNEL_PX + 1


@dataclass(frozen=True)
class BallView:
    """A camera before balls that rest."""

    camera: LensCamera  # its distortion is of `directions` alone
    balls: Floats  # as of PrototypeRun, (k, 8)
    directions: Callable[[Floats], Floats]  # unit ones (n, 3) through columns and rows (n, 2)
    walls: GrooveWalls = NO_WALLS

    @property
    def pinhole_camera(self) -> Camera:
        """The camera without distortion, its axis in the middle."""
        one = self.camera
        hfov = 2 * np.arctan(one.width_px / one.focal.mean() / 2)
        ahead, right = one.axes[2], one.axes[0]
        return Camera(one.pinhole, ahead, right, one.width_px, one.height_px, float(hfov))

    def centres(self, pixels: Ints) -> Floats:
        """Columns and rows (n, 2) of pixels (n,), counted row by row."""
        row, column = np.divmod(pixels, self.camera.width_px)
        return np.column_stack([column, row]).astype(np.float64)

    def hits(self, start: Floats, direction: Floats) -> BallHits:
        """What unit directions (n, 3) from one place (3,) meet."""
        none = np.zeros(len(direction), dtype=np.int64)
        return ball_hits(start, self.balls[None], direction, none, self.walls)


def real_pixels(
    run: PrototypeRun, scene: Scene, stop: int, optics: RealOptics, pixels: Ints
) -> Bytes:
    """Pixels (n,) of the photograph of a stop, counted row by row, (n, 3).

    The veil of each ball is the mean of those of its pixels that are asked for; what of the Airy
    pattern is beyond the kernel adds to it.
    """
    camera = run.camera
    view = BallView(camera, run.balls[stop], camera.directions)
    kept = optics.kernel(view.pinhole_camera).sum()
    light = ball_light(view, scene, optics, pixels) / np.float32(kept)
    direction = camera.directions(view.centres(pixels))
    hits = view.hits(camera.pinhole, direction)
    light = with_scatter(light, hits.ball, scatter_of(optics, direction, hits) + 1 - kept)
    half = ord(run.reflector.camera_id)
    return developed(light, vignetting(camera, direction), optics, half, stop)


def scatter_of(optics: RealOptics, direction: Floats, hits: BallHits) -> Floats:
    """Share (n,) of light along directions (n, 3) that balls scatter; 0 where there is none."""
    cosine = norm(hits.direction - direction) / 2  # of incidence: the normal bisects both
    balls = max(len(optics.roughness_nm), int(hits.ball.max(initial=0)))
    rough = np.append(0.0, np.broadcast_to(optics.roughness_nm, balls))[hits.ball] * cosine
    return scattered_shares(rough)


def ball_light(view: BallView, scene: Scene, optics: RealOptics, pixels: Ints) -> Signal:
    """Light (n, 3) of pixels (n,), ascending, behind the lens, band by band, without veil."""
    camera = view.camera
    asked = np.zeros((camera.height_px + 2 * KERNEL_PX, camera.width_px), dtype=bool)
    asked[KERNEL_PX : KERNEL_PX + camera.height_px].flat[pixels] = True
    factors = kernel_factors(optics.kernel(view.pinhole_camera))
    found = np.zeros((len(pixels), 3), dtype=np.float32)
    for rows in row_bands(camera.height_px):
        first, last = np.searchsorted(pixels, camera.width_px * np.array([rows.start, rows.stop]))
        if first < last:
            near = asked[rows.start : rows.stop + 2 * KERNEL_PX]
            samples = _samples(view, scene, optics, (rows, maximum_filter(near, REACH)))
            whole = pixels_of_samples(samples, factors, optics.fine).reshape(-1, 3)
            found[first:last] = whole[pixels[first:last] - rows.start * camera.width_px]
    return found


def _samples(view: BallView, scene: Scene, optics: RealOptics, part: tuple[range, Bools]) -> Signal:
    """Fine samples of rows, with the reach of the kernel round them; 0 where none is needed."""
    rows, needed = part
    samples = no_samples(len(needed), needed.shape[1], optics.fine)
    row, column = np.nonzero(needed)
    centres = np.column_stack([column, row + rows.start - KERNEL_PX]).astype(np.float64)
    for one in lens_samples(view.camera.axes, optics):
        own = one.own(samples, optics.fine)
        own[row, column] = _seen(view, scene, optics.reflectance, (one, centres))
    return samples


def _seen(
    view: BallView, scene: Scene, reflectance: float, ray: tuple[LensSample, Floats]
) -> Colours:
    """What a ray of each of n pixels sees, (n, 3); without balls it is brighter."""
    one, centres = ray
    camera, aside = view.camera, one.point.aside
    straight = view.directions(centres + one.shift)
    depth = one.point.focus / (straight @ camera.axes[2])
    direction = unit(depth[:, None] * straight - aside)
    start = camera.pinhole + aside
    hits = view.hits(start, direction)
    colour = camera_colours(scene, start, direction, hits)
    colour[hits.ball == 0] /= np.float32(reflectance)
    return colour

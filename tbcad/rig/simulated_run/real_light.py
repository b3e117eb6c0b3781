"""Light of a run's frame behind a real lens: of the object, and of the LEDs in the balls.

Rays of both go through the same points of the pupil and off the balls as they are built, so that
highlights are as much out of focus as their images are. Then they are spread by pixel and Airy
pattern, and each ball scatters some of the light: as tbcad.light.simulate.capture.real does it.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from tbcad.common.compiled import compiled
from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.lens import KERNEL_PX, kernel_factors, pixel_kernel, through_pupil
from tbcad.light.simulate.capture.photograph import row_bands
from tbcad.light.simulate.capture.real import RealOptics, lens_samples, with_halo, with_scatter
from tbcad.light.simulate.capture.sensor import Signal
from tbcad.light.simulate.prototype.real_balls import REACH, BallView, ball_light, scatter_of
from tbcad.light.simulate.prototype.run import HALF_TURN, turned_balls
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import meets_sphere
from tbcad.rig.machine.designed import BuiltPrototype
from tbcad.rig.simulated_run.led_light import LightPoints, Occluders, balls_of_frame, led_light
from tbcad.types import Floats, Ints

PLACES = 8  # of a point of light along a pixel's side, between which its spread is linear


@dataclass(frozen=True)
class RealFrame:
    """A frame of a machine before a real lens; the object may be turned by 180 degrees."""

    built: BuiltPrototype
    number: int
    turned: bool
    directions: Floats  # unit ones through the pixels, (h, w, 3)
    optics: RealOptics

    @cached_property
    def view(self) -> BallView:
        """As the object sees it, which rests."""
        flip = HALF_TURN if self.turned else np.ones(3)
        camera = self.built.machine.camera
        camera = replace(camera, pinhole=camera.pinhole * flip, axes=camera.axes * flip)
        balls = turned_balls(balls_of_frame(self.built, self.number), flip)
        return BallView(
            camera,
            balls,
            lambda at: flip * between(self.directions, at),
            self.built.walls.flipped(flip),
        )

    @cached_property
    def veil(self) -> tuple[Ints, Floats]:
        """Ball (h, w), from 1, through the pinhole, or 0; and share that it scatters."""
        flip = HALF_TURN if self.turned else np.ones(3)
        parts = []
        for rows in row_bands(len(self.directions)):
            direction = flip * self.directions[rows.start : rows.stop].reshape(-1, 3)
            hits = self.view.hits(self.view.camera.pinhole, direction)
            parts.append((hits.ball, scatter_of(self.optics, direction, hits)))
        ball, share = (
            np.concatenate(one).reshape(self.directions.shape[:2])
            for one in zip(*parts, strict=True)
        )
        return ball, share

    def object_light(self, scene: Scene) -> Signal:
        """The lit object, (h, w, 3); 255 is white by the mirrors."""
        flip = HALF_TURN if self.turned else np.ones(3)
        pinhole = np.broadcast_to(self.view.camera.pinhole, self.directions.shape).reshape(-1, 3)
        shown = meets_sphere(pinhole, flip * self.directions.reshape(-1, 3), scene.radius)
        shown |= self.veil[0].ravel() > 0
        near = maximum_filter(shown.reshape(self.directions.shape[:2]), REACH)
        light = np.zeros(self.directions.shape, dtype=np.float32)
        light[near] = ball_light(self.view, scene, self.optics, np.flatnonzero(near))
        return self._veiled(light, self.optics.kernel(self.view.pinhole_camera))

    def led_images(
        self, occluders: Occluders, dome: float, brightness: Floats, faint: float
    ) -> list[Signal]:
        """Images (h, w) of LEDs with domes (mm) that fill pixels so far, (l,)."""
        points = self.led_points(occluders, dome, faint)
        kernel = pixel_kernel(self.optics.lens.cutoff(self.view.pinhole_camera.pixel_pitch), PLACES)
        factors, images = kernel_factors(kernel), []
        factors[:, :-1] *= PLACES
        for led, bright in enumerate(brightness.tolist()):
            image = np.zeros((*self.directions.shape[:2], 1), dtype=np.float32)
            pixel, area = points.of(led)
            _add_spread(image[..., 0], pixel, bright * area, factors, PLACES, KERNEL_PX)
            images.append(self._veiled(image, kernel)[..., 0])
        return images

    def led_points(self, occluders: Occluders, dome: float, faint: float) -> LightPoints:
        """Light of the LEDs through each of the lens's points of the pupil, in equal shares."""
        machine, optics = self.built.machine, self.optics
        every = lens_samples(machine.camera.axes, optics)
        found = []
        for one in every:
            camera = through_pupil(machine.camera, one.point.aside, one.point.focus)
            built = replace(self.built, machine=replace(machine, camera=camera))
            how = dome, faint, optics.reflectance
            found.append(led_light(built, self.number, self.turned, occluders, *how))
        led, pixel, area = (np.concatenate(one) for one in zip(*found, strict=True))
        return LightPoints(led, pixel, area / len(every))

    def _veiled(self, light: Signal, kernel: Floats) -> Signal:
        return with_scatter(with_halo(light, kernel), *self.veil)


def between(directions: Floats, places: Floats) -> Floats:
    """Unit directions (n, 3) at columns and rows (n, 2) beside pixels' centres, by their slope."""
    last = np.array(directions.shape[:2])[::-1] - 1
    corner = np.clip(np.floor(places).astype(np.int64), 0, last - 1)
    x, y = (places - corner).T[..., None]
    column, row = corner.T
    here = directions[row, column]
    across, down = directions[row, column + 1] - here, directions[row + 1, column] - here
    return unit(here + x * across + y * down)


@compiled
def _add_spread(
    image: NDArray[np.float32],
    pixel: Floats,
    light: Floats,
    factors: Floats,
    places: int,
    reach: int,
) -> None:
    """Add points with light (n,) at columns and rows (n, 2), spread by factors of a kernel.

    `factors` as of `kernel_factors`, of a kernel with so many places along a pixel's side.
    """
    ranks, samples = factors.shape[0], factors.shape[1] - 1
    size = 2 * reach + 2
    share = np.empty((2, ranks, size))
    first = np.empty(2, dtype=np.int64)
    for i in range(len(pixel)):
        for axis in range(2):
            first[axis] = int(np.floor(pixel[i, axis])) - reach
            for k in range(size):
                at = (first[axis] + k - pixel[i, axis]) * places + (samples - 1) / 2
                low = int(np.floor(at))
                for r in range(ranks):
                    share[axis, r, k] = 0.0
                    if 0 <= low < samples - 1:
                        rise = factors[r, low + 1] - factors[r, low]
                        share[axis, r, k] = factors[r, low] + (at - low) * rise
        for b in range(size):
            y = first[1] + b
            if 0 <= y < image.shape[0]:
                for a in range(size):
                    x = first[0] + a
                    if 0 <= x < image.shape[1]:
                        for r in range(ranks):
                            sign = factors[r, samples]
                            image[y, x] += sign * light[i] * share[0, r, a] * share[1, r, b]

"""The photograph that the prototype's camera takes at a stop: balls and object, no printed part.

All of it, or only the pixels between which something is wanted.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from tbcad.simulate.capture.photograph import BAND_ROWS, subpixel_shifts
from tbcad.simulate.parallel import in_threads
from tbcad.simulate.prototype.ball_rays import camera_colours, pixel_rays
from tbcad.simulate.prototype.run import PrototypeRun
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.types import Bytes, Floats, Ints

CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])


def stop_photograph(run: PrototypeRun, scene: Scene, stop: int, samples: int = 1) -> Bytes:
    """The whole photograph of a stop, numbered from 0, (h, w, 3).

    Args:
        run: of camera a's mirrors, or of camera b's with the object turned.
        scene: the object.
        stop: where the base stands.
        samples: a pixel is the mean of samples x samples rays.
    """
    height, width = run.view.height_px, run.view.width_px
    step = BAND_ROWS * width
    parts = [np.arange(k, min(k + step, height * width)) for k in range(0, height * width, step)]
    made = in_threads(partial(_pixels, run, scene, stop, samples), parts)
    return np.concatenate(made).reshape(height, width, 3)


def resampled_photograph(
    run: PrototypeRun, scene: Scene, stop: int, samples: int, places: Floats
) -> Bytes:
    """The photograph of a stop at columns and rows (n, 2) between its pixels' centres, (n, 3).

    Bilinear between the four nearest pixels, which are whole numbers as in a file.
    """
    corner = np.floor(places).astype(np.int64)
    x, y = (places - corner).T
    weight = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    # Beyond the last column and row a corner has no weight.
    near = corner[:, None] + CORNERS
    pixel = near[..., 0] + near[..., 1] * run.view.width_px
    needed, which = np.unique(pixel, return_inverse=True)
    taken = _pixels(run, scene, stop, samples, needed)[which.reshape(len(places), 4)]
    between = np.einsum("nk,nkc->nc", weight, taken)
    return np.asarray(np.rint(between), dtype=np.uint8)


def _pixels(run: PrototypeRun, scene: Scene, stop: int, samples: int, pixels: Ints) -> Bytes:
    """Pixels (n,) of a photograph, counted row by row, (n, 3)."""
    row, column = np.divmod(pixels, run.view.width_px)
    centres = np.column_stack([column, row]).astype(np.float64)
    stops = np.full(len(pixels), stop)
    total = np.zeros((len(pixels), 3), dtype=np.float32)
    for shift in subpixel_shifts(samples):
        total += camera_colours(run, scene, pixel_rays(run.view, centres + shift), stops)
    return np.asarray(np.rint(total / np.float32(samples**2)), dtype=np.uint8)

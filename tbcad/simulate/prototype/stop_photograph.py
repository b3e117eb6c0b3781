"""The photograph that the prototype's camera takes at a stop: balls and object, no printed part.

All of it, or only the pixels that are interpolated.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from tbcad.simulate.capture.photograph import row_bands, subpixel_shifts, to_bytes
from tbcad.simulate.parallel import in_threads
from tbcad.simulate.prototype.ball_rays import camera_colours, pixel_rays
from tbcad.simulate.prototype.run import PrototypeRun
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.types import Bytes, Floats, Ints

CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])


def stop_photograph(run: PrototypeRun, scene: Scene, stop: int, samples: int = 1) -> Bytes:
    """The whole photograph of a stop, (h, w, 3).

    Args:
        run: of camera a's mirrors, or of camera b's with the object turned.
        scene: the object.
        stop: number of the stop, from 0.
        samples: a pixel is the mean of samples x samples rays.
    """
    height, width = run.camera.height_px, run.camera.width_px
    bands = [np.arange(rows.start * width, rows.stop * width) for rows in row_bands(height)]
    colours = in_threads(partial(_pixels, run, scene, stop, samples), bands)
    return np.concatenate(colours).reshape(height, width, 3)


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
    pixel = near[..., 0] + near[..., 1] * run.camera.width_px
    traced, which = np.unique(pixel, return_inverse=True)
    corners = _pixels(run, scene, stop, samples, traced)[which.reshape(len(places), 4)]
    return to_bytes(np.einsum("nk,nkc->nc", weight, corners))


def _pixels(run: PrototypeRun, scene: Scene, stop: int, samples: int, pixels: Ints) -> Bytes:
    """Pixels (n,) of a photograph, counted row by row, (n, 3)."""
    row, column = np.divmod(pixels, run.camera.width_px)
    centres = np.column_stack([column, row]).astype(np.float64)
    stops = np.full(len(pixels), stop)
    total = np.zeros((len(pixels), 3), dtype=np.float32)
    for shift in subpixel_shifts(samples):
        total += camera_colours(run, scene, pixel_rays(run.camera, centres + shift), stops)
    return to_bytes(total / np.float32(samples**2))

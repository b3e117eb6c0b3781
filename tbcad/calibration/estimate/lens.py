"""Pixels of points before a lens camera, with derivatives by point and lens."""

import numpy as np

from tbcad.optics.camera import LensCamera, distorted
from tbcad.types import Floats

LENS = 9  # focal lengths 2, principal point 2, distortion 5


def projection(camera: LensCamera, image: Floats) -> tuple[Floats, Floats, Floats]:
    """Pixels of points in the camera's frame, and their derivatives.

    Args:
        camera: whose pose does not matter.
        image: along the rows, down the columns and forward, mm, (n, 3).

    Returns:
        Column and row (n, 2); by the point (n, 2, 3); by the lens (n, 2, LENS).
    """
    place = image[:, :2] / image[:, 2:]
    shown = distorted(place, camera.distortion)
    by_place, by_distortion = _distortion_slopes(place, camera.distortion)
    by_point = np.empty((len(image), 2, 3))
    by_point[:, :, :2] = by_place / image[:, 2, None, None]
    by_point[:, :, 2] = -(by_place @ place[..., None])[..., 0] / image[:, 2, None]
    by_lens = np.zeros((len(image), 2, LENS))
    for row in (0, 1):
        by_lens[:, row, row] = shown[:, row]
        by_lens[:, row, 2 + row] = 1
    by_lens[:, :, 4:] = camera.focal[:, None] * by_distortion
    pixel = shown * camera.focal + camera.principal
    return np.asarray(pixel), camera.focal[:, None] * by_point, by_lens


def _distortion_slopes(place: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """Of tbcad.optics.camera.distorted by the place (n, 2, 2), by k1 k2 p1 p2 k3 (n, 2, 5)."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = place.T
    s = x * x + y * y
    radial = 1 + s * (k1 + s * (k2 + s * k3))
    slope = 2 * (k1 + s * (2 * k2 + s * 3 * k3))
    cross = x * y * slope + 2 * p1 * x + 2 * p2 * y
    by_place = np.stack(
        [
            np.stack([radial + x * x * slope + 2 * p1 * y + 6 * p2 * x, cross], axis=-1),
            np.stack([cross, radial + y * y * slope + 6 * p1 * y + 2 * p2 * x], axis=-1),
        ],
        axis=1,
    )
    by_coefficients = np.stack(
        [
            np.stack([x * s, x * s**2, 2 * x * y, s + 2 * x * x, x * s**3], axis=-1),
            np.stack([y * s, y * s**2, s + 2 * y * y, 2 * x * y, y * s**3], axis=-1),
        ],
        axis=1,
    )
    return by_place, by_coefficients

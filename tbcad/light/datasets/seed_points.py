"""Points to begin with: the visual hull of the object in the exported pictures.

Splats and other point-based methods grow from points. A point of the capture sphere that several
virtual cameras see dark, as background, is not on the object (A. Laurentini, The visual hull
concept, IEEE PAMI 16, 150, 1994). Where the background is not dark nothing is carved away, and the
points fill the sphere; likewise where all of the object is dark. Neither a mesh nor depth is used.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.types import Bools, Bytes, Floats

CANDIDATES = 1 << 16  # in the cube around the capture sphere; half of them are in the sphere
MOST_CAMERAS = 96
DARK = 10  # of 255: background, but for noise
# A point is carved away where more of the cameras that see it see it dark than this.
DARK_SHARE = 0.05


@dataclass(frozen=True)
class SeedPoints:
    """Points on and in the object."""

    points: Floats  # mm, (n, 3)
    colours: Bytes  # median of what the virtual cameras see there, (n, 3)


def seed_points(
    cameras: list[Camera], pictures: Bytes, masks: Bools, capture_mm: float
) -> SeedPoints:
    """Points inside the visual hull; the same each time.

    Args:
        cameras: pinhole cameras, (m,).
        pictures: what they see, (m, h, w, 3).
        masks: where that is known, (m, h, w).
        capture_mm: diameter of the capture sphere.
    """
    points = _candidates(capture_mm / 2)
    step = -(-len(cameras) // MOST_CAMERAS)
    seen = [
        _colours(camera, picture, mask, points)
        for camera, picture, mask in zip(
            cameras[::step], pictures[::step], masks[::step], strict=True
        )
    ]
    colours, known = np.stack([one[0] for one in seen]), np.stack([one[1] for one in seen])
    dark = known & (colours.max(axis=2) < DARK)
    seen_at_all = known.any(axis=0)
    hull = seen_at_all & (dark.sum(axis=0) <= DARK_SHARE * known.sum(axis=0))
    kept = hull if hull.any() else seen_at_all
    values = np.where(known[:, kept, None], colours[:, kept].astype(np.float32), np.nan)
    median = np.nanmedian(values, axis=0)
    return SeedPoints(points[kept], np.rint(median).astype(np.uint8))


def _candidates(radius: float) -> Floats:
    cube = qmc.Halton(3, scramble=False).random(CANDIDATES)
    points = radius * (2 * cube - 1)
    return np.asarray(points[norm(points) < radius])


def _colours(camera: Camera, picture: Bytes, mask: Bools, points: Floats) -> tuple[Bytes, Bools]:
    """Colours (n, 3) of the pixels in which points (n, 3) appear, and whether they are known."""
    column, row = np.rint(camera.project(points)).astype(np.int64).T
    inside = (column >= 0) & (column < camera.width_px) & (row >= 0) & (row < camera.height_px)
    column, row = np.where(inside, column, 0), np.where(inside, row, 0)
    return picture[row, column], inside & mask[row, column]

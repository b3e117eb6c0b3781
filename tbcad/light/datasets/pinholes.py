"""Pinhole cameras as the files of radiance fields have them (transforms.json)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.crops import Crop
from tbcad.light.datasets.virtual_cameras import at_middle
from tbcad.types import Floats

# As many rays, evenly out of all, fix seven numbers as well as thousands.
FITTED_RAYS = 150
# Steps of the search that matter alike: radians and shares of the focal lengths, and pixels.
SCALES = np.array([0.01] * 5 + [1.0] * 2)


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera with its own focal length along rows and columns."""

    centre: Floats  # mm, (3,)
    axes: Floats  # rows: unit vectors along the rows, down the columns, and forward, (3, 3)
    focal_px: Floats  # along the rows and down the columns, (2,)
    principal_px: Floats  # column and row of the axis, (2,); the first pixel's centre is (0.5, 0.5)
    size_px: tuple[int, int]  # columns and rows

    @property
    def camera_to_world(self) -> list[list[float]]:
        """Matrix of a camera that looks along -z with +y up and +x to the right, 4 x 4."""
        right, down, forward = self.axes
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([right, -down, -forward, self.centre])
        return [[float(value) for value in row] for row in matrix]

    def intrinsics(self) -> dict[str, Any]:
        """Focal lengths, principal point and size by their names in transforms.json."""
        fl_x, fl_y = self.focal_px.tolist()
        cx, cy = self.principal_px.tolist()
        width, height = self.size_px
        return {"fl_x": fl_x, "fl_y": fl_y, "cx": cx, "cy": cy, "w": width, "h": height}


def pinhole_of(camera: Camera) -> Pinhole:
    """A camera with square pixels whose axis meets the middle of the picture."""
    size = np.array([camera.width_px, camera.height_px])
    focal = np.full(2, 1 / camera.pixel_pitch)
    return Pinhole(
        camera.pinhole, camera.axes, focal, size / 2, (camera.width_px, camera.height_px)
    )


def fitted_pinhole(crop: Crop, centre: Floats) -> Pinhole:
    """The pinhole camera in whose picture the rays of a crop are nearest to their pixels.

    A crop is distorted, so some pixels remain: training follows the rays. Poses tell the loader
    what no camera sees, and the viewer where to draw them.

    Args:
        crop: right way round; some of its rays meet the capture sphere.
        centre: best common point of these rays, mm, (3,).
    """
    rows, columns = np.nonzero(crop.meets)
    origin, direction = crop.rays
    some = slice(None, None, -(-len(rows) // FITTED_RAYS))
    points = at_middle(origin, direction, -unit(centre))[some] - centre
    pixels = np.stack([columns + 0.5, rows + 0.5], axis=1)[some]
    size = (crop.meets.shape[1], crop.meets.shape[0])
    start = _linear_fit(points, pixels, centre, size)

    def changed(change: Floats) -> Pinhole:
        axes = Rotation.from_rotvec(change[:3]).as_matrix() @ start.axes
        focal = start.focal_px * np.exp(change[3:5])
        return Pinhole(centre, axes, focal, start.principal_px + change[5:], size)

    def residuals(change: Floats) -> Floats:
        camera = changed(change)
        local = points @ camera.axes.T
        slopes = local[:, :2] / local[:, 2:]
        return (camera.focal_px * slopes + camera.principal_px - pixels).ravel()

    fitted = least_squares(residuals, np.zeros(len(SCALES)), x_scale=SCALES, method="lm")
    return changed(fitted.x)


def _linear_fit(points: Floats, pixels: Floats, centre: Floats, size: tuple[int, int]) -> Pinhole:
    """A camera along the mean ray: slopes as a linear function of the pixels, without its shear.

    The part of that function that is a rotation, its polar factor, turns the picture's axes.
    """
    forward = unit(points.mean(axis=0))
    right = unit(np.cross(forward, np.eye(3)[np.abs(forward).argmin()]))
    down = np.cross(forward, right)
    slopes = np.stack([dot(points, right), dot(points, down)], axis=1)
    slopes /= dot(points, forward)[:, None]
    table = np.column_stack([pixels, np.ones(len(pixels))])
    linear = np.linalg.lstsq(table, slopes, rcond=None)[0].T
    u, _, v = np.linalg.svd(linear[:, :2])
    rotation = u @ v
    focal = 1 / np.diag(rotation.T @ linear[:, :2])
    x, y = rotation.T @ np.stack([right, down])
    return Pinhole(
        centre, np.stack([x, y, forward]), focal, -focal * (rotation.T @ linear[:, 2]), size
    )

"""About the pinhole camera of a raw crop, for programs that ask for a pose beside the rays."""

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tbcad.datasets.crops import Crop
from tbcad.datasets.pinholes import Pinhole
from tbcad.datasets.virtual_cameras import at_middle
from tbcad.geometry.vectors import dot, unit
from tbcad.types import Floats

# As many rays, evenly out of all, fix seven numbers as well as thousands.
FITTED_RAYS = 150
# Steps of the search that matter alike: radians and shares of the focal lengths, and pixels.
SCALES = np.array([0.01] * 5 + [1.0] * 2)


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

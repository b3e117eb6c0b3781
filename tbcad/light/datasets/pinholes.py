"""Pinhole cameras in the files of radiance fields: nerfstudio's, and instant-ngp's with all rays.

After "Data conventions" of nerfstudio's documentation (docs.nerf.studio/quickstart/
data_conventions.html): matrices are from camera to world, cameras look along -z with +y up, and the
world's +z is up. After instant-ngp's loader of data sets (src/nerf_loader.cu): beside the image
NAME.png lie rays_NAME.dat, origin and direction of each pixel, row by row, six 32-bit floats in the
axes of transforms.json, and dynamic_mask_NAME.png, not black where a pixel is not used.

Splats and other point-based methods grow from points: seed points are in the visual hull of the
object in the exported pictures. A point of the capture sphere that several virtual cameras see
dark, as background, is not on the object (A. Laurentini, The visual hull concept, IEEE PAMI 16,
150, 1994). Where the background is not dark, or all of the object is, the points fill the sphere.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import qmc

from tbcad.cad.formats.mesh_files import points_ply
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import Camera, LensCamera
from tbcad.light.datasets.pictures import PinholePictures, crop_of
from tbcad.light.datasets.virtual_cameras import Crop, FittedCameras, at_middle
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.image_files import quick_png
from tbcad.light.simulate.parallel import in_batches
from tbcad.types import Bools, Bytes, Floats, Progress

# As many rays, evenly out of all, fix seven numbers as well as thousands.
FITTED_RAYS = 150
# Steps of the search that matter alike: radians and shares of the focal lengths, and pixels.
SCALES = np.array([0.01] * 5 + [1.0] * 2)
CORNER = 0.5  # of the first pixel from its centre, pixels: where files count from
TRANSFORMS, POINTS = "transforms.json", "points.ply"
IMAGES, MASKS = "images", "masks"
NO_DISTORTION = {"k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0}
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


def camera_to_world(centre: Floats, axes: Floats) -> list[list[float]]:
    """Matrix of a camera that looks along -z with +y up and +x to the right, 4 x 4.

    Axes are unit vectors along the rows, down the columns, and forward, (3, 3).
    """
    right, down, forward = axes
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, -down, -forward, centre])
    rows: list[list[float]] = matrix.tolist()
    return rows


def fitted_pinhole(crop: Crop, centre: Floats) -> LensCamera:
    """The pinhole camera in whose picture the rays of a crop are nearest to their pixels.

    A crop is distorted, so some pixels remain: training follows the rays. Poses tell the loader
    what no camera sees, and the viewer where to draw them. The crop is the right way round, and
    `centre` is the best common point, mm, (3,), of those of its rays that meet the capture sphere.
    """
    rows, columns = np.nonzero(crop.meets)
    origin, direction = crop.rays
    some = slice(None, None, -(-len(rows) // FITTED_RAYS))
    points = at_middle(origin, direction, -unit(centre))[some] - centre
    pixels = np.stack([columns + CORNER, rows + CORNER], axis=1)[some]
    first, start_focal, start_principal = _linear_fit(points, pixels)

    def changed(change: Floats) -> tuple[Floats, Floats, Floats]:
        axes = Rotation.from_rotvec(change[:3]).as_matrix() @ first
        return axes, start_focal * np.exp(change[3:5]), start_principal + change[5:]

    def residuals(change: Floats) -> Floats:
        axes, focal, principal = changed(change)
        local = points @ axes.T
        return (focal * (local[:, :2] / local[:, 2:]) + principal - pixels).ravel()

    fitted = least_squares(residuals, np.zeros(len(SCALES)), x_scale=SCALES, method="lm")
    axes, focal, principal = changed(fitted.x)
    height, width = crop.meets.shape
    return LensCamera(centre, axes, focal, principal - CORNER, np.zeros(5), width, height)


def _linear_fit(points: Floats, pixels: Floats) -> tuple[Floats, Floats, Floats]:
    """Axes (3, 3), focal lengths (2,) and principal point (2,) of a camera along the mean ray.

    Slopes as a linear function of the pixels, without its shear: the part of that function that is
    a rotation, its polar factor, turns the picture's axes.
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
    return np.stack([x, y, forward]), focal, -focal * (rotation.T @ linear[:, 2])


def write_nerfstudio(
    folder: Path, names: list[str], pictures: PinholePictures, seeds: SeedPoints
) -> None:
    """Write all files into a folder that exists."""
    write_pictures(folder, names, pictures, ".png")
    (folder / POINTS).write_bytes(points_ply(seeds.points, seeds.colours))
    text = json.dumps(transforms(names, pictures), indent=1) + "\n"
    (folder / TRANSFORMS).write_text(text, encoding="utf-8")


def transforms(names: list[str], pictures: PinholePictures) -> dict[str, object]:
    """The document of all cameras.

    Focal lengths differ and are given by frame; what all share is given once.
    """
    size = pictures.mask.shape[1]
    shared = {"cx": size / 2, "cy": size / 2, "w": size, "h": size}
    focal = pictures.focal_px.tolist()
    frames = [
        {
            "file_path": f"{IMAGES}/{name}.png",
            "mask_path": f"{MASKS}/{name}.png",
            **{"fl_x": one, "fl_y": one},
            "transform_matrix": camera_to_world(centre, axes),
        }
        for name, one, centre, axes in zip(
            names, focal, pictures.centre, pictures.axes, strict=True
        )
    ]
    return {
        "camera_model": "OPENCV",
        **shared,
        **NO_DISTORTION,
        "orientation_override": "none",
        "ply_file_path": POINTS,
        "frames": frames,
    }


def write_pictures(
    folder: Path, names: list[str], pictures: PinholePictures, mask_suffix: str
) -> None:
    """Write images/NAME.png and masks/NAME with a suffix: white where the picture is known."""
    (folder / IMAGES).mkdir()
    (folder / MASKS).mkdir()
    for name, picture, mask in zip(names, pictures.picture, pictures.mask, strict=True):
        (folder / IMAGES / f"{name}.png").write_bytes(quick_png(picture))
        (folder / MASKS / f"{name}{mask_suffix}").write_bytes(mask_png(mask))


def mask_png(mask: Bools) -> bytes:
    """A mask (h, w) as a grey picture: white where it is true."""
    return quick_png(np.where(mask, 255, 0).astype(np.uint8))


def write_ngp_rays(
    folder: Path, source: LightField, virtual: FittedCameras, progress: Progress
) -> None:
    """Write the crop of each mirror, right way round, with its rays, masks and about its pose."""
    images = folder / IMAGES
    images.mkdir()

    def write(k: int) -> dict[str, Any]:
        name = virtual.mirrors[k].name
        crop = crop_of(source, virtual.mirrors[k]).flipped()
        pinhole = fitted_pinhole(crop, virtual.centre[k])
        picture = np.where(crop.meets[..., None], crop.colour, 0)
        (images / f"{name}.png").write_bytes(quick_png(picture))
        (images / f"dynamic_mask_{name}.png").write_bytes(mask_png(~crop.meets))
        (images / f"rays_{name}.dat").write_bytes(rays_file(crop, pinhole))
        numbers = *pinhole.focal.tolist(), *(pinhole.principal + CORNER).tolist()
        return {
            "file_path": f"{IMAGES}/{name}.png",
            **dict(zip(("fl_x", "fl_y", "cx", "cy"), numbers, strict=True)),
            **{"w": pinhole.width_px, "h": pinhole.height_px},
            "transform_matrix": camera_to_world(pinhole.pinhole, pinhole.axes),
        }

    every = range(len(virtual))
    frames = list(in_batches(write, every, lambda k: progress(virtual.mirrors[k].name)))
    half = source.capture_mm / 2
    document = {"aabb": [[-half] * 3, [half] * 3], "aabb_scale": 1, "frames": frames}
    text = json.dumps(document, indent=1) + "\n"
    (folder / TRANSFORMS).write_text(text, encoding="utf-8")


def rays_file(crop: Crop, pinhole: LensCamera) -> bytes:
    """24 bytes a pixel; a pixel that is not used has the ray of the pinhole."""
    known, (row, column) = crop.meets[..., None], np.indices(crop.meets.shape)
    directions = pinhole.directions(np.stack([column, row], axis=-1).astype(np.float64))
    origin = np.where(known, crop.origin, pinhole.pinhole)
    direction = np.where(known, crop.direction, directions)
    return np.concatenate([origin, direction], axis=2).astype("<f4").tobytes()


def seed_points(
    cameras: list[Camera], pictures: Bytes, masks: Bools, capture_mm: float
) -> SeedPoints:
    """Points inside the visual hull; the same each time.

    Cameras (m,), what they see (m, h, w, 3), and where that is known (m, h, w).
    """
    points = capture_mm * (qmc.Halton(3, scramble=False).random(CANDIDATES) - 0.5)
    points = points[norm(points) < capture_mm / 2]
    step = -(-len(cameras) // MOST_CAMERAS)
    some = zip(cameras[::step], pictures[::step], masks[::step], strict=True)
    seen = [_colours(camera, picture, mask, points) for camera, picture, mask in some]
    colours, known = map(np.stack, zip(*seen, strict=True))
    dark = known & (colours.max(axis=2) < DARK)
    seen_at_all = known.any(axis=0)
    hull = seen_at_all & (dark.sum(axis=0) <= DARK_SHARE * known.sum(axis=0))
    kept = hull if hull.any() else seen_at_all
    values = np.where(known[:, kept, None], colours[:, kept].astype(np.float32), np.nan)
    median = np.nanmedian(values, axis=0)
    return SeedPoints(points[kept], np.rint(median).astype(np.uint8))


def _colours(camera: Camera, picture: Bytes, mask: Bools, points: Floats) -> tuple[Bytes, Bools]:
    """Colours (n, 3) of the pixels in which points (n, 3) appear, and whether they are known."""
    column, row = np.rint(camera.project(points)).astype(np.int64).T
    inside = (column >= 0) & (column < camera.width_px) & (row >= 0) & (row < camera.height_px)
    column, row = np.where(inside, column, 0), np.where(inside, row, 0)
    return picture[row, column], inside & mask[row, column]

"""Folders for instant-ngp with the ray of every pixel: nothing is resampled.

After instant-ngp's loader of data sets (src/nerf_loader.cu): beside the image NAME.png lie
rays_NAME.dat, origin and direction of each pixel, row by row, six 32-bit floats in the axes of
transforms.json, and dynamic_mask_NAME.png, not black where a pixel is not used.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.core.geometry.vectors import unit
from tbcad.light.datasets.crops import Crop
from tbcad.light.datasets.nerfstudio import IMAGES, TRANSFORMS, mask_png
from tbcad.light.datasets.pictures import crop_of
from tbcad.light.datasets.pinholes import Pinhole, fitted_pinhole
from tbcad.light.datasets.virtual_cameras import FittedCameras
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.image_files import png_bytes
from tbcad.light.simulate.parallel import in_batches
from tbcad.types import Floats, Progress


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
        (images / f"{name}.png").write_bytes(
            png_bytes(np.where(crop.meets[..., None], crop.colour, 0))
        )
        (images / f"dynamic_mask_{name}.png").write_bytes(mask_png(~crop.meets))
        (images / f"rays_{name}.dat").write_bytes(rays_file(crop, pinhole))
        return {
            "file_path": f"{IMAGES}/{name}.png",
            **pinhole.intrinsics(),
            "transform_matrix": pinhole.camera_to_world,
        }

    every = range(len(virtual))
    frames = list(in_batches(write, every, lambda k: progress(virtual.mirrors[k].name)))
    half = source.capture_mm / 2
    document = {"aabb": [[-half] * 3, [half] * 3], "aabb_scale": 1, "frames": frames}
    text = json.dumps(document, indent=1) + "\n"
    (folder / TRANSFORMS).write_text(text, encoding="utf-8")


def rays_file(crop: Crop, pinhole: Pinhole) -> bytes:
    """24 bytes a pixel; a pixel that is not used has the ray of the pinhole."""
    known = crop.meets[..., None]
    origin = np.where(known, crop.origin, pinhole.centre)
    direction = np.where(known, crop.direction, _central_rays(pinhole))
    return np.concatenate([origin, direction], axis=2).astype("<f4").tobytes()


def _central_rays(pinhole: Pinhole) -> Floats:
    width, height = pinhole.size_px
    x = (np.arange(width) + 0.5 - pinhole.principal_px[0]) / pinhole.focal_px[0]
    y = (np.arange(height) + 0.5 - pinhole.principal_px[1]) / pinhole.focal_px[1]
    right, down, forward = pinhole.axes
    return unit(forward + x[None, :, None] * right + y[:, None, None] * down)

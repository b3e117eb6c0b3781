"""Folders for nerfstudio: transforms.json, images, masks and points.

After "Data conventions" of its documentation (docs.nerf.studio/quickstart/data_conventions.html):
matrices are from camera to world, cameras look along -z with +y up, and the world's +z is up.
"""

import json
from pathlib import Path

import numpy as np

from tbcad.cad.formats.mesh_files import points_ply
from tbcad.light.datasets.pictures import Pictures
from tbcad.light.datasets.pinholes import pinhole_of
from tbcad.light.datasets.seed_points import SeedPoints
from tbcad.light.simulate.image_files import png_bytes
from tbcad.types import Bools

TRANSFORMS, POINTS = "transforms.json", "points.ply"
IMAGES, MASKS = "images", "masks"
NO_DISTORTION = {"k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0}


def write_nerfstudio(folder: Path, names: list[str], pictures: Pictures, seeds: SeedPoints) -> None:
    """Write all files into a folder that exists."""
    write_pictures(folder, names, pictures, ".png")
    (folder / POINTS).write_bytes(points_ply(seeds.points, seeds.colours))
    text = json.dumps(transforms(names, pictures), indent=1) + "\n"
    (folder / TRANSFORMS).write_text(text, encoding="utf-8")


def transforms(names: list[str], pictures: Pictures) -> dict[str, object]:
    """The document of all cameras.

    Focal lengths differ and are given by frame; what all share is given once.
    """
    pinholes = [pinhole_of(camera) for camera in pictures.cameras]
    shared = {name: pinholes[0].intrinsics()[name] for name in ("cx", "cy", "w", "h")}
    frames = [
        {
            "file_path": f"{IMAGES}/{name}.png",
            "mask_path": f"{MASKS}/{name}.png",
            **{key: one.intrinsics()[key] for key in ("fl_x", "fl_y")},
            "transform_matrix": one.camera_to_world,
        }
        for name, one in zip(names, pinholes, strict=True)
    ]
    return {
        "camera_model": "OPENCV",
        **shared,
        **NO_DISTORTION,
        "orientation_override": "none",
        "ply_file_path": POINTS,
        "frames": frames,
    }


def write_pictures(folder: Path, names: list[str], pictures: Pictures, mask_suffix: str) -> None:
    """Write images/NAME.png and masks/NAME with a suffix: white where the picture is known."""
    (folder / IMAGES).mkdir()
    (folder / MASKS).mkdir()
    for name, picture, mask in zip(names, pictures.picture, pictures.mask, strict=True):
        (folder / IMAGES / f"{name}.png").write_bytes(png_bytes(picture))
        (folder / MASKS / f"{name}{mask_suffix}").write_bytes(mask_png(mask))


def mask_png(mask: Bools) -> bytes:
    """A mask (h, w) as a grey picture: white where it is true."""
    return png_bytes(np.where(mask, 255, 0).astype(np.uint8))

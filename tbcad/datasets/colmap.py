"""Folders for COLMAP and what reads its models (gsplat, 3D Gaussian Splatting ...)."""

from pathlib import Path

import numpy as np

from tbcad.datasets.nerfstudio import write_pictures
from tbcad.datasets.pictures import Pictures
from tbcad.datasets.pinholes import pinhole_of
from tbcad.datasets.seed_points import SeedPoints
from tbcad.formats.colmap import SparseModel

MODEL = Path("sparse", "0")
# COLMAP looks for the mask of a0001.png as a0001.png.png.
MASK_SUFFIX = ".png.png"


def write_colmap(folder: Path, names: list[str], pictures: Pictures, seeds: SeedPoints) -> None:
    """Write images, masks and the sparse model into a folder that exists."""
    write_pictures(folder, names, pictures, MASK_SUFFIX)
    (folder / MODEL).mkdir(parents=True)
    for name, data in sparse_model(names, pictures, seeds).files().items():
        (folder / MODEL / name).write_bytes(data)


def sparse_model(names: list[str], pictures: Pictures, seeds: SeedPoints) -> SparseModel:
    """The cameras and points as COLMAP has them."""
    pinholes = [pinhole_of(camera) for camera in pictures.cameras]
    intrinsics = [np.concatenate([one.focal_px, one.principal_px]) for one in pinholes]
    return SparseModel(
        tuple(f"{name}.png" for name in names),
        pinholes[0].size_px,
        np.array(intrinsics),
        np.array([one.axes for one in pinholes]),
        np.array([one.centre for one in pinholes]),
        seeds.points,
        seeds.colours,
    )

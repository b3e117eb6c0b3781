"""A turntable: one page with pictures from all around the object, which opens from disk."""

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

from tbcad.common.atomic_files import replace_files
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.depth.plane_sweep import QUICK
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.simulate.scene.viewpoint import camera_around_object
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.viewer.page import filled
from tbcad.light.viewer.render import MethodAtRest, capture_mm
from tbcad.output.single_files import check_file
from tbcad.types import Bytes, Progress

MAX_BYTES = 6_000_000
BEGIN = "<!doctype html>\n<!-- tbcad turntable -->"
# Tried one after the other until the page is small enough.
WEBP_QUALITIES = (85, 75, 65, 50, 35, 20)
LOWEST_DEG, HIGHEST_DEG = 15.0, 75.0
KIND = "data:image/webp;base64,"


@dataclass(frozen=True)
class Turntable:
    """Which pictures a turntable has."""

    columns: int  # views once around
    elevations_deg: tuple[float, ...]  # a row of views each
    distance: float  # of the camera from the middle of the object, mm
    size: tuple[int, int]  # columns and rows of a picture
    method: MethodAtRest  # how those of a light field are made


def even_elevations(rows: int, middle_deg: float) -> tuple[float, ...]:
    """Elevations of rows: one at `middle_deg`, more evenly from LOWEST_DEG to HIGHEST_DEG."""
    if rows == 1:
        return (middle_deg,)
    return tuple(np.linspace(LOWEST_DEG, HIGHEST_DEG, rows).tolist())


def check_turntable_path(file: Path, force: bool) -> None:
    """Refuse, before any work, a file that cannot be written or that exists.

    Raises:
        InputError: as said.
    """
    if file.suffix.lower() != ".html" or not file.parent.is_dir() or file.is_dir():
        raise InputError(f"{file}: give a file that ends in .html, in a folder that exists")
    check_file(file, force)


def write_turntable(
    file: Path, shown: MirrorTiles | Field, table: Turntable, title: str, progress: Progress
) -> int:
    """Write the page of a light field or a field; its size in bytes.

    Raises:
        InputError: it cannot be written, or so many views do not fit into MAX_BYTES.
    """
    picture, pictures = _maker(shown, table, progress), []
    for k, elevation in enumerate(table.elevations_deg):
        progress(f"row {k + 1} of {len(table.elevations_deg)}, elevation {elevation:.0f} degrees")
        pictures.append([picture(elevation, i) for i in range(table.columns)])
    page = smallest_loss(pictures, table, title)
    replace_files(file.parent, {file.name: page})
    return len(page)


def smallest_loss(
    pictures: Sequence[Sequence[Bytes]], table: Turntable, title: str, most: int = MAX_BYTES
) -> bytes:
    """The page with the best pictures that fit.

    Raises:
        InputError: none fit.
    """
    for quality in WEBP_QUALITIES:
        page = turntable_page(pictures, table, title, quality).encode("utf-8")
        if len(page) <= most:
            return page
    raise InputError(
        f"{table.columns} x {len(pictures)} views do not fit into {most / 1e6:g} MB: give fewer "
        "--frames or --rows, or a smaller --width and --height"
    )


def turntable_page(
    pictures: Sequence[Sequence[Bytes]], table: Turntable, title: str, quality: int
) -> str:
    """The page with its pictures (h, w, 3), row by row, in WebP of a quality."""
    frames = [[_webp(picture, quality) for picture in row] for row in pictures]
    data = {
        "size": table.size,
        "elevations": table.elevations_deg,
        "row": len(frames) // 2,
        "kind": KIND,
        "frames": frames,
    }
    views = sum(map(len, frames))
    about = f"{views} views of {table.size[0]} x {table.size[1]} pixels."
    return filled("turntable", title, data, begin=BEGIN, images="data: blob:", about=about)


def _maker(
    shown: MirrorTiles | Field, table: Turntable, progress: Progress
) -> Callable[[float, int], Bytes]:
    """What makes the picture of an elevation, degrees, and a column."""
    of_camera = _pictures(shown, table.method, progress)
    capture = capture_mm(shown)

    def picture(elevation: float, column: int) -> Bytes:
        place = 2 * np.pi * column / table.columns, float(np.radians(elevation)), table.distance
        return of_camera(camera_around_object(*place, capture, table.size))

    return picture


def _pictures(
    shown: MirrorTiles | Field, method: MethodAtRest, progress: Progress
) -> Callable[[Camera], Bytes]:
    """What makes the picture (h, w, 3) of a camera."""
    if isinstance(shown, Field):
        return lambda camera: field_picture(shown, camera).image
    if method == "depth":
        views = depth_views(shown, QUICK, progress)
        return lambda camera: views.of(camera)[0].image
    return lambda camera: synthesise(shown, camera, method).image


def _webp(image: Bytes, quality: int) -> str:
    with BytesIO() as buffer:
        Image.fromarray(image).save(buffer, "WEBP", quality=quality, method=4)
        return base64.b64encode(buffer.getvalue()).decode("ascii")

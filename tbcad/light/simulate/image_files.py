"""Images as files, each replaced as a whole, and several side by side in one."""

from collections.abc import Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tbcad.common.atomic_files import refuse_existing, replace_files
from tbcad.common.figure_files import image_bytes
from tbcad.errors import InputError
from tbcad.types import Bytes

STILL_SUFFIXES = (".png",)
ANIMATED_SUFFIXES = (".gif", ".webp", ".png")
LABEL_PX = 22
GAP_PX = 4
FRAME_MS = 120
quick_png = partial(image_bytes, compress_level=3)


def check_image_path(
    file: Path, force: bool = False, suffixes: Sequence[str] = STILL_SUFFIXES
) -> None:
    """Refuse a file that could not be written, before long work.

    InputError: another kind of file, its folder does not exist, or the file exists.
    """
    if file.suffix.lower() not in suffixes:
        raise InputError(f"{file}: name a file that ends in {' or '.join(suffixes)}")
    if not file.parent.is_dir():
        raise InputError(f"{file}: its folder does not exist: make it, or choose another")
    if file.is_dir():
        raise InputError(f"{file} is a folder: choose another name")
    refuse_existing(file, force)


def write_images(images: Mapping[Path, Bytes]) -> None:
    """Write images (h, w, 3) into one folder, each replaced as a whole, none before all are made.

    InputError: the folder cannot be written.
    """
    folder = next(iter(images)).parent
    replace_files(folder, {path.name: quick_png(image) for path, image in images.items()})


def write_animation(path: Path, frames: Sequence[Bytes]) -> None:
    """Write images (h, w, 3) as one that moves forward and back without end.

    InputError: the folder cannot be written.
    """
    images = [Image.fromarray(frame) for frame in frames]
    cycle = images + images[-2:0:-1]
    data, kind = BytesIO(), path.suffix.lower()[1:]
    options = {"lossless": True} if kind == "webp" else {}
    cycle[0].save(
        data, kind, save_all=True, append_images=cycle[1:], duration=FRAME_MS, loop=0, **options
    )
    replace_files(path.parent, {path.name: data.getvalue()})


def side_by_side(pictures: Mapping[str, Bytes]) -> Bytes:
    """Pictures of one size in a row, each under its name."""
    height, width = next(iter(pictures.values())).shape[:2]
    count = len(pictures)
    sheet = Image.new("RGB", (count * width + (count - 1) * GAP_PX, height + LABEL_PX), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    for k, (name, picture) in enumerate(pictures.items()):
        x = k * (width + GAP_PX)
        sheet.paste(Image.fromarray(picture), (x, LABEL_PX))
        draw.text((x + 4, 3), name, fill="black", font=font)
    return np.asarray(sheet)


def difference(truth: Bytes, picture: Bytes) -> Bytes:
    """How far two pictures (h, w, 3) are apart, black where they are equal."""
    return np.abs(truth.astype(np.int16) - picture.astype(np.int16)).astype(np.uint8)

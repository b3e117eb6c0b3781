"""Images as files, each replaced atomically, and several side by side in one."""

from collections.abc import Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tbcad.common.atomic_files import replace_files
from tbcad.common.figure_files import image_bytes
from tbcad.types import Bytes

ANIMATED_SUFFIXES = (".gif", ".webp", ".png")
LABEL_PX = 22
GAP_PX = 4
FRAME_MS = 120
quick_png = partial(image_bytes, compress_level=3)


def write_images(images: Mapping[Path, Bytes]) -> None:
    """Write images (h, w, 3) into one folder, each replaced atomically, none before all are made.

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

"""Images as files, each replaced atomically, and several side by side in one."""

from collections.abc import Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tbcad.common.atomic_files import replace_files
from tbcad.common.figure_files import image_bytes, shade_bytes
from tbcad.types import Bytes

ANIMATED_SUFFIXES = (".gif", ".webp", ".png")
LEAST_LETTERS_PX, LETTERS_A_WIDTH = 14, 60  # height of letters, and of a sheet's width
MOST_APART = 50.0  # % of white where the map of differences ends
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


def compared(pictures: Mapping[str, Bytes]) -> Bytes:
    """A picture and the truth under their names, and a map of their difference with its scale."""
    picture, truth = pictures.values()
    sheet = Image.fromarray(side_by_side({**pictures, "difference": difference(truth, picture)}))
    left, label = 2 * (truth.shape[1] + GAP_PX), sheet.height - truth.shape[0]
    draw, font = ImageDraw.Draw(sheet), _font(sheet.width)
    end = f"{MOST_APART:g} % of white"
    right = sheet.width - round(draw.textlength(end, font)) - label // 4
    low = left + round(draw.textlength("difference  0  ", font)) + label // 4
    draw.text((right, label // 8), end, fill="black", font=font)
    draw.text((left + label // 4, label // 8), "difference  0", fill="black", font=font)
    ramp = np.tile(np.linspace(0, 1, max(right - low - label // 4, 2)), (label // 2, 1))
    sheet.paste(Image.fromarray(shade_bytes(ramp)), (low, label // 4))
    return np.asarray(sheet)


def side_by_side(pictures: Mapping[str, Bytes]) -> Bytes:
    """Pictures of one size in a row, each under its name."""
    height, width = next(iter(pictures.values())).shape[:2]
    whole = len(pictures) * (width + GAP_PX) - GAP_PX
    font = _font(whole)
    label = round(1.5 * font.size)
    sheet = Image.new("RGB", (whole, height + label), "white")
    draw = ImageDraw.Draw(sheet)
    for k, (name, picture) in enumerate(pictures.items()):
        x = k * (width + GAP_PX)
        sheet.paste(Image.fromarray(picture), (x, label))
        draw.text((x + label // 4, label // 8), name, fill="black", font=font)
    return np.asarray(sheet)


def _font(width: int) -> ImageFont.FreeTypeFont:
    """Letters that can be read where a sheet of a width is shown on half a screen."""
    font = ImageFont.load_default(max(LEAST_LETTERS_PX, width / LETTERS_A_WIDTH))
    assert isinstance(font, ImageFont.FreeTypeFont)
    return font


def difference(truth: Bytes, picture: Bytes) -> Bytes:
    """The largest difference of the channels of two pictures (h, w, 3), as shades of a map.

    From 0 to MOST_APART percent of white; more has the shade of that.
    """
    apart = np.abs(truth.astype(np.int16) - picture.astype(np.int16)).max(axis=-1)
    return shade_bytes((apart / (255 * MOST_APART / 100)).clip(0, 1))

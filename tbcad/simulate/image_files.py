"""Pictures as files: written whole or not at all, and two of them side by side."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tbcad.errors import InputError
from tbcad.types import Bytes

STILL_SUFFIXES = (".png",)
ANIMATED_SUFFIXES = (".gif", ".webp", ".png")
LABEL_PX = 22
GAP_PX = 4
FRAME_MS = 120


def check_image_path(file: Path, suffixes: Sequence[str] = STILL_SUFFIXES) -> None:
    """Refuse a file that could not be written, before long work.

    Raises:
        InputError: another kind of file, or its folder does not exist.
    """
    if file.suffix.lower() not in suffixes:
        raise InputError(f"{file}: name a file that ends in {' or '.join(suffixes)}")
    if not file.parent.is_dir():
        raise InputError(f"{file}: its folder does not exist: make it, or choose another")
    if file.is_dir():
        raise InputError(f"{file} is a folder: choose another name")


def write_images(pictures: Mapping[Path, Bytes]) -> None:
    """Write pictures (h, w, 3), each replaced as a whole, none before all are made."""
    _written({file: _encoder(picture) for file, picture in pictures.items()})


def write_animation(file: Path, frames: Sequence[Bytes]) -> None:
    """Write pictures (h, w, 3) as one that moves there and back without end."""
    images = [Image.fromarray(frame) for frame in frames]
    cycle = images + images[-2:0:-1]

    def save(place: Path) -> None:
        more: dict[str, Any] = {"lossless": True} if file.suffix.lower() == ".webp" else {}
        cycle[0].save(
            place, save_all=True, append_images=cycle[1:], duration=FRAME_MS, loop=0, **more
        )

    _written({file: save})


def side_by_side(pictures: Mapping[str, Bytes]) -> Bytes:
    """Pictures of one size in a row, each under its name."""
    height, width = next(iter(pictures.values())).shape[:2]
    count = len(pictures)
    sheet = Image.new("RGB", (count * width + (count - 1) * GAP_PX, height + LABEL_PX), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    for k, (name, picture) in enumerate(pictures.items()):
        left = k * (width + GAP_PX)
        sheet.paste(Image.fromarray(picture), (left, LABEL_PX))
        draw.text((left + 4, 3), name, fill="black", font=font)
    return np.asarray(sheet)


def difference(truth: Bytes, picture: Bytes) -> Bytes:
    """How far two pictures (h, w, 3) are apart, black where they are equal."""
    return np.abs(truth.astype(np.int16) - picture.astype(np.int16)).astype(np.uint8)


def _encoder(picture: Bytes) -> Any:
    return lambda place: Image.fromarray(picture).save(place, compress_level=3)


def _written(files: Mapping[Path, Any]) -> None:
    folder = next(iter(files)).parent
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".tbcad-picture-") as made:
            places = {file: Path(made) / file.name for file in files}
            for file, save in files.items():
                save(places[file])
            for file, place in places.items():
                place.replace(file)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{folder} cannot be written: {reason}: choose another") from error

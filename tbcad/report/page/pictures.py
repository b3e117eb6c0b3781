"""Pictures in the page: those beside the build, and the photographs of a capture."""

import base64
import warnings
from collections.abc import Iterator
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tbcad.cad.formats.pictures import visible_files
from tbcad.errors import InputError
from tbcad.types import Bytes

SUFFIXES = (".png", ".jpg", ".jpeg")
MAX_FILE_BYTES = 40_000_000
MAX_SIDE_PX = 1600
PHOTOGRAPH_SIDE_PX = 2080
QUALITY = 85


class Picture(NamedTuple):
    """A picture as a JPEG: file name, width and height in pixels, bytes."""

    name: str
    width: int
    height: int
    data: bytes

    @property
    def url(self) -> str:
        """The picture itself as an address."""
        return f"data:image/jpeg;base64,{base64.b64encode(self.data).decode('ascii')}"


def read_pictures(folder: Path) -> list[Picture]:
    """The pictures in a folder by name, made smaller where they are large; others are left out."""
    found = (_read(path) for path in visible_files(folder, SUFFIXES) if path.is_file())
    return [one for one in found if one is not None]


def pictures_html(pictures: list[Picture]) -> Iterator[str]:
    """The pictures with their names."""
    if not pictures:
        yield (
            "<p>No pictures in the folder. <code>tbcad picture</code> draws some; then run "
            "<code>tbcad report</code> again.</p>"
        )
    for one in pictures:
        yield (
            f"<figure><img loading=lazy width={one.width} height={one.height} "
            f'alt="{escape(one.name)}" src="{one.url}"><figcaption>{escape(one.name)}'
            "</figcaption></figure>"
        )


def photographs(capture: Path, ids: list[str]) -> dict[str, Any]:
    """Both photographs of a capture for the page, and where each mirror is in them, by camera.

    Of each the picture's address, the factor from its pixels to those of the boxes, and boxes of
    all mirrors by their ids, camera a's first: x0, y0, x1, y1 in pixels of the photograph.
    InputError: the capture cannot be read, or is of another design.
    """
    from tbcad.light.simulate.capture.light_field import LightField

    record = {}
    with LightField.open(capture) as field:
        for camera, frame in field.frames.items():
            wanted = sum(one.startswith(camera) for one in ids)
            if len(frame.u) != wanted:
                raise InputError(
                    f"{capture}: camera {camera} has {len(frame.u)} mirrors, the build {wanted}: "
                    "name a capture of this build"
                )
            picture = _jpeg(camera, frame.image(), PHOTOGRAPH_SIDE_PX)
            x0, x1, y0, y1 = frame.boxes.T
            record[camera] = {
                "url": picture.url,
                "size": [frame.camera.width_px, frame.camera.height_px],
                "boxes": np.column_stack([x0, y0, x1, y1]).tolist(),
            }
    return record


def _read(path: Path) -> Picture | None:
    from PIL import Image

    if path.stat().st_size > MAX_FILE_BYTES:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of a picture that is far too large
            with Image.open(path, formats=("PNG", "JPEG")) as image:
                image.draft("RGB", (MAX_SIDE_PX, MAX_SIDE_PX))
                return _jpeg(path.name, _in_8_bits(_on_white(image)), MAX_SIDE_PX)
    except (OSError, ValueError, SyntaxError, Warning, Image.DecompressionBombError):
        return None


def _in_8_bits(image: Any) -> Bytes:
    """Grey (h, w) or red, green, blue (h, w, 3)."""
    if image.mode.startswith("I;16"):
        return np.asarray(np.asarray(image) >> 8, np.uint8)
    return np.asarray(image.convert("L" if image.mode in {"1", "L"} else "RGB"))


def _on_white(image: Any) -> Any:
    from PIL import Image

    if "A" not in image.getbands() and "transparency" not in image.info:
        return image
    drawn = image.convert("RGBA")
    return Image.alpha_composite(Image.new("RGBA", drawn.size, "white"), drawn).convert("RGB")


def _jpeg(name: str, pixels: Any, side: int) -> Picture:
    from PIL import Image

    image = Image.fromarray(pixels)
    image.thumbnail((side, side), Image.Resampling.LANCZOS)
    data = BytesIO()
    image.save(data, "jpeg", quality=QUALITY, optimize=True)
    return Picture(name, image.width, image.height, data.getvalue())

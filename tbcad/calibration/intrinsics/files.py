"""A lens read from a file of OpenCV, mrcal or COLMAP, recognised by what is in it."""

import ast
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.calibration.intrinsics.lens import Lens
from tbcad.calibration.intrinsics.opencv import opencv_lens
from tbcad.errors import InputError

MAX_BYTES = 2_000_000
COEFFICIENTS = 5  # k1, k2, p1, p2, k3; what follows must be zero
COLMAP_CENTRE = 0.5
"""COLMAP's pixels begin at whole numbers, so their centres are half a pixel farther."""
COLMAP_LINE = re.compile(r"^\s*\d+\s+([A-Z_]+)\s+(\d+)\s+(\d+)((?:\s+[-+.\deE]+)+)\s*$", re.M)
# Each model's parameters in the order focal x, focal y, principal x and y, k1, k2, p1, p2, k3 ...
COLMAP = {
    "SIMPLE_PINHOLE": (0, 0, 1, 2),
    "PINHOLE": (0, 1, 2, 3),
    "SIMPLE_RADIAL": (0, 0, 1, 2, 3),
    "RADIAL": (0, 0, 1, 2, 3, 4),
    "OPENCV": (0, 1, 2, 3, 4, 5, 6, 7),
    "FULL_OPENCV": tuple(range(12)),
}
MRCAL = re.compile(r"LENSMODEL_(PINHOLE|OPENCV4|OPENCV5|OPENCV8|OPENCV12)")
USABLE = "use a pinhole with OpenCV's k1, k2, p1, p2, k3"


def read_lens(path: Path) -> Lens:
    """The lens in a file.

    Raises:
        InputError: the file cannot be read, is none of these, or has another model of the lens.
    """
    text = _text(path)
    for reader, mark in READERS:
        if mark.search(text):
            return reader(text, str(path)).checked(str(path))
    raise InputError(
        f"{path} is no lens: name a file of OpenCV (YAML, XML), mrcal (.cameramodel), COLMAP "
        "(cameras.txt) or tbcad intrinsics"
    )


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path} has more than {MAX_BYTES} bytes: it is no lens")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {error}") from None


def _mrcal(text: str, name: str) -> Lens:
    try:
        found: Any = ast.literal_eval(text.strip())
        model = str(found.get("lensmodel", found.get("lens_model")))
        values = np.array([float(value) for value in found["intrinsics"]])
        width, height = (int(value) for value in found["imagersize"])
    except (ValueError, SyntaxError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError(f"{name} is no .cameramodel that mrcal wrote: export it again") from None
    if not MRCAL.fullmatch(model):
        raise InputError(
            f"{name} has the lens model {model:.60}: {USABLE} (mrcal-convert-lensmodel)"
        )
    return _lens(values, (width, height), name)


def _colmap(text: str, name: str) -> Lens:
    cameras = COLMAP_LINE.findall(text)
    if len(cameras) != 1:
        raise InputError(f"{name} has {len(cameras)} cameras: keep the line of one")
    model, width, height, rest = cameras[0]
    order = COLMAP.get(model)
    if order is None:
        raise InputError(f"{name} has the lens model {model:.60}: {USABLE} (model OPENCV)")
    try:
        given = [float(value) for value in rest.split()]
    except ValueError:
        raise InputError(
            f"{name}: parameters of the camera are no numbers: export it again"
        ) from None
    if len(given) != max(order) + 1:
        raise InputError(
            f"{name}: {model} has {max(order) + 1} parameters, found {len(given)}: export it again"
        )
    values = np.array([given[place] for place in order])
    values[2:4] -= COLMAP_CENTRE
    return _lens(values, (int(width), int(height)), name)


def _lens(values: np.ndarray, size: tuple[int, int], name: str) -> Lens:
    """From focal lengths, principal point and OpenCV's coefficients, as many as there are."""
    if len(values) < 4:
        raise InputError(f"{name} has {len(values)} numbers, 4 or more are needed: export it again")
    coefficients = np.zeros(max(COEFFICIENTS, len(values) - 4))
    coefficients[: len(values) - 4] = values[4:]
    if coefficients[COEFFICIENTS:].any():
        raise InputError(f"{name} has more than five coefficients of distortion: {USABLE}")
    return Lens(values[:2], values[2:4], coefficients[:COEFFICIENTS], *size)


def _opencv(text: str, name: str) -> Lens:
    values, size = opencv_lens(text, name)
    lens = _lens(values, size or (1, 1), name)
    return lens if size else Lens(lens.focal, lens.principal, lens.distortion)


READERS: tuple[tuple[Callable[[str, str], Lens], re.Pattern[str]], ...] = (
    (_opencv, re.compile(r"\A\s*(%YAML|<\?xml|<opencv_storage)")),
    (_mrcal, re.compile(r"['\"]lens_?model['\"]")),
    (_colmap, COLMAP_LINE),
)
